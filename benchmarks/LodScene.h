// SPDX-License-Identifier: MIT
#pragma once

#include "MeshLevels.h"

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/SelectionOptions.h>
#include <support/ScreenCamera.h>

#include <Eigen/Core>
#include <osg/Group>
#include <osg/Matrixd>
#include <osg/RenderInfo>

#include <cstdint>
#include <memory>
#include <vector>

namespace osgTessLOD::benchmarks {

/// What was drawn of one placement of a model.
struct DrawnModel {
    std::vector<Eigen::Vector3d> corners; ///< three per triangle, model space
    std::vector<bool> isPromised;         ///< of each triangle: is it said to be as near as asked?
};

/// A model with levels of detail, made by some technique, as a scene of any number of placements.
class LodScene {
public:
    virtual ~LodScene() = default;

    osg::Node* node() const { return _root.get(); }
    /// Shows the model there and nowhere else, until this is called again.
    virtual void place(const std::vector<osg::Matrixd>& placements) = 0;
    /// Which levels are to be drawn: those that are said to be so near on screen. `pixelScale`: pixels of a length of 1 at distance 1.
    virtual void ask(double errorPixels, double pixelScale) = 0;

    /// To be called before each frame.
    virtual void beginFrame() = 0;
    /// Triangles or patches that OpenGL was given in the frame.
    virtual std::uint64_t submitted() const = 0;
    /// Patches of them that are not what was asked for, as they have no finer level.
    virtual std::uint64_t saturated() const { return 0; }
    /// At the end of a frame: what `camera` drew of these placements, by their number.
    virtual std::vector<DrawnModel> drawn(osg::RenderInfo& renderInfo, const ScreenCamera& camera,
                                          const std::vector<std::size_t>& placements) const = 0;
    /// Of vertices, indices and textures, of all levels.
    virtual std::uint64_t gpuBytes() const = 0;

protected:
    osg::ref_ptr<osg::Group> _root = new osg::Group;
};

/// Levels as osg::Geometry, those of each part under an osg::LOD that shows the coarsest whose error is at most the one asked, if the eye
/// is no nearer than the part's bounding sphere; without coarser levels just that.
std::unique_ptr<LodScene> makeMeshScene(const std::vector<MeshLevels>& parts);

/// A TessLODDrawable, or TessLODInstances where there are several placements. `center`: of the model, in the asset's source space;
/// it becomes the origin.
std::unique_ptr<LodScene> makeTessLodScene(std::shared_ptr<const LodAsset> asset, const SelectionOptions& options,
                                           const Eigen::Vector3d& center);

} // namespace osgTessLOD::benchmarks
