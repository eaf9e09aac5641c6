// SPDX-License-Identifier: MIT
#include "TessLODEventHandler.h"

#include "SelectionStatsLines.h"

#include <osg/Stats>
#include <osgViewer/View>
#include <osgViewer/ViewerBase>

#include <algorithm>

namespace osgTessLOD {

namespace {

// None of these is a key of osgviewer's event handlers or camera manipulators.
constexpr int kFinerKey = '[';
constexpr int kCoarserKey = ']';
constexpr int kFreezeKey = 'x';
constexpr int kColorKey = 'k';
constexpr int kCullKey = 'u';
constexpr int kOverlayKey = 'y';

struct KeyUse {
    int key;
    const char* what;
};

constexpr KeyUse kKeyUses[] = {
    {kFinerKey, "Ask for a smaller error on screen"},
    {kCoarserKey, "Ask for a larger error on screen"},
    {kFreezeKey, "Freeze the selection of levels and patches at this view, or let it go on"},
    {kColorKey, "Toggle colours by level"},
    {kCullKey, "Toggle culling of patches"},
    {kOverlayKey, "Toggle the status line"},
};

constexpr double kErrorStep = 1.189207115002721; ///< fourth root of 2
constexpr double kSmallestError = 1.0 / 64.0;
constexpr double kLargestError = 1024.0;

const osg::Camera* mainCamera(osgGA::GUIActionAdapter& action)
{
    osg::View* view = action.asView();
    return view ? view->getCamera() : nullptr;
}

osgViewer::ViewerBase* viewerOf(osgGA::GUIActionAdapter& action)
{
    auto* view = dynamic_cast<osgViewer::View*>(action.asView());
    return view != nullptr ? view->getViewerBase() : nullptr;
}

/// Freezes each drawable at the view that its last selection was made for. One that no selection was made for stays as it is.
void freeze(const std::vector<FrameSelection>& selections, const DrawableList& drawables)
{
    for (const osg::ref_ptr<TessLODDrawable>& drawable : drawables) {
        const auto made = std::find_if(selections.begin(), selections.end(),
                                       [&](const FrameSelection& entry) { return entry.drawable == drawable.get(); });
        if (made == selections.end()) { continue; }
        SelectionOptions options = drawable->getOptions();
        options.frozen = true;
        options.frozenView = made->selection->view();
        drawable->setOptions(options);
    }
}

} // namespace

TessLODEventHandler::TessLODEventHandler(osg::Node* scene, const DrawableList& drawables, bool colorByLevel)
    : _scene(scene)
    , _drawables(drawables)
    , _totals(drawables)
    , _colorByLevel(colorByLevel)
{
}

bool TessLODEventHandler::handle(const osgGA::GUIEventAdapter& event, osgGA::GUIActionAdapter& action)
{
    if (event.getEventType() == osgGA::GUIEventAdapter::FRAME) { beginFrame(event, action); }
    if (event.getEventType() != osgGA::GUIEventAdapter::KEYDOWN || event.getHandled()) { return false; }
    const bool handled = handleKey(event.getKey(), action);
    if (handled) { action.requestRedraw(); }
    return handled;
}

void TessLODEventHandler::beginFrame(const osgGA::GUIEventAdapter& event, osgGA::GUIActionAdapter& action)
{
    _totals.beginFrame();
    if (_drawables.empty()) { return; }
    const osg::Camera* camera = mainCamera(action);
    const osg::Viewport* viewport = camera ? camera->getViewport() : nullptr;
    const double width = viewport ? viewport->width() : event.getWindowWidth();
    const double height = viewport ? viewport->height() : event.getWindowHeight();
    const SelectionSums sums = SelectionTotals::sum(_totals.lastFrame(camera));
    const SelectionOptions& options = _drawables.front()->getOptions();
    _overlay.update(sums, options, width, height);
    osgViewer::ViewerBase* viewer = viewerOf(action);
    if (viewer != nullptr && viewer->getViewerStats() != nullptr && viewer->getViewerFrameStamp() != nullptr) {
        recordSelection(*viewer->getViewerStats(), viewer->getViewerFrameStamp()->getFrameNumber(), sums,
                        options.errorPixels);
    }
}

bool TessLODEventHandler::handleKey(int key, osgGA::GUIActionAdapter& action)
{
    const auto scaleError = [this](double scale) {
        changeOptions(_drawables, [scale](SelectionOptions& options) {
            options.errorPixels = std::clamp(options.errorPixels * scale, kSmallestError, kLargestError);
        });
    };
    switch (key) {
    case kFinerKey: scaleError(1.0 / kErrorStep); return true;
    case kCoarserKey: scaleError(kErrorStep); return true;
    case kFreezeKey: toggleFrozen(action); return true;
    case kColorKey:
        _colorByLevel = !_colorByLevel;
        if (_scene.valid()) { setColorByLevel(*_scene, _colorByLevel); }
        return true;
    case kCullKey:
        changeOptions(_drawables, [](SelectionOptions& options) { options.cullPatches = !options.cullPatches; });
        return true;
    case kOverlayKey: _overlay.camera()->setNodeMask(_overlay.camera()->getNodeMask() ? 0U : ~0U); return true;
    default: return false;
    }
}

void TessLODEventHandler::toggleFrozen(osgGA::GUIActionAdapter& action)
{
    const bool anyFrozen = std::any_of(_drawables.begin(), _drawables.end(),
                                       [](const auto& drawable) { return drawable->getOptions().frozen; });
    if (anyFrozen) {
        changeOptions(_drawables, [](SelectionOptions& options) { options.frozen = false; });
    } else {
        // Keys are handled before or after the FRAME event of the same frame, so either list may be the newest.
        const osg::Camera* camera = mainCamera(action);
        const std::vector<FrameSelection> current = _totals.thisFrame(camera);
        freeze(current.empty() ? _totals.lastFrame(camera) : current, _drawables);
    }
}

void TessLODEventHandler::getUsage(osg::ApplicationUsage& usage) const
{
    for (const KeyUse& use : kKeyUses) { usage.addKeyboardMouseBinding(use.key, use.what); }
}

} // namespace osgTessLOD
