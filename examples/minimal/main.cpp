// SPDX-License-Identifier: MIT
// minimal FILE.tlod [PIXELS]: shows a model so that no point of it is more than PIXELS (2) from where it belongs on screen.
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/PlacedDrawable.h>

#include <osgViewer/Viewer>

#include <cstdlib>
#include <exception>
#include <iostream>

int main(int argc, char** argv)
{
    if (argc < 2) {
        std::cerr << "usage: minimal FILE.tlod [PIXELS]\n";
        return 1;
    }
    try {
        // An asset may be shared by any number of drawables.
        const auto asset = std::make_shared<const osgTessLOD::LodAsset>(osgTessLOD::readTlod(argv[1]));
        const osg::ref_ptr<osgTessLOD::TessLODDrawable> drawable = new osgTessLOD::TessLODDrawable(asset);

        osgTessLOD::SelectionOptions options;
        options.errorPixels = argc > 2 ? std::atof(argv[2]) : 2.0;
        drawable->setOptions(options);

        osgViewer::Viewer viewer;
        viewer.setUpViewInWindow(50, 50, 1024, 768);
        viewer.setSceneData(osgTessLOD::placeAtOrigin(*drawable));
        return viewer.run();
    } catch (const std::exception& error) { // readTlod: what is wrong with the file
        std::cerr << error.what() << '\n';
        return 1;
    }
}
