// SPDX-License-Identifier: MIT
// Displacement maps made from meshes: what is written gives the surface back.
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/SurfaceMesh.h>
#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/DisplacementFiles.h>
#include <osgTessLOD/bake/ElevationMap.h>
#include <osgTessLOD/bake/ImageFiles.h>
#include <osgTessLOD/bake/RefinedPatches.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <tbb/global_control.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;

constexpr unsigned kSteps = 16;
constexpr double kFloatStep = 0x1p-24; ///< half of the last place, of 1

struct Case {
    const char* name;
    const char* file;
    std::function<std::unique_ptr<PatchMap>(Progress&)> make;
    /// Of the range of the pixels: what the format rounds to.
    double quantum;
};

std::ostream& operator<<(std::ostream& stream, const Case& written)
{
    return stream << written.name;
}

ControlMeshOptions options(std::size_t patches)
{
    ControlMeshOptions options;
    options.patches = patches;
    return options;
}

std::unique_ptr<PatchMap> elevations(Progress& progress)
{
    return std::make_unique<ElevationMap>(noisy(sphere(4), 0.003, 1), options(40), progress);
}

/// With spikes that lean over and fold: no height could make them.
std::unique_ptr<PatchMap> folds(Progress& progress)
{
    return std::make_unique<RefinedPatches>(std::make_unique<ControlMesh>(spikySphere(4), options(24), progress),
                                            kSteps, 1.0, progress);
}

const Case kCases[] = {{"ScalarFloat", "out.exr", elevations, 4.0 * kFloatStep},
                       {"ScalarPng", "out.png", elevations, 0.51 / 65535.0},
                       {"ScalarTiff", "out.tif", elevations, 0.51 / 65535.0},
                       {"VectorFloat", "out.exr", folds, 4.0 * kFloatStep},
                       {"VectorPng", "out.png", folds, 0.51 / 65535.0}};

class WrittenDisplacement : public testing::TestWithParam<Case> {
protected:
    DisplacementFiles write(const PatchMap& map, DisplacementSampling sampling = DisplacementSampling::Intersection)
    {
        Progress progress;
        DisplacementFiles files = makeDisplacementFiles(map, _folder.file(GetParam().file), kSteps, sampling, progress);
        files.write();
        return files;
    }
    static std::unique_ptr<DisplacedMap> read(const DisplacementFiles& files)
    {
        SourceMesh base = importMesh(files.meshPath);
        cleanMesh(base);
        const unsigned channels = files.options.kind == DisplacementOptions::Kind::Scalar ? 1 : 3;
        return std::make_unique<DisplacedMap>(base, DisplacementImage::read(files.imagePath, channels), files.options);
    }
    static Vector3d inSource(const PatchMap& map, std::uint32_t patch, const Vector3d& b)
    {
        return map.frame().center + map.frame().scale * map.evaluate(patch, b).position;
    }

    TemporaryDirectory _folder;
};

/// Each component is off by the rounding of what the file holds, √3 times that as a vector; positions by that of the working frame.
TEST_P(WrittenDisplacement, GivesTheSurfaceBackAtItsPixels)
{
    Progress progress;
    const auto map = GetParam().make(progress);
    const DisplacementFiles files = write(*map);
    const auto back = read(files);
    ASSERT_EQ(back->topology().patches.size(), map->topology().patches.size());
    const TriangleLattice lattice{kSteps};
    const Displacement displacement = displacementOf(*map, files.options.kind == DisplacementOptions::Kind::Scalar);
    double low = 0.0;
    double high = 0.0;
    double largest = 0.0;
    for (std::uint32_t p = 0; p < map->topology().patches.size(); ++p) {
        for (unsigned j = 0; j <= kSteps; ++j) {
            for (unsigned i = 0; i + j <= kSteps; ++i) {
                const Vector3d b = lattice.weights(i, j);
                low = std::min(low, displacement(p, b).minCoeff());
                high = std::max(high, displacement(p, b).maxCoeff());
                largest = std::max(largest, (inSource(*back, p, b) - inSource(*map, p, b)).norm());
            }
        }
    }
    // Integers have the range of all pixels, those beyond the patches' long sides, too, which no point here has.
    const double range = files.options.scale != 1.0 ? files.options.scale : high - low;
    EXPECT_LT(range, 1.5 * (high - low));
    EXPECT_LT(largest, std::sqrt(3.0) * GetParam().quantum * range + 1e-9);
    EXPECT_GT(high - low, 0.01) << "a displacement worth the name";
}

