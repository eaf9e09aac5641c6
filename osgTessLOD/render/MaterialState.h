// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <string>

namespace osgDB {
class Options;
}

namespace osgTessLOD {

class TessLODDrawable;

/// Gives the drawable state for each material of its asset (TessLODDrawable::setMaterialState): reflectance as osg::Material, blended
/// where it is not opaque, and images as repeated textures: the colour on unit 0, normals on unit 1, others on units 2 to 7 in their
/// order. A map of normals along the asset's axes, which the surface is lit by, is on unit 9. Images that are files are
/// looked for from `folder` and by OSG's data paths; each is read once. What cannot be read leaves a warning. Without `hasImages` there
/// are none.
OSGTESSLOD_EXPORT void addMaterialStates(TessLODDrawable& drawable, const std::string& folder,
                                         const osgDB::Options* options, bool hasImages = true);

} // namespace osgTessLOD
