// SPDX-License-Identifier: MIT
// Surfaces lit by a normal map over their own texture coordinates look as by normals per patch, and as their source.
#include <render/PlainTwin.h>
#include <render/Poses.h>
#include <render/ViewerTest.h>

#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/SourceSurface.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/MaterialState.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <osgTessLOD/render/TessLODInstances.h>

#include <osg/Geometry>
#include <osg/Image>
#include <osg/Material>
#include <osg/MatrixTransform>
#include <osgDB/Registry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace osgTessLOD {
namespace {

constexpr int kSize = 200;
constexpr double kPi = 3.14159265358979323846;

/// A bumpy torus about z, whose texture coordinates are its angles.
bake::SourceMesh torus()
{
    constexpr std::uint32_t kAround = 120;
    constexpr std::uint32_t kAcross = 60;
    bake::SourceMesh mesh;
    mesh.name = "torus";
    for (std::uint32_t j = 0; j < kAcross; ++j) {
        for (std::uint32_t i = 0; i < kAround; ++i) {
            const double a = 2.0 * kPi * i / kAround;
            const double b = 2.0 * kPi * j / kAcross;
            const double r = 0.35 + 0.03 * std::sin(7.0 * a) * std::cos(3.0 * b);
            mesh.positions.emplace_back((1.0 + r * std::cos(b)) * std::cos(a), (1.0 + r * std::cos(b)) * std::sin(a), r * std::sin(b));
        }
    }
    const auto add = [&](const std::array<std::array<std::uint32_t, 2>, 3>& corners) {
        std::array<std::uint32_t, 3>& triangle = mesh.triangles.emplace_back();
        std::array<Eigen::Vector2f, 3>& uvs = mesh.uvs.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [i, j] = corners[k];
            triangle[k] = j % kAcross * kAround + i % kAround;
            uvs[k] = {static_cast<float>(i) / kAround, static_cast<float>(j) / kAcross};
        }
    };
    for (std::uint32_t j = 0; j < kAcross; ++j) {
        for (std::uint32_t i = 0; i < kAround; ++i) {
            add({{{i, j}, {i + 1, j}, {i + 1, j + 1}}});
            add({{{i, j}, {i + 1, j + 1}, {i, j + 1}}});
        }
    }
    return mesh;
}

std::shared_ptr<const LodAsset> baked(bool hasMap)
{
    bake::BakeOptions options;
    options.technique = "uniform"; // the same levels with and without normals
    options.maxFactor = 32;
    options.normalMap = hasMap ? 512 : 0;
    bake::Progress progress;
    bake::BakeReport report;
    return std::make_shared<const LodAsset>(bake::bakeMesh(torus(), options, progress, report));
}

/// The same without.
std::shared_ptr<const LodAsset> withoutNormals(const LodAsset& asset)
{
    auto plain = std::make_shared<LodAsset>(asset);
    plain->normals = NormalTexture();
    for (LodLevel& level : plain->levels) { level.parameters.clear(); }
    return plain;
}

/// All triangles of it, in the asset's frame, with the normals that the bake takes.
osg::ref_ptr<osg::Geometry> sourceGeometry(const LodAsset& asset)
{
    const bake::SourceMesh mesh = torus();
    const bake::CornerNormals ofCorners = bake::cornerNormals(mesh, bake::ControlMeshOptions().creaseAngleRadians);
    std::vector<osg::Vec3f> corners;
    const osg::ref_ptr<osg::Vec3Array> normals = new osg::Vec3Array;
    const osg::Vec3d origin(asset.lattice.origin[0], asset.lattice.origin[1], asset.lattice.origin[2]);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Eigen::Vector3d& p = mesh.positions[mesh.triangles[t][k]];
            const Eigen::Vector3f& n = ofCorners[t][k];
            corners.emplace_back(osg::Vec3d(p.x(), p.y(), p.z()) - origin);
            normals->push_back(osg::Vec3f(n.x(), n.y(), n.z()));
        }
    }
    osg::ref_ptr<osg::Geometry> geometry = plainGeometry(corners);
    geometry->setNormalArray(normals.get(), osg::Array::BIND_PER_VERTEX);
    geometry->getOrCreateStateSet()->setMode(GL_NORMALIZE, osg::StateAttribute::ON);
    return geometry;
}

