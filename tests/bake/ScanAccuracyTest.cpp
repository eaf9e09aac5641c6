// SPDX-License-Identifier: MIT
// The finest level of real scans against the scans themselves. Needs the models: see OSGTESSLOD_DATA in CONTRIBUTING.md.
#include <osgTessLOD/asset/SurfaceMesh.h>
#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/SourceMesh.h>
#include <osgTessLOD/bake/SurfaceDistance.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace osgTessLOD::bake {
namespace {

class ScanAccuracy : public testing::TestWithParam<const char*> {};

TEST_P(ScanAccuracy, FinestLevelIsWithinAThousandthOfTheDiagonal)
{
    const char* folder = std::getenv("OSGTESSLOD_DATA");
    if (folder == nullptr) { GTEST_SKIP() << "OSGTESSLOD_DATA names no folder of models"; }
    const std::string path = std::string(folder) + "/scans/" + GetParam();
    Progress progress;
    BakeReport report;
    SourceMesh source = importMesh(path);
    cleanMesh(source);
    BakeOptions options;
    // Strips would take many minutes. Their finest levels differ from uniform ones by a fit of positions to the charts alone.
    options.technique = "uniform";
    const LodAsset asset = bakeSource(path, options, progress, report);
    const SurfaceMesh surface = extractSurface(asset, 64);
    std::vector<Eigen::Vector3d> positions;
    for (const auto& p : surface.positions) { positions.emplace_back(p[0], p[1], p[2]); }
    const HausdorffDistance distance =
        hausdorffDistance({source.positions, source.triangles}, {positions, surface.triangles});

    EXPECT_LE(distance.forward, 0.001 * report.diagonal) << "source to finest level";
    EXPECT_LE(distance.backward, 0.001 * report.diagonal) << "finest level to source";
    // The error that the asset claims is of the same samples and more.
    EXPECT_LE(distance.symmetric(), report.stored.largestFinestError);
}

// Not engine_635k and dragon_871k, which take many times as long as these: docs/benchmarks.md has them.
INSTANTIATE_TEST_SUITE_P(Scans, ScanAccuracy, testing::Values("bunny_69k.ply", "armadillo_86k.obj", "turbine_199k.ply"));

} // namespace
} // namespace osgTessLOD::bake
