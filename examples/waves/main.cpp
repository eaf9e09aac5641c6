// SPDX-License-Identifier: MIT
// waves FILE.tlod: waves run through a model, a transform per vertex of its control mesh and frame; the error on screen is kept.
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/ControlMeshDeformation.h>
#include <osgTessLOD/render/PlacedDrawable.h>

#include <osg/FrameStamp>
#include <osgViewer/Viewer>
#include <osgViewer/ViewerEventHandlers>

#include <cmath>
#include <exception>
#include <iostream>
#include <vector>

namespace {

using osgTessLOD::ControlMeshDeformation;
using osgTessLOD::TessLODDrawable;

/// Sets a new pose in every update traversal: points go up and down as waves run along x.
class Waves : public osg::DrawableUpdateCallback {
public:
    explicit Waves(const osgTessLOD::LodAsset& asset)
        : _baseVertices(ControlMeshDeformation::baseVertices(asset))
        , _length(asset.boundsMax[0] - asset.boundsMin[0])
    {
    }

    void update(osg::NodeVisitor* visitor, osg::Drawable* drawable) override
    {
        const double waveNumber = 2.0 * osg::PI / _length; // a wave is several patches long
        const double height = 0.06 * _length;
        std::vector<osg::Matrixd> transforms;
        for (const osg::Vec3d& at : _baseVertices) {
            const double phase = waveNumber * at.x() - 3.0 * visitor->getFrameStamp()->getSimulationTime();
            // What is around the vertex rises and slopes as the wave does there: its first-order expansion.
            osg::Matrixd slope;
            slope(0, 2) = height * waveNumber * std::cos(phase);
            transforms.push_back(osg::Matrixd::translate(-at) * slope *
                                 osg::Matrixd::translate(at + osg::Vec3d(0.0, 0.0, height * std::sin(phase))));
        }
        auto* lod = static_cast<TessLODDrawable*>(drawable);
        lod->setDeformation(new ControlMeshDeformation(lod->getGpuAsset(), transforms));
    }

private:
    const std::vector<osg::Vec3d> _baseVertices;
    const double _length;
};

} // namespace

int main(int argc, char** argv)
{
    if (argc < 2) {
        std::cerr << "usage: waves FILE.tlod\n";
        return 1;
    }
    try {
        const auto asset = std::make_shared<const osgTessLOD::LodAsset>(osgTessLOD::readTlod(argv[1]));
        const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(asset);
        drawable->setUpdateCallback(new Waves(*asset));

        osgViewer::Viewer viewer;
        viewer.setUpViewInWindow(50, 50, 1024, 768);
        viewer.addEventHandler(new osgViewer::StatsHandler);
        viewer.setSceneData(osgTessLOD::placeAtOrigin(*drawable));
        return viewer.run();
    } catch (const std::exception& error) {
        std::cerr << error.what() << '\n';
        return 1;
    }
}