class NormalMapView : public testing::TestWithParam<Backend> {
protected:
    NormalMapView()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        setUpHeadless(*viewer.getCamera(), kSize, kSize);
        viewer.getCamera()->setFinalDrawCallback(snapshot.get());
        root->getOrCreateStateSet()->setAttribute(new osg::Material); // of geometry and ours alike
        viewer.setSceneData(root.get());
        viewer.realize();
        static const std::array<std::shared_ptr<const LodAsset>, 2> assets{baked(false), baked(true)};
        perPatch = new TessLODDrawable(assets[0]);
        mapped = new TessLODDrawable(assets[1]);
        none = new TessLODDrawable(withoutNormals(*assets[0]));
        lookFrom(osg::Vec3d(0.0, -5.0, 3.0));
        show(*none, 0.5); // the first picture of a context may be brighter
    }

    std::vector<unsigned char> show(TessLODDrawable& drawable, double errorPixels)
    {
        SelectionOptions options;
        options.backend = GetParam();
        options.errorPixels = errorPixels;
        drawable.setOptions(options);
        addMaterialStates(drawable, "", nullptr, true);
        return picture(drawable);
    }
    std::vector<unsigned char> picture(osg::Node& node)
    {
        root->removeChildren(0, root->getNumChildren());
        root->addChild(&node);
        viewer.frame();
        const osg::Image& image = snapshot->image();
        return {image.data(), image.data() + image.getTotalSizeInBytes()};
    }
    void lookFrom(const osg::Vec3d& eye)
    {
        viewer.getCamera()->setViewMatrixAsLookAt(eye, osg::Vec3d(), osg::Vec3d(0.0, 0.0, 1.0));
    }

    struct Difference {
        double mean = 0.0;   ///< of channels, of pixels that are not background
        double beyond8 = 0.0; ///< share of these pixels
    };
    static Difference difference(const std::vector<unsigned char>& a, const std::vector<unsigned char>& b)
    {
        Difference result;
        std::size_t pixels = 0;
        for (std::size_t p = 0; p + 2 < a.size(); p += 3) {
            if (std::equal(&a[p], &a[p] + 3, &a[0])) { continue; } // the picture's corner is background
            int largest = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const int off = std::abs(a[p + k] - b[p + k]);
                largest = std::max(largest, off);
                result.mean += off / 3.0;
            }
            result.beyond8 += largest > 8 ? 1.0 : 0.0;
            ++pixels;
        }
        EXPECT_GT(pixels, 4000U);
        result.mean /= static_cast<double>(pixels);
        result.beyond8 /= static_cast<double>(pixels);
        return result;
    }

    osg::ref_ptr<TessLODDrawable> perPatch;
    osg::ref_ptr<TessLODDrawable> mapped;
    osg::ref_ptr<TessLODDrawable> none;
    osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    osg::ref_ptr<osg::Group> root = new osg::Group;
    osgViewer::Viewer viewer;
};

/// Both are the source's normals: the map's of 10 bits a channel, which is 0.1 degrees, 0.5 of 255. At silhouettes, where a pixel goes
/// over many texels, the two are filtered differently, the more of the picture the smaller things are.
constexpr double kMean = 0.8;
constexpr double kBeyond8 = 0.015;

TEST_P(NormalMapView, looksAsWithNormalsPerPatch)
{
    for (const osg::Vec3d& eye : {osg::Vec3d(0.0, -5.0, 3.0), osg::Vec3d(4.0, 1.0, 4.0), osg::Vec3d(0.5, 0.5, -5.0)}) {
        lookFrom(eye);
        const Difference off = difference(show(*perPatch, 0.5), show(*mapped, 0.5));
        EXPECT_LT(off.mean, kMean);
        EXPECT_LT(off.beyond8, kBeyond8);
        const Difference without = difference(show(*perPatch, 0.5), show(*none, 0.5));
        EXPECT_GT(without.mean, 2.0 * off.mean) << "or the test shows nothing";
    }
}

