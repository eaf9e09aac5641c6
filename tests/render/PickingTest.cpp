// SPDX-License-Identifier: MIT
// Intersections and functors see one level of the surface, the very triangles that the GPU draws of it.
#include <render/GlTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/MatrixTransform>
#include <osg/TriangleFunctor>
#include <osg/TriangleIndexFunctor>
#include <osgUtil/IntersectionVisitor>
#include <osgUtil/LineSegmentIntersector>
#include <osgUtil/PolytopeIntersector>

#include <cmath>
#include <random>
#include <set>
#include <thread>

namespace osgTessLOD {
namespace {

osg::ref_ptr<TessLODDrawable> makeDrawable(unsigned topFactor)
{
    return new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticAsset(topFactor, true)));
}

using Line = osgUtil::LineSegmentIntersector;

osg::ref_ptr<Line> intersect(osg::Node& scene, const osg::Vec3d& start, const osg::Vec3d& end, bool useTree = true)
{
    osg::ref_ptr<Line> line = new Line(start, end);
    osgUtil::IntersectionVisitor visitor(line.get());
    visitor.setUseKdTreeWhenAvailable(useTree);
    scene.accept(visitor);
    return line;
}

/// Where along start … end the triangles are met, between 0 and 1, in order.
std::vector<double> crossings(const std::vector<osg::Vec3f>& corners, const osg::Vec3d& start, const osg::Vec3d& end)
{
    std::vector<double> result;
    const osg::Vec3d d = end - start;
    for (std::size_t k = 0; k < corners.size(); k += 3) {
        const osg::Vec3d a = corners[k];
        const osg::Vec3d ab = osg::Vec3d(corners[k + 1]) - a;
        const osg::Vec3d ac = osg::Vec3d(corners[k + 2]) - a;
        const osg::Vec3d h = d ^ ac;
        const double determinant = ab * h;
        if (determinant == 0.0) { continue; }
        const osg::Vec3d from = start - a;
        const double u = (from * h) / determinant;
        const double v = (d * (from ^ ab)) / determinant;
        const double t = (ac * (from ^ ab)) / determinant;
        if (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0 && t <= 1.0) { result.push_back(t); }
    }
    std::sort(result.begin(), result.end());
    return result;
}

class RandomLines {
public:
    osg::Vec3d direction()
    {
        osg::Vec3d d(_normal(_random), _normal(_random), _normal(_random));
        d.normalize();
        return d;
    }

private:
    std::mt19937 _random{5};
    std::normal_distribution<double> _normal;
};

class PickingGl : public GlTest {};

TEST_F(PickingGl, meetsTheTrianglesThatAreDrawn)
{
    const auto drawable = makeDrawable(16);
    GpuAsset& asset = *drawable->getGpuAsset();
    RandomLines random;
    for (const unsigned level : {0U, 2U, 4U}) {
        PickingOptions options;
        options.finestLevel = level;
        drawable->setPickingOptions(options);
        ASSERT_EQ(drawable->getPickingSurface()->level(), level);
        std::vector<PatchRecord> records = asset.selector().uniformRecords(level).vector();
        const std::vector<osg::Vec3f> drawn = capture(asset, records);
        ASSERT_EQ(drawn.size(), drawable->getPickingSurface()->triangles().size());
        std::size_t met = 0;
        for (int k = 0; k < 300; ++k) {
            const osg::Vec3d start = random.direction() * 3.0;
            const osg::Vec3d end = random.direction() * 3.0;
            const std::vector<double> wanted = crossings(drawn, start, end);
            const auto line = intersect(*drawable, start, end);
            if (wanted.empty()) { continue; }
            ASSERT_FALSE(line->getIntersections().empty()) << "ray " << k << " of level " << level;
            const Line::Intersection first = line->getFirstIntersection();
            EXPECT_NEAR(first.ratio, wanted.front(), 1e-5); // OSG's functor computes in single precision
            EXPECT_EQ(first.drawable.get(), drawable.get());
            EXPECT_NEAR((first.getWorldIntersectPoint() - (start + (end - start) * wanted.front())).length(), 0.0,
                        1e-4);
            // The triangle that it names is the one that was met.
            const auto& triangles = drawable->getPickingSurface()->triangles();
            const auto& vertices = drawable->getPickingSurface()->vertices();
            std::vector<osg::Vec3f> triangle;
            for (unsigned v = 0; v < 3; ++v) { triangle.push_back(vertices[triangles[3 * first.primitiveIndex + v]]); }
            const osg::Vec3d normal = (triangle[1] - triangle[0]) ^ (triangle[2] - triangle[0]);
            EXPECT_NEAR((first.getLocalIntersectPoint() - osg::Vec3d(triangle[0])) * normal / normal.length(), 0.0,
                        1e-5);
            ++met;
        }
        EXPECT_GT(met, 20U);
    }
}

