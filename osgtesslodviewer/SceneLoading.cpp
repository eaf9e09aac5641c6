// SPDX-License-Identifier: MIT
#include "SceneLoading.h"

#include <osg/ArgumentParser>
#include <osg/Group>
#include <osgDB/FileUtils>
#include <osgDB/ReadFile>
#include <osgDB/Registry>
#include <osgUtil/Optimizer>

#include <filesystem>

namespace osgTessLOD {

namespace {

/// Null and a reason where the file cannot be read.
osg::ref_ptr<osg::Node> readFile(const std::string& fileName, std::string& error)
{
    osgDB::Registry& registry = *osgDB::Registry::instance();
    osgDB::ReaderWriter::ReadResult result = registry.readNode(fileName, registry.getOptions());
    if (result.validNode()) { return result.getNode(); }

    std::string reason = result.message();
    if (reason.empty() && osgDB::findDataFile(fileName, registry.getOptions()).empty()) { reason = "no such file"; }
    if (reason.empty()) { reason = "no plugin reads it"; }
    error = reason.find(fileName) == std::string::npos ? fileName + ": " + reason : reason;
    return nullptr;
}

} // namespace

void addPluginFolders()
{
    std::error_code failure;
    const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", failure);
    if (failure) { return; }
    osgDB::FilePathList& folders = osgDB::getLibraryFilePathList();
    // lib: of a build tree. The other: of an installation, where it differs.
    for (const char* name : {OSGTESSLOD_LIBRARY_DIR, "lib"}) {
        const std::filesystem::path folder = program.parent_path().parent_path() / name;
        if (std::filesystem::is_directory(folder, failure)) { folders.push_front(folder.string()); }
    }
}

osg::ref_ptr<osg::Node> loadScene(osg::ArgumentParser& arguments, std::string& error)
{
    osg::ref_ptr<osg::Group> scene = new osg::Group;
    for (int position = 1; position < arguments.argc(); ++position) {
        if (arguments.isOption(position)) { continue; }
        const osg::ref_ptr<osg::Node> node = readFile(arguments[position], error);
        if (!node) { return nullptr; }
        scene->addChild(node);
    }
    if (scene->getNumChildren() == 0) {
        error = "no file to show";
        return nullptr;
    }
    osgUtil::Optimizer().optimize(scene);
    return scene;
}

} // namespace osgTessLOD
