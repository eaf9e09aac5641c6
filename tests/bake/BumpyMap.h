// SPDX-License-Identifier: MIT
// Uneven surfaces over small control meshes.
#pragma once

#include <osgTessLOD/bake/PatchMap.h>

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

namespace osgTessLOD::bake {

/// The flat patches between base vertices spread over a sphere, displaced by a sum of waves of position: bumps, and with
/// `crease` a fold along a plane through the middle.
class BumpyMap : public PatchMap {
public:
    explicit BumpyMap(PatchTopology topology, double height = 0.1, bool crease = false)
        : _height(height)
        , _crease(crease)
    {
        _topology = std::move(topology);
        _name = "bumpy";
        for (std::uint32_t v = 0; v < _topology.vertexCount; ++v) {
            const double z = 1.0 - (2.0 * v + 1.0) / _topology.vertexCount, turn = 2.399963 * v;
            const double radius = std::sqrt(1.0 - z * z);
            _base.emplace_back(radius * std::cos(turn), radius * std::sin(turn), z);
        }
    }

    std::uint64_t sourceTriangles() const override { return 0; }
    SurfacePoint evaluate(std::uint32_t patch, const Eigen::Vector3d& b) const override
    {
        const auto& corners = _topology.patches[patch];
        const Eigen::Vector3d flat = b[0] * _base[corners[0]] + b[1] * _base[corners[1]] + b[2] * _base[corners[2]];
        const Eigen::Vector3d p = 7.0 * flat;
        const double wave = std::sin(p.x() + 1.0) * std::cos(p.y()) + 0.4 * std::sin(2.3 * p.z() + p.y());
        const double fold = _crease ? std::fabs(flat.x() + 0.3 * flat.y() - 0.05) : 0.0;
        const Eigen::Vector3d along(0.48, 0.6, 0.64);
        return {flat + (_height * wave + fold) * along, along};
    }

private:
    std::vector<Eigen::Vector3d> _base;
    double _height;
    bool _crease;
};

} // namespace osgTessLOD::bake
