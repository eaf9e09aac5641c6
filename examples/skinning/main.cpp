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
#include <exception>
#include <iostream>
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
class Skin : public osg::DrawableUpdateCallback {
public:
    Skin(const Bones& bones, const osgTessLOD::LodAsset& asset, const osg::BoundingBox& box)
        : _bones(bones)
        , _joint(box.center().x(), box.center().y(), box.zMin())
        , _length((box.zMax() - box.zMin()) / bones.size())
    {
        for (const osg::Vec3d& at : ControlMeshDeformation::baseVertices(asset)) {
            std::array<double, 3>& weights = _weights.emplace_back();
            double sum = 0.0;
            for (std::size_t k = 0; k < weights.size(); ++k) { // by the distance to the middle of each bone
                const double distance = (at.z() - (_joint.z() + (k + 0.5) * _length)) / _length;
                sum += weights[k] = std::exp(-4.0 * distance * distance);
            }
            for (double& weight : weights) { weight /= sum; }
        }
    }

    void update(osg::NodeVisitor* visitor, osg::Drawable* drawable) override
    {
        const double angle = 0.5 * std::sin(2.0 * visitor->getFrameStamp()->getSimulationTime());
        for (std::size_t k = 0; k < _bones.size(); ++k) { // what an osgAnimation::UpdateBone does
            const osg::Vec3d offset = k == 0 ? _joint : osg::Vec3d(0.0, 0.0, _length);
            _bones[k]->setMatrix(osg::Matrix::rotate(k == 0 ? 0.0 : angle, osg::Vec3d(1, 0, 0)) * osg::Matrix::translate(offset));
            const osg::Matrix parent = k == 0 ? osg::Matrix() : _bones[k - 1]->getMatrixInSkeletonSpace();
            _bones[k]->setMatrixInSkeletonSpace(_bones[k]->getMatrix() * parent);
        }
        std::vector<osg::Matrixd> transforms;
        for (const std::array<double, 3>& weights : _weights) {
            osg::Matrixd blend = osg::Matrixd::scale(0.0, 0.0, 0.0);
            for (std::size_t k = 0; k < _bones.size(); ++k) {
                const osg::Matrixd bone = _bones[k]->getInvBindMatrixInSkeletonSpace() * _bones[k]->getMatrixInSkeletonSpace();
                for (int n = 0; n < 15; ++n) { blend.ptr()[n] += weights[k] * bone.ptr()[n]; } // affine: the last stays 1
            }
            transforms.push_back(blend);
        }
        auto* lod = static_cast<TessLODDrawable*>(drawable);
        lod->setDeformation(new ControlMeshDeformation(lod->getGpuAsset(), transforms));
    }

private:
    const Bones _bones;
    const osg::Vec3d _joint;
    const double _length;
    std::vector<std::array<double, 3>> _weights; ///< of the bones, per base vertex
};

} // namespace

int main(int argc, char** argv)
{
    if (argc < 2) {
        std::cerr << "usage: skinning FILE.tlod\n";
        return 1;
    }
    try {
        const auto asset = std::make_shared<const osgTessLOD::LodAsset>(osgTessLOD::readTlod(argv[1]));
        const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(asset);
        const Bones bones = makeBones(drawable->getBoundingBox());
        const osg::ref_ptr<osgAnimation::Skeleton> skeleton = new osgAnimation::Skeleton;
        skeleton->addChild(bones[0]);
        skeleton->addChild(drawable);
        drawable->setUpdateCallback(new Skin(bones, *asset, drawable->getBoundingBox()));

        osgViewer::Viewer viewer;
        viewer.setUpViewInWindow(50, 50, 1024, 768);
        viewer.setSceneData(skeleton);
        return viewer.run();
    } catch (const std::exception& error) {
        std::cerr << error.what() << '\n';
        return 1;
    }
}
