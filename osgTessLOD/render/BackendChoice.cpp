// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/BackendChoice.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/PatchSelection.h>

#include <osg/ColorMask>
#include <osg/Depth>
#include <osg/Notify>
#include <osg/RenderInfo>
#include <osg/StateSet>

#include <algorithm>
#include <chrono>
#include <limits>

namespace osgTessLOD {

namespace {

constexpr std::uint64_t kTrialVertices = 40'000; ///< a millisecond's work or less for a GPU
constexpr unsigned kTrialFactor = 16;
/// Instances must take less than this part of the tessellator's time: differences below it are noise.
constexpr double kWorthwhile = 0.9;

/// Nothing is written, whatever else is on. Vertices are placed all the same.
osg::ref_ptr<osg::StateSet> hiddenState()
{
    const auto on = osg::StateAttribute::ON | osg::StateAttribute::OVERRIDE | osg::StateAttribute::PROTECTED;
    osg::ref_ptr<osg::StateSet> state = new osg::StateSet;
    state->setAttribute(new osg::ColorMask(false, false, false, false), on);
    state->setAttributeAndModes(new osg::Depth(osg::Depth::NEVER, 0.0, 1.0, false), on);
    state->setMode(GL_STENCIL_TEST,
                   osg::StateAttribute::OFF | osg::StateAttribute::OVERRIDE | osg::StateAttribute::PROTECTED);
    return state;
}

/// All patches at about the factor of the trial, over and over.
PatchRecords trialRecords(const GpuAsset& asset)
{
    unsigned level = 0;
    while (level + 1U < asset.asset().ladder.size() && asset.asset().ladder[level + 1] <= kTrialFactor) { ++level; }
    const PatchRecords once = asset.selector().uniformRecords(level);
    std::uint64_t vertices = 0;
    std::vector<PatchRecord> records;
    for (std::size_t k = 0; vertices < kTrialVertices && !once.empty(); ++k) {
        const PatchRecord& record = once[k % once.size()];
        vertices +=
            TessellationPattern::vertexCount(asset.asset().ladder[MorphedSurface::drawnLevel(record.edgeLevels)]);
        records.push_back(record);
    }
    std::stable_sort(records.begin(), records.end(), [](const PatchRecord& a, const PatchRecord& b) {
        return MorphedSurface::drawnLevel(a.edgeLevels) < MorphedSurface::drawnLevel(b.edgeLevels);
    });
    return records;
}

/// Seconds of a draw: the least of a few, after one in which programs are compiled and buffers uploaded.
double secondsOf(osg::State& state, const PatchSelection& selection)
{
    constexpr int kDraws = 4;
    osg::RenderInfo renderInfo(&state, nullptr);
    double least = std::numeric_limits<double>::max();
    for (int draw = 0; draw <= kDraws; ++draw) {
        glFinish();
        const auto start = std::chrono::steady_clock::now();
        selection.drawImplementation(renderInfo);
        glFinish();
        const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
        if (draw > 0) { least = std::min(least, time.count()); }
    }
    return least;
}

Backend fasterBackend(osg::State& state, const GpuAsset& asset)
{
    const PatchRecords records = trialRecords(asset);
    const SelectionStatistics statistics = asset.selector().statisticsOf(records);
    const osg::ref_ptr<osg::StateSet> hidden = hiddenState();
    const auto secondsBy = [&](Backend backend) {
        const osg::ref_ptr<PatchSelection> selection =
            new PatchSelection(&asset, records, statistics, SelectionView(), backend);
        return secondsOf(state, *selection);
    };
    state.pushStateSet(hidden.get());
    const double tessellation = secondsBy(Backend::Tessellation);
    const double instanced = secondsBy(Backend::Instanced);
    state.popStateSet();
    state.apply();
    OSG_INFO << "osgTessLOD: " << statistics.triangles << " triangles take " << 1e3 * tessellation
             << " ms with tessellation shaders, " << 1e3 * instanced << " ms as instances" << std::endl;
    return instanced < kWorthwhile * tessellation ? Backend::Instanced : Backend::Tessellation;
}

} // namespace

std::optional<Backend> chooseBackend(osg::State& state, const GpuAsset& asset, Backend wanted)
{
    DrawContext& context = DrawContext::of(state);
    if (!context.supported()) { return std::nullopt; }
    if (wanted == Backend::Instanced || !context.canTessellate(state, asset.asset().ladder)) {
        return Backend::Instanced;
    }
    if (wanted == Backend::Tessellation) { return wanted; }
    if (!context.fastestBackend()) { context.setFastestBackend(fasterBackend(state, asset)); }
    return context.fastestBackend();
}

} // namespace osgTessLOD
