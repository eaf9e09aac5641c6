// SPDX-License-Identifier: MIT
// A triangle's vertices are where the patch's progress t ∈ [0, 1] from a level to the next, and the levels of its three borders put
// them (MorphedLevels). Between two stored levels each vertex is affine in every one of these, so the normal a × b + b × c + c × a is
// a polynomial of degree two at most in each. It is in the convex hull of its Bernstein coefficients, and a cone of no more than
// a half space that has the coefficients has the polynomial.
#include <osgTessLOD/bake/NormalCone.h>

#include <osgTessLOD/asset/TessellationPattern.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;

/// What a triangle's vertices depend on: the patch's progress, and the levels of borders 0, 1, 2.
enum Variable { kProgress, kFirstBorder, kVariables = kFirstBorder + 3 };

/// One level's triangles on their way to the next coarser one.
class MovingTriangles {
public:
    MovingTriangles(const PatchLevels& levels, const std::vector<std::uint16_t>& ladder, const FinestLevels& finest,
                    std::size_t level)
        : _levels(levels)
        , _ladder(ladder)
        , _finest(finest)
        , _level(level)
        , _factor(ladder[level])
    {
    }

    void appendCoefficients(const std::array<std::uint32_t, 3>& triangle, std::vector<Vector3d>& normals) const
    {
        const std::vector<Variable> variables = variablesOf(triangle);
        std::array<double, kVariables> from{}; // level that an interval of a border's starts from
        forEachInterval(variables, 0, from, [&] { appendCoefficients(triangle, variables, from, normals); });
    }

private:
    bool isOnBorder(std::uint32_t index) const { return index < 3 * _factor; }

    /// Those that a vertex depends on; corners on none.
    void addVariablesOf(std::uint32_t index, std::array<bool, kVariables>& used) const
    {
        if (isOnBorder(index)) {
            if (index % _factor != 0) { used[kFirstBorder + index / _factor] = true; }
            return;
        }
        used[kProgress] = true;
        const std::uint32_t parent = _levels.parents[_level][index];
        const std::uint32_t parentFactor = _ladder[_level - 1];
        if (parent < 3 * parentFactor && parent % parentFactor != 0) { used[kFirstBorder + parent / parentFactor] = true; }
    }

    std::vector<Variable> variablesOf(const std::array<std::uint32_t, 3>& triangle) const
    {
        std::array<bool, kVariables> used{};
        for (const std::uint32_t index : triangle) { addVariablesOf(index, used); }
        std::vector<Variable> variables;
        for (int v = 0; v < kVariables; ++v) {
            if (used[static_cast<std::size_t>(v)]) { variables.push_back(static_cast<Variable>(v)); }
        }
        return variables;
    }

    /// Intervals between stored levels that the borders among the variables can be in.
    template <typename Visit>
    void forEachInterval(const std::vector<Variable>& variables, std::size_t k, std::array<double, kVariables>& from,
                         const Visit& visit) const
    {
        if (k == variables.size()) {
            visit();
            return;
        }
        std::size_t intervals = 1;
        if (variables[k] != kProgress) {
            const std::size_t border = variables[k] - kFirstBorder;
            intervals = std::max<std::size_t>(1, std::min<std::size_t>(_level, _finest.borders[border]));
        }
        for (std::size_t interval = 0; interval < intervals; ++interval) {
            from[variables[k]] = static_cast<double>(interval);
            forEachInterval(variables, k + 1, from, visit);
        }
    }

    void appendCoefficients(const std::array<std::uint32_t, 3>& triangle, const std::vector<Variable>& variables,
                            const std::array<double, kVariables>& from, std::vector<Vector3d>& normals) const
    {
        std::size_t count = 1;
        for (std::size_t k = 0; k < variables.size(); ++k) { count *= 3; }
        const std::size_t first = normals.size();
        for (std::size_t n = 0; n < count; ++n) {
            std::array<double, kVariables> at{};
            std::size_t rest = n;
            for (const Variable v : variables) {
                at[v] = from[v] + 0.5 * static_cast<double>(rest % 3);
                rest /= 3;
            }
            const Vector3d a = pointAt(triangle[0], at);
            normals.push_back((pointAt(triangle[1], at) - a).cross(pointAt(triangle[2], at) - a));
        }
        // From values at 0, ½, 1 to coefficients, variable by variable.
        for (std::size_t stride = 1; stride < count; stride *= 3) {
            for (std::size_t n = 0; n < count; ++n) {
                if (n / stride % 3 != 1) { continue; }
                Vector3d* middle = &normals[first + n];
                *middle = 2.0 * *middle - 0.5 * (*(middle - stride) + *(middle + stride));
            }
        }
    }

    Vector3d pointAt(std::uint32_t index, const std::array<double, kVariables>& at) const
    {
        if (isOnBorder(index)) { return borderPoint(_level, index, at[kFirstBorder + index / _factor]); }
        const std::uint32_t parent = _levels.parents[_level][index];
        const std::uint32_t parentFactor = _ladder[_level - 1];
        const Vector3d from = parent < 3 * parentFactor
                                  ? borderPoint(_level - 1, parent, at[kFirstBorder + parent / parentFactor])
                                  : _levels.positions[_level - 1][parent];
        return from + at[kProgress] * (_levels.positions[_level][index] - from);
    }

    /// As the levels have it at most.
    Vector3d borderPoint(std::size_t level, std::uint32_t index, double borderLevel) const
    {
        const auto reached = static_cast<std::size_t>(std::ceil(borderLevel));
        for (; level > reached; --level) { index = _levels.parents[level][index]; }
        const Vector3d own = _levels.positions[level][index];
        const double t = borderLevel - (static_cast<double>(level) - 1.0);
        if (level == 0 || t >= 1.0) { return own; }
        const Vector3d from = _levels.positions[level - 1][_levels.parents[level][index]];
        return from + t * (own - from);
    }

    const PatchLevels& _levels;
    const std::vector<std::uint16_t>& _ladder;
    const FinestLevels& _finest;
    std::size_t _level;
    std::uint32_t _factor;
};

} // namespace

NormalCone coneOfDrawnNormals(const PatchLevels& levels, const std::vector<std::uint16_t>& ladder,
                              const FinestLevels& finest)
{
    const auto& base = levels.positions.front();
    std::vector<Vector3d> normals{(base[1] - base[0]).cross(base[2] - base[0])};
    for (std::size_t level = 1; level <= finest.patch; ++level) {
        const MovingTriangles triangles(levels, ladder, finest, level);
        const TessellationPattern pattern(ladder[level]);
        for (const auto& t : pattern.triangles()) { triangles.appendCoefficients(t, normals); }
    }
    NormalCone cone;
    Vector3d sum = Vector3d::Zero();
    for (const Vector3d& n : normals) { sum += n; }
    if (!(sum.norm() > 0.0)) { return cone; }
    double cosine = 1.0;
    for (const Vector3d& n : normals) {
        if (n.norm() > 0.0) { cosine = std::min(cosine, sum.dot(n) / (sum.norm() * n.norm())); }
    }
    if (cosine > 0.0) { cone = {sum.normalized(), cosine}; }
    return cone;
}

} // namespace osgTessLOD::bake
