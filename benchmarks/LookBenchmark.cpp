// SPDX-License-Identifier: MIT
#include "Benchmark.h"
#include "HeadlessStage.h"

#include <osgTessLOD/asset/AssetImages.h>
#include <osgTessLOD/bake/SourceSurface.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/MaterialState.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <fmt/format.h>
#include <osg/Geometry>
#include <osg/Image>
#include <osgDB/WriteFile>

#include <array>
#include <cmath>
#include <exception>
#include <memory>
#include <stdexcept>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr int kWidth = 1280;
constexpr int kHeight = 800;
/// Samples of a pixel, squared: without, pictures of triangles smaller than pixels differ by which of them a sample hits.
constexpr int kSamples = 4;
/// Of the eye from the middle, in radii of the bounding sphere.
constexpr std::array<double, 4> kDistances{2.0, 4.0, 10.0, 40.0};
constexpr int kNear = 8; ///< steps of 255 that colours may differ by and still look alike
/// What every level is drawn from, as kDistances.
constexpr double kDistanceOfFactors = 4.0;

/// The mean of a pixel's samples; alpha 255 where all are drawn on, 0 where none is.
std::array<unsigned char, 4> meanOf(const osg::Image& samples, int x, int y)
{
    std::array<int, 4> sums{};
    for (int j = 0; j < kSamples; ++j) {
        const unsigned char* sample =
            samples.data(static_cast<unsigned>(kSamples * x), static_cast<unsigned>(kSamples * y + j));
        for (int k = 0; k < 4 * kSamples; ++k) { sums[static_cast<std::size_t>(k % 4)] += sample[k]; }
    }
    std::array<unsigned char, 4> mean{};
    constexpr int kCount = kSamples * kSamples;
    for (std::size_t k = 0; k < 3; ++k) { mean[k] = static_cast<unsigned char>((sums[k] + kCount / 2) / kCount); }
    mean[3] = static_cast<unsigned char>(sums[3] == 255 * kCount ? 255 : sums[3] > 0 ? 128 : 0);
    return mean;
}

osg::ref_ptr<osg::Image> meanOf(const osg::Image& samples)
{
    osg::ref_ptr<osg::Image> image = new osg::Image;
    image->allocateImage(kWidth, kHeight, 1, GL_RGBA, GL_UNSIGNED_BYTE);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const auto pixel = meanOf(samples, x, y);
            std::copy(pixel.begin(), pixel.end(), image->data(static_cast<unsigned>(x), static_cast<unsigned>(y)));
        }
    }
    return image;
}

/// How two pictures differ, of pixels inside both silhouettes.
struct Difference {
    std::uint64_t pixels = 0;
    std::uint64_t silhouette = 0; ///< pixels that one of them at least draws on in part
    double mean = 0.0;            ///< absolute, of all channels, in steps of 255
    double nearShare = 0.0;       ///< of pixels whose channels all differ by kNear at most
    int largest = 0;
};

Difference compare(const osg::Image& first, const osg::Image& second)
{
    Difference result;
    std::uint64_t sum = 0;
    std::uint64_t nearPixels = 0;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const unsigned char* a = first.data(static_cast<unsigned>(x), static_cast<unsigned>(y));
            const unsigned char* b = second.data(static_cast<unsigned>(x), static_cast<unsigned>(y));
            if (a[3] == 0 && b[3] == 0) { continue; }
            if (a[3] != 255 || b[3] != 255) {
                ++result.silhouette;
                continue;
            }
            int worst = 0;
            for (int k = 0; k < 3; ++k) {
                const int difference = std::abs(int{a[k]} - int{b[k]});
                sum += static_cast<std::uint64_t>(difference);
                worst = std::max(worst, difference);
            }
            ++result.pixels;
            nearPixels += worst <= kNear ? 1 : 0;
            result.largest = std::max(result.largest, worst);
        }
    }
    const double pixels = static_cast<double>(std::max<std::uint64_t>(result.pixels, 1));
    result.mean = static_cast<double>(sum) / (3.0 * pixels);
    result.nearShare = static_cast<double>(nearPixels) / pixels;
    return result;
}

