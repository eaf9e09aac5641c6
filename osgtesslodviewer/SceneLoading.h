// SPDX-License-Identifier: MIT
#pragma once

#include <osg/Node>
#include <osg/ref_ptr>

#include <string>

namespace osg {
class ArgumentParser;
}

namespace osgTessLOD {

/// Lets OSG find the plugins that belong to this program: in the library folders beside the folder it lies in.
void addPluginFolders();

/// Reads every file named in `arguments`, which its options have been taken out of, and optimizes the scene as osgviewer
/// does. Null if there is no file or if any cannot be read: `error` then says why.
osg::ref_ptr<osg::Node> loadScene(osg::ArgumentParser& arguments, std::string& error);

} // namespace osgTessLOD
