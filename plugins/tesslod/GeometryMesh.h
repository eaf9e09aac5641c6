// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/SourceMesh.h>

#include <osg/Geometry>
#include <osg/Matrixd>

#include <string>

namespace osgTessLOD {

/// True for an osg::Geometry, not of a derived class, that has triangles, quadrilaterals or polygons and neither lines, points
/// nor patches, with positions of two, three or four floats or doubles: what a bake can stand for.
bool canBeBaked(const osg::Geometry& geometry);

/// The triangles of a geometry that can be baked, positions moved by `matrix`, with its texture coordinates of unit 0 (two
/// floats a vertex) and its colours, of each vertex or overall but for white. `name` stands for a file's in messages.
bake::SourceMesh meshOf(const osg::Geometry& geometry, const osg::Matrixd& matrix, const std::string& name);

} // namespace osgTessLOD