/// All triangles of the source, with normals as a bake has them, in the asset's frame.
osg::ref_ptr<osg::Geometry> fullGeometry(const Scene& scene, const LodAsset& asset)
{
    bake::SourceMesh mesh = bake::importMesh(scene.source);
    cleanMesh(mesh);
    const bake::CornerNormals normals = bake::cornerNormals(mesh, bake::ControlMeshOptions().creaseAngleRadians);
    const osg::ref_ptr<osg::Vec3Array> vertices = new osg::Vec3Array;
    const osg::ref_ptr<osg::Vec3Array> directions = new osg::Vec3Array(osg::Array::BIND_PER_VERTEX);
    const osg::ref_ptr<osg::Vec2Array> uvs = new osg::Vec2Array;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Eigen::Vector3d& p = mesh.positions[mesh.triangles[t][k]];
            const auto at = [&](std::size_t axis) {
                return p[static_cast<Eigen::Index>(axis)] - asset.lattice.origin[axis];
            };
            vertices->push_back(osg::Vec3(osg::Vec3d(at(0), at(1), at(2))));
            const Eigen::Vector3f& n = normals[t][k];
            directions->push_back(osg::Vec3(n.x(), n.y(), n.z()));
            if (mesh.hasUvs(t)) {
                uvs->push_back(osg::Vec2(mesh.uvs[t][k].x(), mesh.uvs[t][k].y()));
            } else {
                uvs->push_back(osg::Vec2());
            }
        }
    }
    osg::ref_ptr<osg::Geometry> geometry = new osg::Geometry;
    geometry->setUseDisplayList(false);
    geometry->setUseVertexBufferObjects(true);
    geometry->setVertexArray(vertices.get());
    geometry->setNormalArray(directions.get());
    geometry->setTexCoordArray(0, uvs.get());
    geometry->addPrimitiveSet(new osg::DrawArrays(GL_TRIANGLES, 0, static_cast<int>(vertices->size())));
    return geometry;
}

/// The baked model, and all of its source's triangles, under the same light.
class Stage {
public:
    Stage(const Scene& scene, const std::string& colorImage)
    {
        _drawable = drawableOf(scene, colorImage);
        const osg::ref_ptr<osg::Geometry> geometry = fullGeometry(scene, _drawable->getGpuAsset()->asset());
        if (_drawable->getMaterialState(0) != nullptr) { geometry->setStateSet(_drawable->getMaterialState(0)); }
        _stage.add(_drawable.get());
        _stage.add(geometry.get());
        drawFrom(kDistances.front(), kFull); // what a context draws first is brighter
    }

    enum Shown : unsigned { kBaked, kFull }; ///< numbers on the stage

    /// What the baked model keeps: an error of one pixel of a picture.
    void askForOnePixel()
    {
        SelectionOptions options;
        options.errorPixels = kSamples;
        _drawable->setOptions(options);
    }
    /// All patches at this factor, or at their finest level where that is coarser.
    void askForFactor(unsigned factor)
    {
        SelectionOptions options;
        options.errorPixels = 1e-6;
        options.maxFactor = factor;
        _drawable->setOptions(options);
    }
    const std::vector<std::uint16_t>& factors() const { return _drawable->getGpuAsset()->asset().ladder; }

    osg::ref_ptr<osg::Image> drawFrom(double distance, Shown which)
    {
        const osg::BoundingSphere& sphere = _drawable->getBound();
        const osg::Vec3d center(sphere.center());
        const double radius = double{sphere.radius()};
        ScreenCamera camera;
        camera.projection.makePerspective(30.0, double{kWidth} / kHeight, (distance - 1.1) * radius, (distance + 1.1) * radius);
        camera.localToEye.makeLookAt(center + osg::Vec3d(0.35, -0.9, 0.25) * (distance * radius), center,
                                     osg::Vec3d(0.0, 0.0, 1.0));
        camera.width = kSamples * kWidth;
        camera.height = kSamples * kHeight;
        _stage.look(camera);
        osg::ref_ptr<osg::Image> samples;
        _stage.draw(which, [&](osg::RenderInfo&) { samples = _stage.picture(); });
        return meanOf(*samples);
    }
    const std::string& renderer() const { return _stage.renderer(); }

private:
    static osg::ref_ptr<TessLODDrawable> drawableOf(const Scene& scene, const std::string& colorImage)
    {
        bake::Progress progress;
        bake::BakeReport report;
        LodAsset asset = bake::bakeSource(scene.source, bake::BakeOptions(), progress, report);
        if (asset.patchMaterials.size() > 1) { throw std::runtime_error("has several materials"); }
        if (!colorImage.empty()) { setColorImage(asset, colorImage); }
        osg::ref_ptr<TessLODDrawable> drawable =
            new TessLODDrawable(std::make_shared<const LodAsset>(std::move(asset)));
        addMaterialStates(*drawable, "", nullptr);
        return drawable;
    }

