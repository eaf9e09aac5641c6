// SPDX-License-Identifier: MIT
#include <render/GlTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/PatchCullCallback.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/Geode>
#include <osg/MatrixTransform>
#include <osg/TriangleFunctor>
#include <osgUtil/IntersectionVisitor>
#include <osgUtil/LineSegmentIntersector>
#include <osgUtil/Optimizer>
#include <osgUtil/Statistics>

namespace osgTessLOD {
namespace {

osg::ref_ptr<TessLODDrawable> makeDrawable(unsigned topFactor = 16)
{
    return new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticAsset(topFactor, true)));
}

int countCullCallbacks(const osg::Drawable& drawable)
{
    int count = 0;
    for (const osg::Callback* c = drawable.getCullCallback(); c != nullptr; c = c->getNestedCallback()) {
        count += dynamic_cast<const PatchCullCallback*>(c) != nullptr ? 1 : 0;
    }
    return count;
}

/// What a reader of a file with a stored callback does after construction.
struct OtherCallback : osg::DrawableCullCallback {
    bool cull(osg::NodeVisitor*, osg::Drawable*, osg::RenderInfo*) const override { return false; }
};

TEST(TessLODDrawable, withoutAnAssetIsEmpty)
{
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable;
    EXPECT_FALSE(drawable->getBoundingBox().valid());
    EXPECT_EQ(drawable->getGpuAsset(), nullptr);
    osgUtil::Statistics statistics;
    drawable->accept(statistics);
    drawable->releaseGLObjects();
    drawable->resizeGLObjectBuffers(4);
    drawable->setAsset(nullptr);
}

TEST(TessLODDrawable, boundsAreTheAssets)
{
    const auto drawable = makeDrawable();
    const LodAsset& asset = *drawable->getAsset();
    const osg::BoundingBox& box = drawable->getBoundingBox();
    EXPECT_EQ(box._min, osg::Vec3(asset.boundsMin[0], asset.boundsMin[1], asset.boundsMin[2]));
    EXPECT_EQ(box._max, osg::Vec3(asset.boundsMax[0], asset.boundsMax[1], asset.boundsMax[2]));
    drawable->setAsset(nullptr);
    EXPECT_FALSE(drawable->getBoundingBox().valid());
}

TEST(TessLODDrawable, copiesShareTheAssetAndHaveOneCallback)
{
    const auto drawable = makeDrawable();
    SelectionOptions options;
    options.errorPixels = 3.0;
    drawable->setOptions(options);
    for (const auto flags : {osg::CopyOp::SHALLOW_COPY, osg::CopyOp::DEEP_COPY_ALL}) {
        const osg::ref_ptr<TessLODDrawable> copy = osg::clone(drawable.get(), osg::CopyOp(flags));
        EXPECT_EQ(copy->getGpuAsset(), drawable->getGpuAsset());
        EXPECT_EQ(copy->getAsset(), drawable->getAsset());
        EXPECT_EQ(copy->getOptions().errorPixels, 3.0);
        EXPECT_EQ(countCullCallbacks(*copy), 1);
        EXPECT_TRUE(copy->getBoundingBox().valid());
    }
    EXPECT_EQ(countCullCallbacks(*drawable), 1);
    EXPECT_STREQ(drawable->libraryName(), "osgTessLOD");
    EXPECT_STREQ(drawable->className(), "TessLODDrawable");
}

TEST(TessLODDrawable, copiesOfOnesWithOtherCallbacksKeepBoth)
{
    const auto drawable = makeDrawable();
    drawable->addCullCallback(new OtherCallback);
    osg::ref_ptr<TessLODDrawable> copy = osg::clone(drawable.get(), osg::CopyOp::SHALLOW_COPY);
    EXPECT_EQ(countCullCallbacks(*copy), 1);
    drawable->setCullCallback(new OtherCallback); // takes ours away; a copy has it again
    copy = osg::clone(drawable.get(), osg::CopyOp::SHALLOW_COPY);
    EXPECT_EQ(countCullCallbacks(*copy), 1);
    EXPECT_NE(dynamic_cast<OtherCallback*>(copy->getCullCallback()->getNestedCallback()), nullptr);
}

TEST(TessLODDrawable, emitsTheFinestLevelThatFitsAsTriangles)
{
    const auto drawable = makeDrawable(64);
    struct Sum {
        std::size_t triangles = 0;
        double volume = 0.0;
        void operator()(const osg::Vec3& a, const osg::Vec3& b, const osg::Vec3& c, bool = false)
        {
            ++triangles;
            volume += osg::Vec3d(a) * (osg::Vec3d(b) ^ osg::Vec3d(c)) / 6.0;
        }
    };
    osg::TriangleFunctor<Sum> sum;
    drawable->accept(sum);
    EXPECT_EQ(sum.triangles, 8U * 6144U);               // 49,152 ≤ 100,000
    EXPECT_NEAR(sum.volume, 4.0 / 3.0 * osg::PI, 0.15); // a sphere of radius 0.95 … 1.05, outside out
}

