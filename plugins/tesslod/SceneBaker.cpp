// SPDX-License-Identifier: MIT
#include "SceneBaker.h"

#include "BakeProgress.h"
#include "GeometryMesh.h"

#include <osgTessLOD/render/MaterialState.h>
#include <osgTessLOD/render/PlacedDrawable.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <plugins/PluginOptions.h>

#include <osg/Geode>
#include <osg/NodeVisitor>
#include <osg/Transform>
#include <osgDB/FileNameUtils>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <exception>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

namespace osgTessLOD {

namespace {

constexpr unsigned kLargestFactor = 64;

/// A geometry to bake and where it is.
struct FoundGeometry {
    osg::ref_ptr<osg::Geometry> geometry;
    std::set<osg::Group*> parents;
    std::vector<osg::Matrixd> places;
};

/// Finds what can be baked, hidden or not, each geometry once, in the order of the scene.
class GeometryFinder : public osg::NodeVisitor {
public:
    GeometryFinder()
        : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN)
    {
        setNodeMaskOverride(~0U);
    }
    META_NodeVisitor(osgTessLOD, GeometryFinder)

    using osg::NodeVisitor::apply;
    void apply(osg::Geometry& geometry) override
    {
        if (!canBeBaked(geometry)) {
            OSG_INFO << "osgTessLOD: " << geometry.getName() << " stays as it is: it is not only triangles"
                     << std::endl;
            return;
        }
        const auto [known, isNew] = _numbers.emplace(&geometry, found.size());
        if (isNew) { found.push_back({&geometry, {}, {}}); }
        FoundGeometry& entry = found[known->second];
        const osg::NodePath& path = getNodePath();
        if (path.size() > 1) { entry.parents.insert(path[path.size() - 2]->asGroup()); }
        entry.places.push_back(osg::computeLocalToWorld(path));
    }

    std::vector<FoundGeometry> found;

private:
    std::map<const osg::Geometry*, std::size_t> _numbers;
};

std::vector<FoundGeometry> findGeometries(osg::Node& scene)
{
    GeometryFinder finder;
    scene.accept(finder);
    return std::move(finder.found);
}

std::string nameOf(const osg::Geometry& geometry, const std::string& sceneName)
{
    return geometry.getName().empty() ? sceneName : sceneName + "#" + geometry.getName();
}

osg::ref_ptr<TessLODDrawable> makeDrawable(LodAsset asset, const bake::BakeReport& report,
                                           const SceneBakeOptions& options)
{
    OSG_NOTICE << "osgTessLOD: baked " << report.source << ": " << report.sourceTriangles << " triangles, "
               << report.patches << " patches, " << report.seconds << " s" << std::endl;
    osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(std::make_shared<const LodAsset>(std::move(asset)));
    drawable->setOptions(options.selection);
    return drawable;
}

/// What of a geometry is not its surface.
void copyProperties(osg::Geometry& from, TessLODDrawable& to)
{
    to.setName(from.getName());
    to.setStateSet(from.getStateSet());
    to.setNodeMask(from.getNodeMask());
    to.setCullingActive(from.getCullingActive());
    to.setUserDataContainer(from.getUserDataContainer());
    to.setUpdateCallback(from.getUpdateCallback());
    to.setEventCallback(from.getEventCallback());
    if (from.getCullCallback() != nullptr) { to.addCullCallback(from.getCullCallback()); }
}

osg::ref_ptr<TessLODDrawable> bakeGeometry(osg::Geometry& geometry, const osg::Matrixd& matrix,
                                           const std::string& sceneName, const SceneBakeOptions& options)
{
    const std::string name = nameOf(geometry, sceneName);
    BakeProgress progress(name);
    bake::BakeReport report;
    LodAsset asset = bake::bakeMesh(meshOf(geometry, matrix, name), options.bake, progress, report);
    osg::ref_ptr<TessLODDrawable> drawable = makeDrawable(std::move(asset), report, options);
    copyProperties(geometry, *drawable);
    return drawable;
}

/// Puts nodes in place of geometries.
class GeometryReplacer {
public:
    void replace(const FoundGeometry& found, osg::Node& node)
    {
        for (osg::Group* parent : found.parents) {
            const auto other = _groups.find(parent);
            osg::Group* group = other != _groups.end() ? other->second.get() : parent;
            if (group->asGeode() != nullptr && node.asDrawable() == nullptr) { group = groupInsteadOf(*group); }
            group->replaceChild(found.geometry, &node);
        }
    }

private:
    /// Geodes hold drawables alone: one that is to hold a transform becomes a plain group.
    osg::Group* groupInsteadOf(osg::Group& geode)
    {
        const osg::ref_ptr<osg::Group> group = new osg::Group(geode, osg::CopyOp::SHALLOW_COPY);
        _groups[&geode] = group;
        _geodes.emplace_back(&geode); // so that no other node gets its address
        const osg::Node::ParentList parents = geode.getParents();
        for (osg::Group* parent : parents) { parent->replaceChild(&geode, group); }
        return group;
    }