TEST(Picking, isTheSameWithAndWithoutTheTree)
{
    const auto drawable = makeDrawable(8);
    RandomLines random;
    for (int k = 0; k < 100; ++k) {
        const osg::Vec3d start = random.direction() * 3.0;
        const auto with = intersect(*drawable, start, -start, true);
        const auto without = intersect(*drawable, start, -start, false);
        ASSERT_EQ(with->getIntersections().size(), without->getIntersections().size());
        EXPECT_EQ(with->getFirstIntersection().ratio, without->getFirstIntersection().ratio);
        EXPECT_EQ(with->getFirstIntersection().primitiveIndex, without->getFirstIntersection().primitiveIndex);
    }
    EXPECT_NE(dynamic_cast<SurfaceTree*>(drawable->getShape()), nullptr);
}

TEST(Picking, goesThroughTransformsToInstances)
{
    const auto drawable = makeDrawable(16);
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    std::vector<osg::Matrixd> places;
    for (int k = 0; k < 5; ++k) {
        places.push_back(osg::Matrixd::scale(1.0 + k, 2.0, 0.5) * osg::Matrixd::rotate(0.7 * k, osg::Vec3d(1, 2, 3)) *
                         osg::Matrixd::translate(1e6 + 20.0 * k, 5.0, -7.0));
        const osg::ref_ptr<osg::MatrixTransform> place = new osg::MatrixTransform(places.back());
        place->addChild(drawable.get());
        scene->addChild(place.get());
    }
    const osg::Vec3d a(0.3, 0.1, 4.0);
    const osg::Vec3d b(0.2, -0.1, -4.0);
    const double wanted = intersect(*drawable, a, b)->getFirstIntersection().ratio;
    for (const osg::Matrixd& place : places) {
        const auto line = intersect(*scene, a * place, b * place);
        ASSERT_FALSE(line->getIntersections().empty());
        const Line::Intersection first = line->getFirstIntersection();
        EXPECT_NEAR(first.ratio, wanted, 1e-5);
        EXPECT_EQ(first.nodePath.back(), drawable.get());
        EXPECT_NEAR((*first.matrix * osg::Matrixd::inverse(place))(0, 0), 1.0, 1e-9) << "another instance";
    }
    const osg::Vec3d miss(1e6 - 50.0, 0.0, 0.0);
    EXPECT_TRUE(intersect(*scene, miss, miss + osg::Vec3d(0, 0, 9))->getIntersections().empty());
}

TEST(Picking, findsWhatIsInAPolytope)
{
    const auto drawable = makeDrawable(16);
    const osg::ref_ptr<osg::MatrixTransform> scene = new osg::MatrixTransform(osg::Matrix::translate(5.0, 0.0, 0.0));
    scene->addChild(drawable.get());
    const auto pick = [&](double x) {
        osg::Polytope beam;
        beam.add(osg::Plane(1.0, 0.0, 0.0, 0.01 - x));
        beam.add(osg::Plane(-1.0, 0.0, 0.0, 0.01 + x));
        beam.add(osg::Plane(0.0, 1.0, 0.0, 0.01));
        beam.add(osg::Plane(0.0, -1.0, 0.0, 0.01));
        const osg::ref_ptr<osgUtil::PolytopeIntersector> intersector = new osgUtil::PolytopeIntersector(beam);
        osgUtil::IntersectionVisitor visitor(intersector.get());
        scene->accept(visitor);
        return intersector;
    };
    const auto hit = pick(5.2);
    ASSERT_FALSE(hit->getIntersections().empty());
    bool above = false;
    bool below = false;
    for (const auto& intersection : hit->getIntersections()) {
        EXPECT_EQ(intersection.drawable.get(), drawable.get());
        above = above || intersection.localIntersectionPoint.z() > 0.8;
        below = below || intersection.localIntersectionPoint.z() < -0.8;
    }
    EXPECT_TRUE(above && below) << "both sides of the body";
    EXPECT_TRUE(pick(7.0)->getIntersections().empty());
}

