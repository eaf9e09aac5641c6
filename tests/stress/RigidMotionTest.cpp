// SPDX-License-Identifier: MIT
// What is baked of a source that was turned and moved.
#include <stress/RandomSource.h>
#include <stress/Stress.h>

#include <osgTessLOD/bake/Baker.h>

#include <gtest/gtest.h>

namespace osgTessLOD::stress {
namespace {

struct Outcome {
    std::size_t patches;
    double chartError;
    std::vector<double> largest;
    std::vector<double> mean;
};

Outcome bakeIt(const SourceMesh& mesh, const std::string& technique, std::size_t patches)
{
    bake::BakeOptions options;
    options.maxFactor = 8;
    options.controlMesh.patches = patches;
    options.patchTolerance = 0.02;
    options.tolerance = 0.0;
    options.technique = technique;
    options.normals = false;
    bake::Progress progress;
    bake::BakeReport report;
    const LodAsset asset = bake::bakeMesh(mesh, options, progress, report);
    Outcome outcome{asset.patches.size(), report.largestChartError, {}, {}};
    for (const LodLevel& level : asset.levels) {
        double largest = 0.0, sum = 0.0;
        for (const LevelError& e : level.errors) { largest = std::max(largest, double{e.isotropic}); sum += e.isotropic; }
        outcome.largest.push_back(largest);
        outcome.mean.push_back(sum / level.errors.size());
    }
    return outcome;
}

TEST(RigidMotion, Measure)
{
    using namespace bake;
    std::vector<SourceMesh> sources{noisy(sphere(4), 0.004, 3), openGrid(24), noisy(torus(48, 20), 0.004, 41), sphere(4), torus(48,20)};
    for (SourceMesh& m : sources) {
        m.frame = {};
        for (const char* technique : {"strips", "uniform"}) {
            std::printf("%s %s\n", m.name.c_str(), technique);
            for (unsigned k = 0; k < 11; ++k) {
                Random random(k);
                Similarity motion;
                if (k > 0) { motion.turn = random.rotation(); motion.offset = random.direction() * random.between(0, 2); }
                const Outcome o = bakeIt(motion(m), technique, 24);
                std::printf("  %zu patches chart %.6f", o.patches, o.chartError);
                for (std::size_t l = 0; l < o.largest.size(); ++l) std::printf("  %.5f/%.6f", o.largest[l], o.mean[l]);
                std::printf("\n");
            }
        }
    }
}

} // namespace
} // namespace osgTessLOD::stress