    std::map<osg::Group*, osg::ref_ptr<osg::Group>> _groups;
    std::vector<osg::ref_ptr<osg::Group>> _geodes;
};

double toleranceOption(const osgDB::Options* options, double fallback)
{
    const std::string text = optionText(options, kTolerance);
    if (text.empty()) { return fallback; }
    double value = 0.0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc() || stop != end || !std::isfinite(value) || value < 0.0) {
        throwBadOption(kTolerance, text, kToleranceValues);
    }
    return value;
}

std::string techniqueOption(const osgDB::Options* options, const std::string& fallback)
{
    const std::string text = optionText(options, kTechnique);
    if (text.empty()) { return fallback; }
    const std::vector<std::string>& names = bake::techniqueNames();
    if (std::find(names.begin(), names.end(), text) == names.end()) {
        throwBadOption(kTechnique, text, kTechniqueValues);
    }
    return text;
}

} // namespace

SceneBakeOptions sceneBakeOptions(const osgDB::Options* options)
{
    SceneBakeOptions result;
    applyOptions(options, result.selection);
    result.bake.technique = techniqueOption(options, result.bake.technique);
    result.bake.tolerance = toleranceOption(options, result.bake.tolerance);
    result.bake.normals = !isOptionSet(options, kNoTextures);
    result.bake.uvs = result.bake.normals; // nothing else wants them
    const unsigned wanted = std::min(result.selection.maxFactor, kLargestFactor);
    result.bake.maxFactor = 1;
    while (result.bake.maxFactor < wanted) { result.bake.maxFactor *= 2; }
    return result;
}

osg::ref_ptr<osg::Node> bakeScene(osg::Node& scene, const std::string& name, const SceneBakeOptions& options)
{
    const osg::ref_ptr<osg::Group> holder = new osg::Group; // so that the scene itself can be replaced
    holder->addChild(&scene);
    const std::vector<FoundGeometry> geometries = findGeometries(*holder);
    if (geometries.empty()) { throw std::runtime_error(name + ": there is no geometry of triangles to bake"); }
    GeometryReplacer replacer;
    std::size_t baked = 0;
    std::string failure;
    for (const FoundGeometry& found : geometries) {
        try {
            const osg::ref_ptr<TessLODDrawable> drawable =
                bakeGeometry(*found.geometry, osg::Matrixd::identity(), name, options);
            if (geometries.size() == 1 && drawable->getName().empty()) {
                drawable->setName(osgDB::getSimpleFileName(name));
            }
            replacer.replace(found, *placeAtOrigin(*drawable));
            ++baked;
        } catch (const std::exception& error) {
            failure = error.what();
            if (geometries.size() > 1) {
                OSG_WARN << "osgTessLOD: a geometry stays as it is: " << failure << std::endl;
            }
        }
    }
    if (baked == 0) { throw std::runtime_error(failure); }
    osg::ref_ptr<osg::Node> result = holder->getChild(0);
    result->getBound();
    return result;
}

osg::ref_ptr<osg::Node> bakeOnlyGeometry(osg::Node& scene, const std::string& name, const SceneBakeOptions& options)
{
    const std::vector<FoundGeometry> geometries = findGeometries(scene);
    std::size_t places = 0;
    for (const FoundGeometry& found : geometries) { places += found.places.size(); }
    if (places != 1) {
        throw std::runtime_error(name + ": a .tlod file holds exactly one surface, the scene has " +
                                 std::to_string(places) + " to bake; .osgt, .osgb and .osgx files hold them all");
    }
    const FoundGeometry& found = geometries.front();
    return placeAtOrigin(*bakeGeometry(*found.geometry, found.places.front(), name, options));
}

osg::ref_ptr<osg::Node> bakeByName(const std::string& source, const SceneBakeOptions& options)
{
    BakeProgress progress(source);
    bake::BakeReport report;
    LodAsset asset = bake::bakeSource(source, options.bake, progress, report);
    const osg::ref_ptr<TessLODDrawable> drawable = makeDrawable(std::move(asset), report, options);
    drawable->setName(osgDB::getSimpleFileName(source));
    addMaterialStates(*drawable, "", nullptr, options.bake.normals);
    return placeAtOrigin(*drawable);
}

} // namespace osgTessLOD