/// Fixed function lights corners only: triangles of 3 degrees, whose middles are darker by up to 1 − cos 1.5° of 255, which is 0.1, and more
/// where bumps are steep; and silhouettes differ by what the error of levels leaves, half a pixel.
constexpr double kSourceMean = 0.8;

TEST_P(NormalMapView, looksAsTheSourceDrawnByOpenSceneGraph)
{
    const osg::ref_ptr<osg::Geometry> source = sourceGeometry(mapped->getGpuAsset()->asset());
    for (const osg::Vec3d& eye : {osg::Vec3d(0.0, -5.0, 3.0), osg::Vec3d(4.0, 1.0, 4.0), osg::Vec3d(0.5, 0.5, -5.0)}) {
        lookFrom(eye);
        const std::vector<unsigned char> whole = picture(*source);
        const Difference off = difference(whole, show(*mapped, 0.5));
        const Difference without = difference(whole, show(*none, 0.5));
        EXPECT_LT(off.mean, kSourceMean);
        EXPECT_GT(without.mean, 4.0 * off.mean) << "or the test shows nothing";
    }
}

TEST_P(NormalMapView, looksAsTheDeformedSourceDrawnByOpenSceneGraph)
{
    // Alike everywhere, so that the source can be deformed by a matrix: sheared, stretched and turned; then mirrored, too.
    const LodAsset& asset = mapped->getGpuAsset()->asset();
    for (const double side : {1.0, -1.0}) {
        osg::Matrixd shape;
        shape.set(1.1, 0.3, 0.0, 0.0, 0.0, 0.7 * side, 0.2, 0.0, 0.4, 0.0, 1.2, 0.0, 0.1, -0.1, 0.2, 1.0);
        mapped->setDeformation(new ControlMeshDeformation(mapped->getGpuAsset(), std::vector<osg::Matrixd>(asset.baseVertices.size(), shape)));
        const osg::ref_ptr<osg::MatrixTransform> source = new osg::MatrixTransform(shape);
        source->addChild(sourceGeometry(asset).get());
        lookFrom(osg::Vec3d(1.0, -6.0, 3.0));
        const std::vector<unsigned char> whole = picture(*source);
        EXPECT_LT(difference(whole, show(*mapped, 0.5)).mean, kSourceMean) << side;
        mapped->setDeformation(nullptr);
        EXPECT_GT(difference(whole, show(*mapped, 0.5)).mean, 10.0) << "it is deformed";
    }
}

TEST_P(NormalMapView, hasTenBitsOfItsImageOnAUnitOfItsOwn)
{
    show(*mapped, 4.0);
    const osg::StateSet* state = mapped->getMaterialState(0);
    ASSERT_NE(state, nullptr);
    EXPECT_NE(state->getDefinePair("TESSLOD_NORMAL_MAP"), nullptr);
    const auto* texture = dynamic_cast<const osg::Texture2D*>(state->getTextureAttribute(9, osg::StateAttribute::TEXTURE));
    ASSERT_NE(texture, nullptr);
    EXPECT_EQ(texture->getImage()->s(), 512);
    EXPECT_EQ(texture->getImage()->getDataType(), static_cast<GLenum>(GL_UNSIGNED_SHORT));
    EXPECT_EQ(texture->getInternalFormat(), GL_RGB10_A2);
    EXPECT_EQ(texture->getFilter(osg::Texture::MIN_FILTER), osg::Texture::LINEAR_MIPMAP_LINEAR);
    show(*perPatch, 4.0);
    const osg::StateSet* other = perPatch->getMaterialState(0);
    EXPECT_TRUE(other == nullptr || other->getDefinePair("TESSLOD_NORMAL_MAP") == nullptr);
}

