// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/Group>

#include <exception>
#include <iostream>

int main(int, char** argv)
{
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    scene->addChild(new osgTessLOD::TessLODDrawable);
    try {
        osgTessLOD::readTlod(std::string(argv[1]) + "/absent.tlod");
    } catch (const std::exception& expected) {
        std::cout << expected.what() << '\n';
        return scene->getNumChildren() == 1 ? 0 : 1;
    }
    return 1;
}
