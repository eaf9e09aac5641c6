// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/LodAsset.h>

namespace osgTessLOD::benchmarks {

/// One asset of side × side copies of a model beside each other in x and y, without normals: as many patches as one likes.
LodAsset fieldOf(const LodAsset& model, unsigned side);

} // namespace osgTessLOD::benchmarks
