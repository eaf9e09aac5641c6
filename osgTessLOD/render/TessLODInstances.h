// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/render/Placements.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/Matrixd>
#include <osg/ref_ptr>

#include <cstdint>
#include <optional>
#include <vector>

namespace osgTessLOD {

/// A TessLODDrawable that is shown at many placements at once. In a cull visit each of them is culled and selected for by itself,
/// as if the drawable were under a MatrixTransform there; all that is selected is one PatchSelection, drawn with about as many
/// draw calls as it has levels.
///
/// What the asset looks like, its deformation, options and state are the same for all. Coordinates reach the GPU in single precision: where
/// placements are far from the origin, put the origin among them and the drawable under a transform.
class OSGTESSLOD_EXPORT TessLODInstances : public TessLODDrawable {
public:
    TessLODInstances();
    explicit TessLODInstances(std::shared_ptr<const LodAsset> asset);
    TessLODInstances(const TessLODInstances& other, const osg::CopyOp& copyop = osg::CopyOp::SHALLOW_COPY);
    META_Object(osgTessLOD, TessLODInstances)

    /// Matrices from the asset's space to the drawable's; affine, or they show nothing. They are sent to the GPU anew: change
    /// them between frames, as options, and all at once.
    void setPlacements(std::vector<osg::Matrixd> placements);
    const std::vector<osg::Matrixd>& getPlacements() const { return _placements->matrices(); }

    /// Index of the placement that an intersection is at: `hitMatrix` is the `matrix` of what an intersector found. Nothing where
    /// that is not of a TessLODInstances. The intersection's drawable is a TessLODDrawable of the asset alone; in the node path it
    /// comes after this one.
    static std::optional<std::uint32_t> placementOf(const osg::RefMatrix* hitMatrix);

    osg::ref_ptr<PatchSelection> select(const CullView& view) const override;

    osg::BoundingBox computeBoundingBox() const override;
    using TessLODDrawable::accept;
    /// Intersection visitors meet the asset's picking surface at every placement that they come near. Functors see those of all
    /// placements, at the finest level at which all together are within the picking options' limits.
    void accept(osg::NodeVisitor& visitor) override;
    void releaseGLObjects(osg::State* state = nullptr) const override;
    void resizeGLObjectBuffers(unsigned int maxSize) override;

protected:
    ~TessLODInstances() override;
    osg::ref_ptr<PatchSelection> selectUniform(unsigned level) const override;
    osg::ref_ptr<SurfaceProxy> makePickingSurface() const override;
    void surfaceChanged() override;
    void dropPickingSurface() override;
    std::vector<const osg::StateSet*> moreStates(osg::State& state) const override;

private:
    osg::ref_ptr<TessLODDrawable> pickedDrawable();
    void intersectPlacements(osgUtil::IntersectionVisitor& visitor);

    osg::ref_ptr<const Placements>
        _placements; ///< replaced, never changed: selections of earlier frames are drawn with theirs
    std::mutex _pickedMutex;
    osg::ref_ptr<TessLODDrawable> _picked; ///< the asset alone, for intersections
};

} // namespace osgTessLOD
