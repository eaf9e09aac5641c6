// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/ShaderSource.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <osgDB/FileUtils>
#include <osgDB/Registry>

#include <gtest/gtest.h>

#include <string>

namespace osgTessLOD {

/// While it lives, programs that are made anew put out `expression` where they would put out positions; or as `varying`, which they
/// set to `usual`.
class CapturedInstead {
public:
    explicit CapturedInstead(const std::string& expression, const std::string& varying = "tessLodObjectPosition",
                             const std::string& usual = "point.position")
        : _before(osgDB::getDataFilePathList())
    {
        std::string text = shaderText("tesslod_vertex.glsl");
        const std::string assignment = varying + " = " + usual + ";";
        const std::size_t at = text.find(assignment);
        EXPECT_NE(at, std::string::npos);
        text.replace(at, assignment.size(), varying + " = " + expression + ";");
        writeBytes(_folder.file("tesslod_vertex.glsl"), text);
        osgDB::FilePathList paths = _before;
        paths.push_front(_folder.file(""));
        osgDB::setDataFilePathList(paths);
    }
    ~CapturedInstead() { osgDB::setDataFilePathList(_before); }
    CapturedInstead(const CapturedInstead&) = delete;
    CapturedInstead& operator=(const CapturedInstead&) = delete;

private:
    osgDB::FilePathList _before;
    TemporaryDirectory _folder;
};

} // namespace osgTessLOD
