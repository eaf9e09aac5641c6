// SPDX-License-Identifier: MIT
// What is baked of a source that was turned and moved.
#include <stress/RandomSource.h>
#include <stress/Stress.h>

#include <osgTessLOD/bake/Baker.h>

#include <gtest/gtest.h>

#include <array>

namespace osgTessLOD::stress {
namespace {

constexpr unsigned kMotions = 10;

/// Errors of a bake, source units.
struct Errors {
    double chart;
    std::vector<double> largest; ///< isotropic, per level
    std::vector<double> mean;
};

Errors errorsOf(const SourceMesh& mesh, const std::string& technique)
{
    bake::BakeOptions options;
    options.maxFactor = 8;
    options.controlMesh.patches = 12;
    options.patchTolerance = 1.0; // a part of the box's diagonal, which is another one when turned: no patch is cut for it
    options.tolerance = 0.0;
    options.technique = technique;
    options.normals = false;
    bake::Progress progress;
    bake::BakeReport report;
    const LodAsset asset = bake::bakeMesh(mesh, options, progress, report);
    Errors errors{report.largestChartError, {}, {}};
    for (const auto& level : report.stored.levels) {
        errors.largest.push_back(level.largestError);
        errors.mean.push_back(level.meanError);
    }
    return errors;
}

/// How far the figures of bakes get from the first's, as parts of these.
class Spread {
public:
    void add(const std::vector<Errors>& all)
    {
        for (const Errors& errors : all) {
            addFigure(errors.chart, all.front().chart);
            ASSERT_EQ(errors.largest.size(), all.front().largest.size());
            for (std::size_t level = 0; level < errors.largest.size(); ++level) {
                addFigure(errors.largest[level], all.front().largest[level]);
                addFigure(errors.mean[level], all.front().mean[level]);
            }
        }
    }
    double largest() const { return _worst.value(); }
    double partWithinAHundredth() const { return static_cast<double>(_near) / static_cast<double>(_count); }

private:
    void addFigure(double own, double first)
    {
        const double difference = std::fabs(own - first) / first;
        _worst.add(difference);
        ++_count;
        _near += difference <= 0.01 ? 1 : 0;
    }

    Worst _worst;
    std::size_t _count = 0;
    std::size_t _near = 0;
};

std::vector<Errors> underMotions(const SourceMesh& mesh, const std::string& technique)
{
    std::vector<Errors> all{errorsOf(mesh, technique)};
    for (unsigned k = 0; k < kMotions; ++k) {
        SourceRandom random(k);
        Similarity motion;
        motion.turn = random.rotation();
        motion.offset = random.direction() * random.between(0.0, 2.0);
        all.push_back(errorsOf(motion(mesh), technique));
    }
    return all;
}

SourceMesh inItsOwnSpace(SourceMesh mesh)
{
    mesh.frame = {};
    return mesh;
}

/// Of which no two collapses cost the same.
SourceMesh unevenSource(unsigned k)
{
    return inItsOwnSpace(bake::noisy(k % 2 == 0 ? bake::sphere(3) : bake::openGrid(16), 0.01, 2 + k));
}

/// Control mesh, charts and levels are the same, the lattice and the box are others.
TEST(RigidMotions, ChangeErrorsByLessThanAHundredth)
{
    Spread spread;
    for (unsigned k = 0; k < trials(1); ++k) { spread.add(underMotions(unevenSource(k), "uniform")); }
    EXPECT_LT(spread.largest(), 0.01);
    report("errors differ by", spread.largest());
}

/// What a strip costs is a mean over directions that do not turn with the source (DirectionalErrors): where two strips cost nearly
/// the same, another one may be the cheapest, and a patch be better or worse by some hundredths at some levels.
TEST(RigidMotions, ChangeFewErrorsOfStripsByMore)
{
    Spread spread;
    for (unsigned k = 0; k < trials(1); ++k) { spread.add(underMotions(unevenSource(k), "strips")); }
    EXPECT_GT(spread.partWithinAHundredth(), 0.9);
    EXPECT_LT(spread.largest(), 0.25);
    report("errors differ by", spread.largest());
    report("part of them by less than a hundredth", spread.partWithinAHundredth());
}

/// Of a source whose collapses cost the same at every vertex, up to rounding: rounding does not choose the control mesh.
TEST(RigidMotions, OfSymmetricSourcesChooseTheSamePatches)
{
    Spread spread;
    spread.add(underMotions(inItsOwnSpace(bake::sphere(3)), "uniform"));
    EXPECT_LT(spread.largest(), 0.01);
    report("errors differ by", spread.largest());
}

} // namespace
} // namespace osgTessLOD::stress
