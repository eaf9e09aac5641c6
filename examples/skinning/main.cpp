// SPDX-License-Identifier: MIT
// skinning FILE.tlod: a model on three bones of osgAnimation, which swing about the ends of one another.
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/ControlMeshDeformation.h>
#include <osgTessLOD/render/PlacedDrawable.h>

#include <osg/FrameStamp>
#include <osgAnimation/Bone>
#include <osgAnimation/Skeleton>
#include <osgViewer/Viewer>

#include <array>
#include <cmath>
#include <iostream>
#include <stdexcept>
#include <vector>

namespace {

using osgTessLOD::ControlMeshDeformation;
using osgTessLOD::TessLODDrawable;
using Bones = std::array<osg::ref_ptr<osgAnimation::Bone>, 3>;

/// Bones along z, each beginning where its parent ends, in the space of the asset.
Bones makeBones(const osg::BoundingBox& box)
{
    Bones bones;
    const double length = (box.zMax() - box.zMin()) / bones.size();
    for (std::size_t k = 0; k < bones.size(); ++k) {
        bones[k] = new osgAnimation::Bone("bone " + std::to_string(k));
        const double start = box.zMin() + length * k;
        bones[k]->setInvBindMatrixInSkeletonSpace(osg::Matrix::translate(-box.center().x(), -box.center().y(), -start));
        if (k > 0) { bones[k - 1]->addChild(bones[k]); }
    }
    return bones;
}

/// Swings the bones, and has the control mesh follow them, in every update traversal.
struct Skin : osg::DrawableUpdateCallback {
    Skin(const Bones& bones, const osgTessLOD::LodAsset& asset, const osg::BoundingBox& box)
        : _bones(bones)
        , _joint(box.center().x(), box.center().y(), box.zMin())
        , _length((box.zMax() - box.zMin()) / bones.size())
    {
        for (const osg::Vec3d& at : ControlMeshDeformation::baseVertices(asset)) {
            const double along = (at.z() - _joint.z()) / _length; // by the distance to the middle of each bone
            osg::Vec3d weights;
            for (int k = 0; k < 3; ++k) { weights[k] = std::exp(-4.0 * std::pow(along - k - 0.5, 2.0)); }
            _weights.push_back(weights / (weights * osg::Vec3d(1.0, 1.0, 1.0)));
        }
    }

    void update(osg::NodeVisitor* visitor, osg::Drawable* drawable) override
    {
        const double angle = 0.5 * std::sin(2.0 * visitor->getFrameStamp()->getSimulationTime());
        _bones[0]->setMatrixInSkeletonSpace(osg::Matrix::translate(_joint));
        for (std::size_t k = 1; k < _bones.size(); ++k) { // what an osgAnimation::UpdateBone does
            _bones[k]->setMatrix(osg::Matrix::rotate(angle, osg::Vec3d(1, 0, 0)) * osg::Matrix::translate(0.0, 0.0, _length));
            _bones[k]->setMatrixInSkeletonSpace(_bones[k]->getMatrix() * _bones[k - 1]->getMatrixInSkeletonSpace());
        }
        std::vector<osg::Matrixd> transforms(_weights.size(), osg::Matrixd::scale(0.0, 0.0, 0.0));
        for (std::size_t vertex = 0; vertex < _weights.size(); ++vertex) {
            for (int k = 0; k < 3; ++k) {
                const osg::Matrixd bone = _bones[k]->getInvBindMatrixInSkeletonSpace() * _bones[k]->getMatrixInSkeletonSpace();
                for (int n = 0; n < 15; ++n) { transforms[vertex].ptr()[n] += _weights[vertex][k] * bone.ptr()[n]; }
            }
        }
        auto& lod = static_cast<TessLODDrawable&>(*drawable);
        lod.setDeformation(new ControlMeshDeformation(lod.getGpuAsset(), transforms));
    }

    const Bones _bones;
    const osg::Vec3d _joint;
    const double _length;
    std::vector<osg::Vec3d> _weights; // of the bones, per base vertex
};

} // namespace

int main(int argc, char** argv)
{
    try {
        if (argc < 2) { throw std::runtime_error("usage: skinning FILE.tlod"); }
        const auto asset = std::make_shared<const osgTessLOD::LodAsset>(osgTessLOD::readTlod(argv[1]));
        const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(asset);
        const Bones bones = makeBones(drawable->getBoundingBox());
        drawable->setUpdateCallback(new Skin(bones, *asset, drawable->getBoundingBox()));
        const osg::ref_ptr<osgAnimation::Skeleton> skeleton = new osgAnimation::Skeleton;
        skeleton->addChild(bones[0]);
        skeleton->addChild(drawable);
        osgViewer::Viewer viewer;
        viewer.setUpViewInWindow(50, 50, 1024, 768);
        viewer.setSceneData(skeleton);
        return viewer.run();
    } catch (const std::exception& error) {
        std::cerr << error.what() << '\n';
        return 1;
    }
}