TEST_P(WrittenDisplacement, BothSidesOfABorderAgree)
{
    Progress progress;
    const DisplacementFiles files = write(*GetParam().make(progress));
    const auto back = read(files);
    double largest = 0.0;
    for (const PatchTopology::Edge& edge : back->topology().edges) {
        if (edge.patches[1] == kNoPatch) { continue; }
        for (const double share : {0.013, 0.21, 0.5, 0.77, 0.99}) { // between pixels
            std::array<Vector3d, 2> found;
            for (std::size_t which = 0; which < 2; ++which) {
                Vector3d b = Vector3d::Zero();
                b[edge.sides[which]] = which == 0 ? 1.0 - share : share;
                b[(edge.sides[which] + 1) % 3] = 1.0 - b[edge.sides[which]];
                found[which] = inSource(*back, edge.patches[which], b);
            }
            largest = std::max(largest, (found[0] - found[1]).norm());
        }
    }
    // The pixels beyond a long side are made of three others, each rounded.
    EXPECT_LT(largest, 4.0 * GetParam().quantum * files.options.scale + 1e-7);
}

TEST_P(WrittenDisplacement, SameBytesWhateverTheThreads)
{
    Progress progress;
    for (const auto sampling : {DisplacementSampling::Intersection, DisplacementSampling::Fit}) {
        const auto writtenBy = [&](std::size_t threads) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            return write(*GetParam().make(progress), sampling);
        };
        const DisplacementFiles first = writtenBy(1);
        std::this_thread::sleep_for(std::chrono::milliseconds(1100)); // files that hold the time would differ
        const DisplacementFiles second = writtenBy(2);
        EXPECT_TRUE(first.imageBytes == second.imageBytes);
        EXPECT_TRUE(first.meshText == second.meshText);
    }
}

INSTANTIATE_TEST_SUITE_P(, WrittenDisplacement, testing::ValuesIn(kCases),
                         [](const auto& written) { return std::string(written.param.name); });

/// Mean square distance between a sphere and the triangles of the samples.
double meanSquare(const ElevationMap& map, unsigned steps, DisplacementSampling sampling)
{
    Progress progress;
    const TriangleLattice lattice{steps};
    const auto samples = sampleDisplacement(map.topology(), displacementOf(map, true), lattice, sampling, progress);
    double sum = 0.0;
    std::size_t count = 0;
    std::mt19937 random(3);
    for (std::uint32_t p = 0; p < samples.size(); ++p) {
        const auto vertex = [&](unsigned i, unsigned j) -> Vector3d {
            const Vector3d b = lattice.weights(i, j);
            return map.prism(p).pointAt(b) +
                   samples[p][lattice.index(i, j)].x() / map.frame().scale * map.prism(p).rayAt(b).normalized();
        };
        for (unsigned j = 0; j < steps; ++j) {
            for (unsigned i = 0; i + j < steps; ++i) {
                const Vector3d b = randomWeights(random);
                const Vector3d at = b[0] * vertex(i, j) + b[1] * vertex(i + 1, j) + b[2] * vertex(i, j + 1);
                const Vector3d inUnits = map.frame().center + map.frame().scale * at;
                sum += std::pow(inUnits.norm() - 1.0, 2);
                ++count;
            }
        }
    }
    return sum / static_cast<double>(count);
}

/// Straight pieces between samples of a curve all lie inside of it, its means more so; fitted ones lie on both sides.
TEST(DisplacementSampling, FitsLieOnBothSidesOfACurvedSurface)
{
    Progress progress;
    SourceMesh mesh = sphere(6);
    const double radius = 1.0 / mesh.frame.scale;
    ASSERT_NEAR((mesh.positions[0]).norm(), radius, 1e-9);
    const ElevationMap map(std::move(mesh), options(24), progress);
    const double intersection = meanSquare(map, 8, DisplacementSampling::Intersection);
    // Of a curve 1/720 against 1/120 of its second derivative's square; less at borders, which are fitted by themselves.
    EXPECT_LT(meanSquare(map, 8, DisplacementSampling::Fit), 0.3 * intersection);
    EXPECT_GT(meanSquare(map, 8, DisplacementSampling::Interpolation), intersection);
}

TEST(DisplacementFiles, NothingIsLeftOfWhatCannotBeWritten)
{
    const TemporaryDirectory folder;
    Progress progress;
    const auto map = elevations(progress);
    DisplacementFiles files =
        makeDisplacementFiles(*map, folder.file("out.exr"), 4, DisplacementSampling::Intersection, progress);
    std::filesystem::create_directory(folder.file("out.obj")); // in the way of the second file
    EXPECT_THROW(files.write(), AssetError);
    EXPECT_FALSE(std::filesystem::exists(folder.file("out.exr")));
    EXPECT_EQ(
        std::distance(std::filesystem::directory_iterator(std::filesystem::path(folder.file("out.exr")).parent_path()),
                      std::filesystem::directory_iterator()),
        1);
}