    osg::ref_ptr<TessLODDrawable> _drawable;
    HeadlessStage _stage{kSamples * kWidth, kSamples * kHeight};
};

void keep(const osg::Image& image, const LookBenchmarkOptions& options, const std::string& scene,
          const std::string& which)
{
    if (options.keepFolder.empty()) { return; }
    const std::string path = fmt::format("{}/{}_{}.png", options.keepFolder, scene, which);
    if (!osgDB::writeImageFile(image, path)) { throw std::runtime_error(path + ": cannot be written"); }
}

Json asJson(const Difference& difference)
{
    return {{"pixels", difference.pixels},
            {"silhouette", difference.silhouette},
            {"mean", difference.mean},
            {"nearShare", difference.nearShare},
            {"largest", difference.largest}};
}

std::vector<std::string> cells(const Difference& difference)
{
    return {grouped(difference.pixels), grouped(difference.silhouette), fmt::format("{:.3f}", difference.mean),
            fmt::format("{:.3f}", 100.0 * difference.nearShare), std::to_string(difference.largest)};
}

/// A row of the table, led by these cells.
std::vector<std::string> row(std::vector<std::string> first, const Difference& difference)
{
    const std::vector<std::string> rest = cells(difference);
    first.insert(first.end(), rest.begin(), rest.end());
    return first;
}

} // namespace

BenchmarkResult benchmarkLook(const std::vector<Scene>& scenes, const LookBenchmarkOptions& options)
{
    BenchmarkResult result;
    result.tables.resize(2);
    ResultTable& byDistance = result.tables[0];
    ResultTable& byFactor = result.tables[1];
    byDistance.headers = {"scene", "distance", "pixels", "silhouette", "mean difference", "within 8 %", "largest"};
    byFactor.headers = {"scene", "factor", "pixels", "silhouette", "mean difference", "within 8 %", "largest"};
    Json factors = Json::array();
    double mean = 0.0;
    double nearShare = 1.0;
    for (const Scene& scene : scenes) {
        try {
            Stage stage(scene, options.colorImage);
            stage.askForOnePixel();
            for (const double distance : kDistances) {
                const osg::ref_ptr<osg::Image> ours = stage.drawFrom(distance, Stage::kBaked);
                const osg::ref_ptr<osg::Image> full = stage.drawFrom(distance, Stage::kFull);
                const Difference difference = compare(*ours, *full);
                keep(*ours, options, scene.name, fmt::format("{:g}_baked", distance));
                keep(*full, options, scene.name, fmt::format("{:g}_full", distance));
                result.rows.push_back({{"scene", scene.name}, {"distance", distance}});
                result.rows.back().update(asJson(difference));
                byDistance.rows.push_back(row({scene.name, fmt::format("{:g}", distance)}, difference));
                mean = std::max(mean, difference.mean);
                nearShare = std::min(nearShare, difference.nearShare);
            }
            const osg::ref_ptr<osg::Image> full = stage.drawFrom(kDistanceOfFactors, Stage::kFull);
            for (const unsigned factor : stage.factors()) {
                stage.askForFactor(factor);
                const osg::ref_ptr<osg::Image> level = stage.drawFrom(kDistanceOfFactors, Stage::kBaked);
                const Difference difference = compare(*level, *full);
                keep(*level, options, scene.name, fmt::format("factor_{}", factor));
                factors.push_back({{"scene", scene.name}, {"factor", factor}});
                factors.back().update(asJson(difference));
                byFactor.rows.push_back(row({scene.name, std::to_string(factor)}, difference));
            }
            result.glRenderer = stage.renderer();
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = {{"largest_mean_difference", mean}, {"least_share_within_8", nearShare}, {"factors", factors}};
    return result;
}

} // namespace osgTessLOD::benchmarks
