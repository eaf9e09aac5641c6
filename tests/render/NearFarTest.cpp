// SPDX-License-Identifier: MIT
// However OSG computes the near and far planes, they cut nothing off.
#include <render/GlTest.h>
#include <render/PlainTwin.h>
#include <render/Poses.h>

#include <asset/SyntheticAsset.h>

#include <osg/CullSettings>

#include <array>
#include <iterator>

namespace osgTessLOD {
namespace {

constexpr int kSize = 120;

class NearFar : public testing::Test {
protected:
    NearFar()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        setUpHeadless(camera(), kSize, kSize);
        camera().setClearColor(osg::Vec4(0.0F, 0.0F, 1.0F, 1.0F));
        camera().setFinalDrawCallback(snapshot.get());
        camera().setNearFarRatio(1e-6); // where it decides, it cuts ordinary geometry off as well
        place->addChild(drawable.get());
        viewer.setSceneData(place.get());
        viewer.realize();
        viewer.renderingTraversals();
    }

    osg::Camera& camera() { return *viewer.getCamera(); }
    osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticAsset(16, true)));
    osg::ref_ptr<osg::MatrixTransform> place = new osg::MatrixTransform;
    osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    osgViewer::Viewer viewer;
};

constexpr std::array<osg::CullSettings::ComputeNearFarMode, 3> kModes{
    osg::CullSettings::COMPUTE_NEAR_FAR_USING_BOUNDING_VOLUMES, osg::CullSettings::COMPUTE_NEAR_FAR_USING_PRIMITIVES,
    osg::CullSettings::COMPUTE_NEAR_USING_PRIMITIVES};

TEST_F(NearFar, cutNothingOffWhatIsDeformed)
{
    const WarningCollector warnings;
    for (const double time : {0.5, 2.0, 4.5}) {
        drawable->setDeformation(deformed(*drawable->getGpuAsset(), turning, time));
        const osg::Vec3d center = drawable->getBoundingBox().center();
        for (const osg::Vec3d& eye : {osg::Vec3d(9, 0, 0), osg::Vec3d(1.3, 0.1, 0.1), osg::Vec3d(0.1, 0.1, 0.0)}) {
            camera().setViewMatrixAsLookAt(center + eye, center, osg::Vec3d(0.1, 0.3, 1.0));
            camera().setProjectionMatrixAsPerspective(40.0, 1.0, 1e-3, 100.0);
            camera().setComputeNearFarMode(osg::CullSettings::DO_NOT_COMPUTE_NEAR_FAR);
            viewer.renderingTraversals();
            const auto wanted = osg::clone(&snapshot->image(), osg::CopyOp::DEEP_COPY_ALL);
            for (const auto mode : kModes) {
                camera().setComputeNearFarMode(mode);
                viewer.renderingTraversals();
                EXPECT_LE(differingPixels(*wanted, snapshot->image(), 8), 3U) << "mode " << mode << ", time " << time;
            }
        }
    }
    EXPECT_EQ(warnings.text(), "");
}

TEST_F(NearFar, cutNothingOff)
{
    const WarningCollector warnings;
    for (const double scale : {1.0, 1e-4, 1e5}) {
        for (const double turn : {0.0, 1.0, 2.5}) {
            place->setMatrix(osg::Matrix::scale(scale, 0.7 * scale, scale) * osg::Matrix::rotate(turn, osg::Vec3d(1, 1, 0)) *
                             osg::Matrix::translate(0.1 * scale, 0.0, 0.0));
            // Far away, beside it, nearly touching, looking along it, inside, and looking away from it.
            const osg::Vec3d eyes[] = {{9, 0, 0}, {2, 2, 0}, {1.3, 0.1, 0.1}, {0.3, 0.2, 1.3}, {0.1, 0.1, 0.0}, {3, 0, 0}};
            for (std::size_t k = 0; k < std::size(eyes); ++k) {
                const osg::Vec3d eye = eyes[k] * scale;
                const osg::Vec3d target = k == 3 ? osg::Vec3d(9.0, 0.0, 0.5) * scale : k == 5 ? eye * 2.0 : osg::Vec3d();
                camera().setViewMatrixAsLookAt(eye, target, osg::Vec3d(0.1, 0.3, 1.0));
                camera().setProjectionMatrixAsPerspective(40.0, 1.0, 1e-3 * scale, 100.0 * scale);
                camera().setComputeNearFarMode(osg::CullSettings::DO_NOT_COMPUTE_NEAR_FAR);
                viewer.renderingTraversals();
                const auto wanted = osg::clone(&snapshot->image(), osg::CopyOp::DEEP_COPY_ALL);
                for (const auto mode : kModes) {
                    camera().setComputeNearFarMode(mode);
                    viewer.renderingTraversals();
                    // Depths of other planes round otherwise: where two sheets of it meet, a pixel may change hands.
                    EXPECT_LE(differingPixels(*wanted, snapshot->image(), 8), 3U)
                        << "mode " << mode << ", eye " << k << ", scale " << scale << ", turn " << turn;
                }
            }
        }
    }
    EXPECT_EQ(warnings.text(), "");
}

} // namespace
} // namespace osgTessLOD