TEST(TessLODDrawable, canBePicked)
{
    const auto drawable = makeDrawable(16);
    const osg::ref_ptr<osg::Geode> geode = new osg::Geode;
    geode->addDrawable(drawable.get());
    const osg::ref_ptr<osgUtil::LineSegmentIntersector> line =
        new osgUtil::LineSegmentIntersector(osg::Vec3d(0.1, 0.2, 5.0), osg::Vec3d(0.1, 0.2, -5.0));
    osgUtil::IntersectionVisitor visitor(line.get());
    geode->accept(visitor);
    ASSERT_EQ(line->getIntersections().size(), 2U);
    EXPECT_NEAR(line->getFirstIntersection().getWorldIntersectPoint().z(), 1.0, 0.1);
}

TEST(TessLODDrawable, survivesTheOptimizer)
{
    const auto drawable = makeDrawable();
    const osg::ref_ptr<osg::MatrixTransform> root = new osg::MatrixTransform(osg::Matrix::translate(5.0, 0.0, 0.0));
    root->setDataVariance(osg::Object::STATIC);
    root->addChild(drawable.get());
    osgUtil::Optimizer optimizer;
    optimizer.optimize(root.get(), osgUtil::Optimizer::ALL_OPTIMIZATIONS);
    EXPECT_NEAR(root->getBound().center().x(), 5.0, 0.2);
    EXPECT_NEAR(drawable->getBoundingBox().center().x(), 0.0, 0.2);
}

TEST(PatchSelectionStatistics, areWhatStatsReport)
{
    const auto drawable = makeDrawable();
    GpuAsset& asset = *drawable->getGpuAsset();
    std::vector<PatchRecord> records = asset.selector().uniformRecords(3).vector();
    SelectionStatistics statistics = asset.selector().statisticsOf(records);
    EXPECT_EQ(statistics.triangles, 8U * 96U);
    const osg::ref_ptr<PatchSelection> selection =
        new PatchSelection(&asset, std::move(records), statistics, SelectionView());
    osgUtil::Statistics counted;
    selection->accept(counted);
    EXPECT_EQ(counted.getPrimitiveCountMap()[GL_TRIANGLES], 8U * 96U);
    SelectionStatistics twice;
    twice.add(statistics);
    twice.add(statistics);
    EXPECT_EQ(twice.triangles, 2 * statistics.triangles);
    EXPECT_EQ(twice.patchesByLevel, (std::vector<std::uint64_t>{0, 0, 0, 16, 0}));
}

class DrawableGl : public GlTest {};

TEST_F(DrawableGl, drawsAgainAfterItsObjectsWereReleased)
{
    const auto drawable = makeDrawable();
    GpuAsset& asset = *drawable->getGpuAsset();
    drawable->compileGLObjects(renderInfo);
    std::vector<PatchRecord> records = asset.selector().uniformRecords(2).vector();
    const std::vector<osg::Vec3f> first = capture(asset, records);
    EXPECT_EQ(first.size(), 3U * 8U * 24U);
    for (osg::State* which : {&state(), static_cast<osg::State*>(nullptr)}) {
        drawable->releaseGLObjects(which);
        osg::flushAllDeletedGLObjects(state().getContextID());
        state().reset(); // as OSG does when objects go: what it thinks is applied is gone
        state().setCheckForGLErrors(osg::State::ONCE_PER_ATTRIBUTE);
        drawable->resizeGLObjectBuffers(8);
        EXPECT_EQ(capture(asset, records), first);
    }
}

TEST_F(DrawableGl, drawsItselfAtLevelZeroWithoutACullTraversal)
{
    const auto drawable = makeDrawable();
    state().apply();
    drawable->drawImplementation(renderInfo);
    const osg::ref_ptr<TessLODDrawable> empty = new TessLODDrawable;
    empty->drawImplementation(renderInfo);
    empty->compileGLObjects(renderInfo);
}

TEST_F(DrawableGl, aSelectionWithoutItsStateDrawsNothing)
{
    const auto drawable = makeDrawable();
    GpuAsset& asset = *drawable->getGpuAsset();
    std::vector<PatchRecord> records = asset.selector().uniformRecords(1).vector();
    const SelectionStatistics statistics = asset.selector().statisticsOf(records);
    const osg::ref_ptr<PatchSelection> selection = new PatchSelection(&asset, records, statistics, SelectionView());
    state().apply();
    selection->drawImplementation(renderInfo); // no program: must not raise a GL error
    const osg::ref_ptr<PatchSelection> nothing = new PatchSelection;
    nothing->drawImplementation(renderInfo);
    EXPECT_TRUE(nothing->capture(renderInfo).empty());
}

} // namespace
} // namespace osgTessLOD
