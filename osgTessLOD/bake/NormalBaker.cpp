// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/NormalBaker.h>

#include <osgTessLOD/bake/PatternResampling.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Grid = std::vector<Vector3f>;

std::uint32_t gridIndex(std::uint32_t resolution, std::uint32_t i, std::uint32_t j)
{
    return j * (2 * resolution + 3 - j) / 2 + i;
}

/// Grid point `step` steps along side `side`, from corner side to corner side + 1.
std::uint32_t sideIndex(std::uint32_t resolution, unsigned side, std::uint32_t step)
{
    switch (side) {
    case 0: return gridIndex(resolution, step, 0);
    case 1: return gridIndex(resolution, resolution - step, step);
    default: return gridIndex(resolution, 0, resolution - step);
    }
}

Vector3f normalized(const Vector3f& sum, const Vector3f& fallback)
{
    const float length = sum.norm();
    return length > 1e-6F ? Vector3f(sum / length) : fallback;
}

/// Interior grid points of half the resolution: half of the point, half of its six neighbours' mean.
void halveInterior(const Grid& fine, std::uint32_t coarseResolution, Grid& coarse)
{
    static constexpr std::array<std::pair<int, int>, 6> kNeighbours{{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
    for (std::uint32_t j = 1; j < coarseResolution; ++j) {
        for (std::uint32_t i = 1; i + j < coarseResolution; ++i) {
            const Vector3f& center = fine[gridIndex(2 * coarseResolution, 2 * i, 2 * j)];
            Vector3f sum = 6.0F * center;
            for (const auto& [di, dj] : kNeighbours) {
                sum += fine[gridIndex(2 * coarseResolution, 2 * i + static_cast<std::uint32_t>(di),
                                      2 * j + static_cast<std::uint32_t>(dj))];
            }
            coarse[gridIndex(coarseResolution, i, j)] = normalized(sum, center);
        }
    }
}

/// Border points, ¼ ½ ¼ along the border and once for both patches. Corners stay as they are.
void halveBorder(const PatchTopology::Edge& edge, std::uint32_t coarseResolution, const std::vector<Grid>& fine,
                 std::vector<Grid>& coarse)
{
    const std::uint32_t fineResolution = 2 * coarseResolution;
    const auto at = [&](std::uint32_t step) -> const Vector3f& {
        return fine[edge.patches[0]][sideIndex(fineResolution, edge.sides[0], step)];
    };
    for (std::uint32_t step = 0; step <= coarseResolution; ++step) {
        const bool isEnd = step == 0 || step == coarseResolution;
        const Vector3f normal =
            isEnd ? at(2 * step)
                  : normalized(2.0F * at(2 * step) + at(2 * step - 1) + at(2 * step + 1), at(2 * step));
        coarse[edge.patches[0]][sideIndex(coarseResolution, edge.sides[0], step)] = normal;
        if (edge.patches[1] != kNoPatch) {
            coarse[edge.patches[1]][sideIndex(coarseResolution, edge.sides[1], coarseResolution - step)] = normal;
        }
    }
}

std::vector<std::uint32_t> encode(const std::vector<Grid>& grids)
{
    std::vector<std::uint32_t> texels;
    texels.reserve(grids.size() * grids.front().size());
    for (const Grid& grid : grids) {
        for (const Vector3f& n : grid) { texels.push_back(encodeOctahedral(n.cast<double>())); }
    }
    return texels;
}

} // namespace

std::uint32_t encodeOctahedral(const Vector3d& normal)
{
    const double sum = normal.cwiseAbs().sum();
    double x = sum > 0.0 ? normal.x() / sum : 0.0;
    double y = sum > 0.0 ? normal.y() / sum : 0.0;
    if (normal.z() < 0.0) {
        const double foldedX = (1.0 - std::fabs(y)) * (x >= 0.0 ? 1.0 : -1.0);
        y = (1.0 - std::fabs(x)) * (y >= 0.0 ? 1.0 : -1.0);
        x = foldedX;
    }
    const auto snorm = [](double value) {
        const auto rounded = static_cast<std::int32_t>(std::lround(std::clamp(value, -1.0, 1.0) * 32767.0));
        return static_cast<std::uint32_t>(rounded) & 0xFFFFU;
    };
    return snorm(x) | snorm(y) << 16;
}

Vector3d decodeOctahedral(std::uint32_t code)
{
    const auto snorm = [](std::uint32_t bits) {
        return std::max(-1.0, static_cast<double>(static_cast<std::int16_t>(bits)) / 32767.0);
    };
    const double x = snorm(code & 0xFFFFU);
    const double y = snorm(code >> 16);
    const double z = 1.0 - std::fabs(x) - std::fabs(y);
    const double fold = std::max(-z, 0.0);
    return Vector3d(x + (x >= 0.0 ? -fold : fold), y + (y >= 0.0 ? -fold : fold), z).normalized();
}

NormalTexture bakeNormals(const PatchTopology& topology, const ChartSet& charts, std::uint32_t resolution,
                          Progress& progress)
{
    NormalTexture texture;
    texture.resolution = resolution;
    progress.begin("normals", charts.charts.size(), "patches");
    const auto resampling = PatternResampling::ontoGrid(charts.factor, resolution);
    std::vector<Grid> grids(charts.charts.size());
    tbb::parallel_for(std::size_t{0}, grids.size(), [&](std::size_t p) {
        grids[p].resize(resampling.size());
        for (std::size_t i = 0; i < grids[p].size(); ++i) {
            grids[p][i] = normalized(resampling.sample(charts.charts[p].normals, i), Vector3f::UnitZ());
        }
        progress.step(1);
    });
    // Rounding differs with the side a border point is interpolated from: the first patch's value holds.
    for (const auto& edge : topology.edges) {
        if (edge.patches[1] == kNoPatch) { continue; }
        for (std::uint32_t step = 1; step < resolution; ++step) {
            grids[edge.patches[1]][sideIndex(resolution, edge.sides[1], resolution - step)] =
                grids[edge.patches[0]][sideIndex(resolution, edge.sides[0], step)];
        }
    }
    texture.levels.push_back(encode(grids));
    for (std::uint32_t r = resolution / 2; r > 0; r /= 2) {
        std::vector<Grid> coarse(grids.size());
        tbb::parallel_for(std::size_t{0}, grids.size(), [&](std::size_t p) {
            coarse[p].resize(NormalTexture::texelCount(r));
            halveInterior(grids[p], r, coarse[p]);
        });
        for (const auto& edge : topology.edges) { halveBorder(edge, r, grids, coarse); }
        grids = std::move(coarse);
        texture.levels.push_back(encode(grids));
    }
    std::reverse(texture.levels.begin(), texture.levels.end());
    progress.end();
    return texture;
}

} // namespace osgTessLOD::bake
