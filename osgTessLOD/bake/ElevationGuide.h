// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/RayPrism.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

namespace osgTessLOD::bake {

/// What collapses are refused for so that a source stays an elevation of the mesh that they make of it (Yotam Livny et al.,
/// "Displacement patches for view-dependent rendering", 2012, §3.2): triangles that would turn away from their rays. It guides; what holds in the
/// end is for ElevationRegions to say.
class ElevationGuide {
public:
    /// Keeps a reference to `source`. Cosines of angles between rays and the normals of triangles are to be `leastCosine`.
    ElevationGuide(const SourceMesh& source, double leastCosine);

    /// Heights that a triangle's rays reach up and down to.
    struct Reach {
        double low = 0.0;
        double high = 0.0;
    };

    /// Do rays go apart, clearly, within the reach?
    static bool isOpen(const RayPrism& prism, const Reach& reach);
    /// Do all source triangles around a source vertex that the prism's triangle has at `barycentric` face the ray from there?
    /// Adds its height to the reach.
    bool faces(const RayPrism& prism, std::uint32_t vertex, const Eigen::Vector3d& barycentric, Reach& reach) const;

    /// The most weight, in source triangles, of a face that holds this source vertex; 0: no face around it may go.
    double largestWeight(std::uint32_t vertex) const { return _largestWeight[vertex]; }
    /// Faces that hold the vertex shall be this much smaller than any `weight`, or be the source's own.
    void tighten(std::uint32_t vertex, double weight);

private:
    const SourceMesh& _source;
    double _leastCosine;
    std::vector<Eigen::Vector3d> _normals; ///< of the source's triangles, unit; zero without an area
    std::vector<std::uint32_t> _first;     ///< per source vertex: into _around
    std::vector<std::uint32_t> _around;    ///< source triangles
    std::vector<double> _largestWeight;    ///< per source vertex
};

} // namespace osgTessLOD::bake
