// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/CulledFace.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <osgTessLOD/render/SelectionOptions.h>
#include <osgTessLOD/render/SelectionView.h>

#include <osg/Matrixd>
#include <osg/Plane>

#include <vector>

namespace osg {
class StateSet;
}
namespace osgUtil {
class CullVisitor;
}

namespace osgTessLOD {

class PatchSelection;
class TessLODDrawable;

/// What a cull visit to a drawable sees, and by how many pixels: see PatchCullCallback. For the time of the visit.
class CullView {
public:
    CullView(osgUtil::CullVisitor& visitor, const TessLODDrawable& drawable);

    osgUtil::CullVisitor& visitor() const { return _visitor; }
    const SelectionOptions& options() const { return _options; }

    /// In the drawable's local space; the frozen one if the options say so.
    SelectionView view() const;
    /// In the space that `placement`, which is affine, takes to the drawable's.
    SelectionView view(const osg::Matrixd& placement) const;
    /// Planes in local space, inside positive; none where the visitor does not cull by the frustum.
    std::vector<osg::Plane> frustum() const;
    /// What GL will not draw of triangles seen in `view`, one of those above: by the state that the drawable will be drawn with.
    PatchSelector::CulledFaces culledFaces(const SelectionView& view) const;

private:
    SelectionView viewThrough(const osg::Matrixd& localToEye) const;

    osgUtil::CullVisitor& _visitor;
    const SelectionOptions& _options;
    CulledFace _culledFace;
    osg::Matrixd _localToEye;
    osg::Matrixd _projection;
    double _width = 0.0; ///< of the viewport, pixels
    double _height = 0.0;
};

/// Adds `leaf` to the render bin, with the drawable's, the `material`'s (null: none) and the asset's state, as CullVisitor::apply(Drawable&) adds a visited
/// drawable, near and far planes included; unless it is behind the eye.
void addLeaf(osgUtil::CullVisitor& visitor, const TessLODDrawable& drawable, PatchSelection& leaf,
             const osg::StateSet* material);

} // namespace osgTessLOD
