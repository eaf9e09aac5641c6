// SPDX-License-Identifier: MIT
#pragma once

#include "SelectionTotals.h"

#include <osgTessLOD/asset/AtomicFile.h>

#include <osg/Matrixd>

#include <string>
#include <vector>

namespace osgTessLOD {

/// Writes what was selected in each frame to a file, one JSON object a line (docs/architecture.md has its keys): so that tests can
/// follow levels along a path of the camera.
class SelectionTrace {
public:
    /// Throws AssetError if the file cannot be made.
    explicit SelectionTrace(const std::string& path);

    void addFrame(unsigned number, const osg::Matrixd& view, const std::vector<FrameSelection>& selections);
    /// The file is there only after this; throws AssetError if it could not be written.
    void commit();

private:
    AtomicFile _file;
};

} // namespace osgTessLOD