TEST_P(NormalMapView, isLitByItsTrianglesWhereTheMapHasNoDirection)
{
    const osg::ref_ptr<osg::Image> grey = new osg::Image;
    grey->allocateImage(2, 2, 1, GL_RGB, GL_UNSIGNED_BYTE);
    std::fill(grey->data(), grey->data() + grey->getTotalSizeInBytes(), static_cast<unsigned char>(128));
    std::stringstream png;
    ASSERT_TRUE(osgDB::Registry::instance()->getReaderWriterForExtension("png")->writeImage(*grey, png).success());
    LodAsset asset = mapped->getGpuAsset()->asset();
    const std::string bytes = png.str();
    asset.images.front().bytes.assign(bytes.begin(), bytes.end());
    const osg::ref_ptr<TessLODDrawable> undirected = new TessLODDrawable(std::make_shared<const LodAsset>(asset));
    lookFrom(osg::Vec3d(2.0, -4.0, 3.0));
    EXPECT_EQ(show(*undirected, 4.0), show(*none, 4.0));
}

TEST_P(NormalMapView, keepsTheSourcesNormalsAtCoarseLevels)
{
    lookFrom(osg::Vec3d(2.0, -4.0, 3.0));
    const Difference off = difference(show(*perPatch, 6.0), show(*mapped, 6.0));
    const Difference without = difference(show(*perPatch, 6.0), show(*none, 6.0));
    EXPECT_LT(off.mean, 0.2 * without.mean);
}

TEST_P(NormalMapView, followsDeformations)
{
    for (const double time : {0.4, 2.0}) {
        for (TessLODDrawable* drawable : {perPatch.get(), mapped.get(), none.get()}) {
            drawable->setDeformation(new ControlMeshDeformation(
                drawable->getGpuAsset(), poseOf(drawable->getGpuAsset()->asset(), bending, time)));
        }
        lookFrom(osg::Vec3d(1.0, -6.0, 3.0));
        const Difference off = difference(show(*perPatch, 0.5), show(*mapped, 0.5));
        EXPECT_LT(off.mean, kMean);
        EXPECT_LT(off.beyond8, kBeyond8);
        perPatch->setDeformation(nullptr);
        EXPECT_GT(difference(show(*mapped, 0.5), show(*perPatch, 0.5)).mean, 10.0) << "it is bent";
    }
}

TEST_P(NormalMapView, turnsWithPlacements)
{
    const std::vector<osg::Matrixd> places{osg::Matrixd::rotate(1.0, 1.0, 0.5, 0.0) * osg::Matrixd::scale(0.5, 0.6, 0.5) *
                                               osg::Matrixd::translate(-0.8, 0.0, 0.0),
                                           osg::Matrixd::rotate(2.5, 0.0, 1.0, 0.3) * osg::Matrixd::scale(-0.5, 0.5, 0.5) *
                                               osg::Matrixd::translate(0.8, 0.0, 0.0)};
    std::array<std::vector<unsigned char>, 2> pictures;
    lookFrom(osg::Vec3d(0.0, -5.0, 2.0));
    for (std::size_t k = 0; k < 2; ++k) {
        const osg::ref_ptr<TessLODInstances> instances = new TessLODInstances;
        instances->shareAsset(k == 0 ? *perPatch : *mapped);
        instances->setPlacements(places);
        pictures[k] = show(*instances, 0.5);
    }
    const Difference off = difference(pictures[0], pictures[1]);
    EXPECT_LT(off.mean, kMean);
    EXPECT_LT(off.beyond8, kBeyond8);

    const osg::ref_ptr<osg::Geometry> source = sourceGeometry(mapped->getGpuAsset()->asset());
    const osg::ref_ptr<osg::Group> placed = new osg::Group;
    for (const osg::Matrixd& place : places) {
        const osg::ref_ptr<osg::MatrixTransform> transform = new osg::MatrixTransform(place);
        transform->addChild(source.get());
        placed->addChild(transform.get());
    }
    EXPECT_LT(difference(picture(*placed), pictures[1]).mean, kSourceMean);
}

INSTANTIATE_TEST_SUITE_P(EveryBackend, NormalMapView, testing::Values(Backend::Tessellation, Backend::Instanced),
                         [](const auto& named) { return std::string(nameOf(named.param)); });

} // namespace
} // namespace osgTessLOD
