// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/render/SelectionOptions.h>

#include <osg/Node>
#include <osg/ref_ptr>

#include <string>

namespace osgDB {
class Options;
}

namespace osgTessLOD {

/// How a scene is baked and its drawables select.
struct SceneBakeOptions {
    bake::BakeOptions bake;
    SelectionOptions selection;
};

/// What the plugin's options ask for. maxFactor limits what is baked, too. Throws std::runtime_error for wrong values.
SceneBakeOptions sceneBakeOptions(const osgDB::Options* options);

/// Puts a TessLODDrawable in place of every geometry that can be baked (GeometryMesh.h), with its name, state, mask and user
/// data; one for all the parents of a geometry. All else stays as it is: transforms, names, state, other drawables. `name` is
/// the scene's, for messages. Returns what to show: `scene`, or another node where it was a geometry itself. A geometry whose
/// bake fails stays as it is, with a warning. Throws std::runtime_error if no geometry is left baked, saying why.
osg::ref_ptr<osg::Node> bakeScene(osg::Node& scene, const std::string& name, const SceneBakeOptions& options);

/// The only geometry of the scene that can be baked, as one drawable in the scene's space: moved, turned and scaled as its
/// transforms do. Throws std::runtime_error where there is none or another number.
osg::ref_ptr<osg::Node> bakeOnlyGeometry(osg::Node& scene, const std::string& name, const SceneBakeOptions& options);

/// A built-in surface or a mesh file by the name that bake::bakeSource takes. Throws AssetError.
osg::ref_ptr<osg::Node> bakeByName(const std::string& source, const SceneBakeOptions& options);

} // namespace osgTessLOD