TEST(Picking, buildsOneTreeForAllWhenOneIsNeeded)
{
    const auto drawable = makeDrawable(8);
    const osg::ref_ptr<TessLODDrawable> copy = osg::clone(drawable.get(), osg::CopyOp::SHALLOW_COPY);
    intersect(*drawable, osg::Vec3d(9, 9, 0), osg::Vec3d(9, 9, 9));
    EXPECT_EQ(drawable->getShape(), nullptr) << "nothing came near";
    std::vector<std::thread> threads;
    std::vector<std::size_t> counts(8, 0);
    for (std::size_t k = 0; k < counts.size(); ++k) {
        threads.emplace_back([&, k] {
            const auto line =
                intersect(k % 2 == 0 ? *drawable : *copy, osg::Vec3d(0.1, 0.2, 5), osg::Vec3d(0.1, 0.2, -5));
            counts[k] = line->getIntersections().size();
        });
    }
    for (std::thread& thread : threads) { thread.join(); }
    EXPECT_EQ(counts, std::vector<std::size_t>(8, 2));
    EXPECT_NE(drawable->getShape(), nullptr);
    EXPECT_EQ(drawable->getShape(), copy->getShape());

    // Deep copies do not carry another tree along, and changes of what it was made of drop it.
    const osg::ref_ptr<TessLODDrawable> deep = osg::clone(drawable.get(), osg::CopyOp::DEEP_COPY_ALL);
    EXPECT_EQ(deep->getShape(), nullptr);
    osg::observer_ptr<SurfaceProxy> surface = drawable->getPickingSurface().get();
    drawable->setPickingOptions({0, 10});
    EXPECT_EQ(drawable->getShape(), nullptr);
    EXPECT_TRUE(surface.valid()) << "the copy still has it";
    copy->setAsset(nullptr);
    EXPECT_FALSE(surface.valid());
    EXPECT_EQ(intersect(*copy, osg::Vec3d(0, 0, 5), osg::Vec3d(0, 0, -5))->getIntersections().size(), 0U);
}

TEST(Picking, keepsToTheTrianglesAllowed)
{
    const auto drawable = makeDrawable(64); // 8 patches: 12, 48, 192 … 49,152 triangles
    EXPECT_EQ(drawable->getPickingSurface()->level(), 6U);
    drawable->setPickingOptions({6, 5'000});
    EXPECT_EQ(drawable->getPickingSurface()->triangles().size(), 3U * 3072U);
    drawable->setPickingOptions({6, 1}); // fewer than there can be: the coarsest
    EXPECT_EQ(drawable->getPickingSurface()->triangles().size(), 3U * 8U);
    const osg::ref_ptr<osg::Box> box = new osg::Box;
    drawable->setShape(box.get());
    intersect(*drawable, osg::Vec3d(0, 0, 5), osg::Vec3d(0, 0, -5));
    EXPECT_EQ(drawable->getShape(), box.get()) << "the application's own is left alone";
}

struct CountIndices {
    std::set<unsigned> seen;
    std::size_t triangles = 0;
    void operator()(unsigned a, unsigned b, unsigned c)
    {
        seen.insert({a, b, c});
        ++triangles;
    }
};

TEST(Picking, functorsSeeTheSameTriangles)
{
    const auto drawable = makeDrawable(8);
    osg::TriangleIndexFunctor<CountIndices> indices;
    drawable->accept(indices);
    EXPECT_EQ(indices.triangles, 8U * 96U);
    EXPECT_EQ(indices.seen.size(), drawable->getPickingSurface()->vertices().size());
    struct Vertices : osg::Drawable::ConstAttributeFunctor {
        unsigned count = 0;
        void apply(osg::Drawable::AttributeType type, unsigned n, const osg::Vec3*) override
        {
            count = type == osg::Drawable::VERTICES ? n : 0;
        }
    } vertices;
    EXPECT_TRUE(drawable->supports(vertices));
    drawable->accept(vertices);
    EXPECT_EQ(vertices.count, indices.seen.size());
}

} // namespace
} // namespace osgTessLOD
