// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <osg/Callback>

namespace osgTessLOD {

/// What TessLODDrawable does in a cull traversal: selects patches and levels for the view and adds a PatchSelection, with
/// the drawable's and the asset's state, to the render bin. Has no state of its own: one may serve many drawables.
///
/// View: the viewpoint of the traversal, which for cameras of reference frame ABSOLUTE_RF_INHERIT_VIEWPOINT (shadows and
/// other renderings for the sake of another view) is the inherited one, with the pixels of the camera it is inherited
/// from; what is culled follows the camera that draws. LODScale divides the pixels, so that a larger one is coarser.
class OSGTESSLOD_EXPORT PatchCullCallback : public osg::DrawableCullCallback {
public:
    PatchCullCallback() = default;
    PatchCullCallback(const PatchCullCallback& other, const osg::CopyOp& copyop);
    META_Object(osgTessLOD, PatchCullCallback)

        using osg::DrawableCullCallback::cull;
    /// True: the drawable itself is never added. False for traversals that are no osgUtil::CullVisitor's and for
    /// drawables that are no TessLODDrawable.
    bool cull(osg::NodeVisitor* visitor, osg::Drawable* drawable, osg::RenderInfo* renderInfo) const override;

protected:
    ~PatchCullCallback() override = default;
};

} // namespace osgTessLOD
