// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// Points of the parameter triangle as weighted sums of three vertices of a tessellation pattern: linear interpolation
/// on the pattern's triangles, the same for every patch.
class PatternResampling {
public:
    /// The vertices of pattern `to` by those of pattern `from`.
    static PatternResampling betweenPatterns(unsigned from, unsigned to);
    /// The points of the regular triangular grid of a NormalTexture by the vertices of pattern `from`.
    static PatternResampling ontoGrid(unsigned from, unsigned resolution);

    std::size_t size() const { return _vertices.size(); }

    /// Interpolated value at point i; Value is a fixed size Eigen vector.
    template <typename Value>
    Value sample(const std::vector<Value>& values, std::size_t i) const
    {
        using Scalar = typename Value::Scalar;
        const auto& v = _vertices[i];
        const auto& w = _weights[i];
        return static_cast<Scalar>(w[0]) * values[v[0]] + static_cast<Scalar>(w[1]) * values[v[1]] +
               static_cast<Scalar>(w[2]) * values[v[2]];
    }

private:
    PatternResampling(unsigned from, const std::vector<std::array<double, 3>>& points);

    std::vector<std::array<std::uint32_t, 3>> _vertices;
    std::vector<std::array<double, 3>> _weights;
};

} // namespace osgTessLOD::bake
