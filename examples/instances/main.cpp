// SPDX-License-Identifier: MIT
// instances FILE.tlod [SIDE]: SIDE × SIDE (20) placements of one model, in one drawable: each selects the levels that it needs
// where it stands, and all are drawn together, a draw call per level.
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/TessLODInstances.h>

#include <osgViewer/Viewer>
#include <osgViewer/ViewerEventHandlers>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <vector>

int main(int argc, char** argv)
{
    if (argc < 2) {
        std::cerr << "usage: instances FILE.tlod [SIDE]\n";
        return 1;
    }
    try {
        const auto asset = std::make_shared<const osgTessLOD::LodAsset>(osgTessLOD::readTlod(argv[1]));
        const osg::Vec3d diagonal(asset->boundsMax[0] - asset->boundsMin[0], asset->boundsMax[1] - asset->boundsMin[1],
                                  asset->boundsMax[2] - asset->boundsMin[2]);
        const double spacing = 1.1 * diagonal.length();
        const int side = argc > 2 ? std::max(1, std::atoi(argv[2])) : 20;

        std::vector<osg::Matrixd> placements;
        for (int y = 0; y < side; ++y) {
            for (int x = 0; x < side; ++x) {
                const double turn = 0.7 * (x + y * side);
                placements.push_back(osg::Matrixd::rotate(turn, osg::Vec3d(0, 0, 1)) *
                                     osg::Matrixd::translate(x * spacing, y * spacing, 0));
            }
        }
        const osg::ref_ptr<osgTessLOD::TessLODInstances> instances = new osgTessLOD::TessLODInstances(asset);
        instances->setPlacements(placements);

        osgViewer::Viewer viewer;
        viewer.setUpViewInWindow(50, 50, 1024, 768);
        viewer.addEventHandler(new osgViewer::StatsHandler); // key s: how long a frame takes
        viewer.setSceneData(instances);
        return viewer.run();
    } catch (const std::exception& error) {
        std::cerr << error.what() << '\n';
        return 1;
    }
}
