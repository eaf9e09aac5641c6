// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/Triangulation.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace osgTessLOD {

/// Finds which triangle of a chart lies at which parameters, by a grid over the parameter triangle.
class ChartLocator {
public:
    struct Place {
        std::array<std::uint32_t, 3> vertices; ///< of the triangle
        std::array<double, 3> weights;         ///< of them; below 0 by rounding alone
    };

    /// `points`: where the vertices are; the triangles cover the parameter triangle.
    ChartLocator(bake::Triangulation triangles, std::vector<ChartPoint> points)
        : _triangles(std::move(triangles))
        , _points(std::move(points))
        , _cells(std::size_t{kCells} * kCells)
    {
        for (std::uint32_t t = 0; t < _triangles.triangles().size(); ++t) {
            const auto& corners = _triangles.triangles()[t];
            const auto [u0, u1] = std::minmax({_points[corners[0]].u, _points[corners[1]].u, _points[corners[2]].u});
            const auto [v0, v1] = std::minmax({_points[corners[0]].v, _points[corners[1]].v, _points[corners[2]].v});
            for (std::size_t y = cellOf(v0); y <= cellOf(v1); ++y) {
                for (std::size_t x = cellOf(u0); x <= cellOf(u1); ++x) { _cells[y * kCells + x].push_back(t); }
            }
        }
    }

    /// `u`, `v`: in units of ChartPoint, in the parameter triangle.
    Place at(double u, double v) const
    {
        Place best{};
        double largest = -std::numeric_limits<double>::max();
        for (const std::uint32_t t : _cells[cellOf(v) * kCells + cellOf(u)]) {
            const auto& corners = _triangles.triangles()[t];
            const std::array<double, 3> weights = weightsIn(corners, u, v);
            const double least = std::min({weights[0], weights[1], weights[2]});
            if (least > largest) {
                largest = least;
                best = {corners, weights};
            }
            if (least >= 0.0) { break; }
        }
        return best;
    }

private:
    static constexpr std::size_t kCells = 128;

    static std::size_t cellOf(double parameter)
    {
        const double cell = parameter * static_cast<double>(kCells) / ChartPoint::kUnits;
        return static_cast<std::size_t>(std::clamp(cell, 0.0, kCells - 1.0));
    }
    std::array<double, 3> weightsIn(const bake::Triangulation::Triangle& corners, double u, double v) const
    {
        const auto area = [&](std::size_t k) { // of the point and the side across from corner k, doubled
            const ChartPoint a = _points[corners[(k + 1) % 3]];
            const ChartPoint b = _points[corners[(k + 2) % 3]];
            return (a.u - u) * (b.v - v) - (a.v - v) * (b.u - u);
        };
        const std::array<double, 3> areas{area(0), area(1), area(2)};
        const double sum = areas[0] + areas[1] + areas[2];
        return {areas[0] / sum, areas[1] / sum, areas[2] / sum};
    }

    bake::Triangulation _triangles;
    std::vector<ChartPoint> _points;
    std::vector<std::vector<std::uint32_t>> _cells; ///< the triangles whose boxes meet each
};

} // namespace osgTessLOD
