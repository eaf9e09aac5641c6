// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/PatternResampling.h>

#include <osgTessLOD/asset/TessellationPattern.h>

namespace osgTessLOD::bake {

PatternResampling::PatternResampling(unsigned from, const std::vector<std::array<double, 3>>& points)
{
    const TessellationPattern pattern(from);
    _vertices.reserve(points.size());
    _weights.reserve(points.size());
    for (const auto& point : points) {
        const TessellationPattern::Location at = pattern.locate(point);
        _vertices.push_back(pattern.triangles()[at.triangle]);
        _weights.push_back(at.weights);
    }
}

PatternResampling PatternResampling::betweenPatterns(unsigned from, unsigned to)
{
    std::vector<std::array<double, 3>> points(TessellationPattern::vertexCount(to));
    for (std::uint32_t v = 0; v < points.size(); ++v) {
        const auto b = TessellationPattern::barycentric(to, v);
        for (std::size_t k = 0; k < 3; ++k) { points[v][k] = static_cast<double>(b[k]) / (3.0 * to); }
    }
    return {from, points};
}

PatternResampling PatternResampling::ontoGrid(unsigned from, unsigned resolution)
{
    std::vector<std::array<double, 3>> points;
    const double r = resolution;
    for (unsigned j = 0; j <= resolution; ++j) {
        for (unsigned i = 0; i + j <= resolution; ++i) { points.push_back({(r - i - j) / r, i / r, j / r}); }
    }
    return {from, points};
}

} // namespace osgTessLOD::bake
