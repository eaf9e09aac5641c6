// SPDX-License-Identifier: MIT
// instances FILE.tlod [SIDE]: SIDE × SIDE (20) placements of one model. They share one drawable, and with it the asset and
// everything on the GPU; each selects the levels that it needs where it stands.
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/MatrixTransform>
#include <osgViewer/Viewer>
#include <osgViewer/ViewerEventHandlers>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <iostream>

int main(int argc, char** argv)
{
    if (argc < 2) {
        std::cerr << "usage: instances FILE.tlod [SIDE]\n";
        return 1;
    }
    try {
        const osg::ref_ptr<osgTessLOD::TessLODDrawable> drawable = new osgTessLOD::TessLODDrawable(
            std::make_shared<const osgTessLOD::LodAsset>(osgTessLOD::readTlod(argv[1])));
        const double spacing = 2.2 * static_cast<double>(drawable->getBound().radius());
        const int side = argc > 2 ? std::max(1, std::atoi(argv[2])) : 20;

        const osg::ref_ptr<osg::Group> scene = new osg::Group;
        for (int y = 0; y < side; ++y) {
            for (int x = 0; x < side; ++x) {
                const double turn = 0.7 * (x + y * side);
                const osg::ref_ptr<osg::MatrixTransform> place =
                    new osg::MatrixTransform(osg::Matrixd::rotate(turn, osg::Vec3d(0, 0, 1)) *
                                             osg::Matrixd::translate(x * spacing, y * spacing, 0));
                place->addChild(drawable);
                scene->addChild(place);
            }
        }

        osgViewer::Viewer viewer;
        viewer.setUpViewInWindow(50, 50, 1024, 768);
        viewer.addEventHandler(new osgViewer::StatsHandler); // key s: how long a frame takes
        viewer.setSceneData(scene);
        return viewer.run();
    } catch (const std::exception& error) {
        std::cerr << error.what() << '\n';
        return 1;
    }
}
