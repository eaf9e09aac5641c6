// SPDX-License-Identifier: MIT
#include "StatusOverlay.h"

#include <osg/Geode>

#include <iomanip>
#include <sstream>

namespace osgTessLOD {

namespace {

constexpr double kIntervalMilliseconds = 250.0;

std::string statusLine(double frameMilliseconds, const SelectionSums& sums, const SelectionOptions& options)
{
    std::ostringstream line;
    line << std::fixed << std::setprecision(1) << frameMilliseconds << " ms   ";
    line << (sums.isUpperBound ? "at most " : "") << sums.patches << " patches (" << sums.culledPatches << " culled, "
         << sums.saturatedPatches << " saturated)   " << sums.triangles << " triangles   error asked "
         << std::setprecision(2) << options.errorPixels << " px" << (options.cullPatches ? "" : "   no culling")
         << (options.frozen ? "   frozen" : "") << "\npatches per factor";
    for (const auto& [factor, patches] : sums.patchesByFactor) { line << "   " << factor << ": " << patches; }
    return line.str();
}

} // namespace

StatusOverlay::StatusOverlay()
    : _camera(new osg::Camera)
    , _text(new osgText::Text)
    , _intervalStart(osg::Timer::instance()->tick())
{
    _text->setDataVariance(osg::Object::DYNAMIC); // frame() waits for its draw, so that update() may change it
    _text->setCharacterSize(16.0F);
    _text->setPosition(osg::Vec3(10.0F, 34.0F, 0.0F));
    _text->setBackdropType(osgText::Text::OUTLINE);
    _text->setBackdropColor(osg::Vec4(0.0F, 0.0F, 0.0F, 1.0F));

    osg::ref_ptr<osg::Geode> geode = new osg::Geode;
    geode->addDrawable(_text);
    osg::StateSet* stateSet = geode->getOrCreateStateSet();
    stateSet->setMode(GL_LIGHTING, osg::StateAttribute::OFF | osg::StateAttribute::PROTECTED);
    stateSet->setMode(GL_DEPTH_TEST, osg::StateAttribute::OFF);

    _camera->setReferenceFrame(osg::Transform::ABSOLUTE_RF);
    _camera->setViewMatrix(osg::Matrix::identity());
    _camera->setClearMask(GL_DEPTH_BUFFER_BIT);
    _camera->setRenderOrder(osg::Camera::POST_RENDER);
    _camera->setAllowEventFocus(false);
    _camera->setComputeNearFarMode(osg::Camera::DO_NOT_COMPUTE_NEAR_FAR);
    _camera->addChild(geode);
}

void StatusOverlay::update(const SelectionSums& sums, const SelectionOptions& options, double width, double height)
{
    ++_intervalFrames;
    const osg::Timer_t now = osg::Timer::instance()->tick();
    const double elapsed = osg::Timer::instance()->delta_m(_intervalStart, now);
    if (elapsed >= kIntervalMilliseconds) {
        _frameMilliseconds = elapsed / _intervalFrames;
        _intervalFrames = 0;
        _intervalStart = now;
    }
    _camera->setProjectionMatrixAsOrtho2D(0.0, width, 0.0, height);
    _text->setText(statusLine(_frameMilliseconds, sums, options));
}

} // namespace osgTessLOD