TEST(DisplacementFiles, RefusesWhatItCannotWriteAndToReplaceTheSource)
{
    const TemporaryDirectory folder;
    EXPECT_THROW(checkDisplacementPath("out.jpg", "in.ply"), AssetError);
    EXPECT_NO_THROW(checkDisplacementPath("out.exr", "out.obj")); // neither is there
    std::ofstream(folder.file("out.obj")) << "v 0 0 0\n";
    EXPECT_THROW(checkDisplacementPath(folder.file("out.exr"), folder.file("out.obj")), AssetError);
}

/// What is stored of a base mesh with a map is the map at the same parameters, but for the asset's lattice: of heights, and of vectors
/// of either kind, folds included.
class DisplacedBake : public testing::TestWithParam<DisplacementOptions::Kind> {};

TEST_P(DisplacedBake, FinestLevelIsTheMapEvaluated)
{
    const TemporaryDirectory folder;
    constexpr std::uint32_t kSize = 16;
    const bool isScalar = GetParam() == DisplacementOptions::Kind::Scalar;
    ImageData image;
    image.width = kSize;
    image.height = kSize;
    image.channels = isScalar ? 1 : 3;
    for (std::uint32_t y = 0; y < kSize; ++y) {
        for (std::uint32_t x = 0; x < kSize; ++x) {
            const double turn = 2.0 * kPi * (x + 0.5) / kSize;
            // Goes back and forth by more than the way between: a fold.
            const Vector3d value(0.8 * std::sin(turn), 0.2 * std::cos(2.0 * kPi * y / kSize), 0.5 * std::cos(turn));
            for (unsigned c = 0; c < image.channels; ++c) { image.pixels.push_back(static_cast<float>(value[c])); }
        }
    }
    const std::string imagePath = folder.file("map.exr");
    std::ofstream(imagePath, std::ios::binary) << imageFiles().encode(imagePath, image);
    const std::string basePath = folder.file("base.obj");
    std::ofstream(basePath)
        << "v 0 0 1\nv 2 0 1\nv 2 2 1.4\nv 0 2 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";

    BakeOptions options;
    options.technique = "uniform";
    options.tolerance = 0.0;
    options.displacement = imagePath;
    options.displaced.kind = GetParam();
    Progress progress;
    BakeReport report;
    const LodAsset asset = bakeSource(basePath, options, progress, report);
    const unsigned factor = asset.ladder.back();
    const SurfaceMesh surface = extractSurface(asset, factor);

    SourceMesh base = importMesh(basePath);
    cleanMesh(base);
    const DisplacedMap map(base, DisplacementImage::read(imagePath, image.channels), options.displaced);
    EXPECT_EQ(factor, map.finestFactor());
    double largest = 0.0;
    bool isFolded = false;
    for (std::uint32_t p = 0; p < 2; ++p) {
        for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
            const auto b = TessellationPattern::barycentric(factor, v);
            const SurfacePoint point = map.evaluate(p, Vector3d(b[0], b[1], b[2]) / (3.0 * factor));
            const Vector3d expected = map.frame().center + map.frame().scale * point.position;
            isFolded = isFolded || point.normal.z() < 0.0;
            double nearest = 1.0;
            for (const auto& q : surface.positions) {
                nearest = std::min(nearest, (Vector3d(q[0], q[1], q[2]) - expected).norm());
            }
            largest = std::max(largest, nearest);
        }
    }
    // Half a step of the lattice each way, and single precision of the exported positions.
    EXPECT_LT(largest, 0.5 * std::sqrt(3.0) * static_cast<double>(asset.lattice.step) + 4e-7);
    EXPECT_EQ(isFolded, !isScalar);
}

INSTANTIATE_TEST_SUITE_P(, DisplacedBake,
                         testing::Values(DisplacementOptions::Kind::Scalar, DisplacementOptions::Kind::TangentVector,
                                         DisplacementOptions::Kind::ObjectVector),
                         [](const auto& kind) {
                             return kind.param == DisplacementOptions::Kind::Scalar          ? "Scalar"
                                    : kind.param == DisplacementOptions::Kind::TangentVector ? "TangentVector"
                                                                                             : "ObjectVector";
                         });

} // namespace
} // namespace osgTessLOD::bake
