// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/ChartError.h>
#include <osgTessLOD/bake/HeightField.h>
#include <osgTessLOD/bake/HeightTile.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/Progress.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// A height field in patches: right triangles in the plane, each the vertical projection of its patch. Where the finest level
/// would not follow the heights, triangles are bisected at the middle of their longest side, those across it too
/// (newest-vertex bisection: no vertex ever lies on the side of a triangle), so that patches are small where the ground is
/// rough and large where it is smooth.
class OSGTESSLOD_EXPORT TerrainMap : public PatchMap {
public:
    /// `field` has no voids. Patches are bisected while their heights, sampled at the pattern of `factor`, are farther than
    /// `tolerance` (of the size of the field's bounding box) from the field's, but not beyond eight of its vertices per sample.
    TerrainMap(HeightField field, unsigned factor, double tolerance, Progress& progress);

    /// A tile without voids. Its seams are drawn with the same vertices from both sides, whatever the view: within `seamTolerance`
    /// (of the same size) of the field's border where half of `factor` can do it, and within `tolerance` elsewhere.
    TerrainMap(HeightTile tile, unsigned factor, double tolerance, double seamTolerance, Progress& progress);

    const HeightField& field() const { return _field; }
    std::uint64_t sourceTriangles() const override { return 2 * std::uint64_t{_field.columns - 1} * (_field.rows - 1); }

    /// Linear on the field's triangles; normals are of the field's smooth slopes.
    SurfacePoint evaluate(std::uint32_t patch, const Eigen::Vector3d& barycentric) const override;

    /// The field's triangles in the working frame, and its samples with the patches they belong to.
    const SourceMesh& source() const { return _source; }
    const SourceSamples& sourceSamples() const { return _samples; }

private:
    /// Heights of the samples on each side of the tile beyond which there is another, by HeightTile::Side; else empty.
    using SeamHeights = std::array<std::vector<float>, 4>;

    void makePatches(unsigned factor, double tolerance, double seamTolerance, Progress& progress);
    std::array<Eigen::Vector2d, 3> cornersOf(std::uint32_t patch) const;
    double heightAt(Eigen::Vector2d& at) const;
    void fitFrame();
    void sampleSource();

    HeightField _field;
    HeightField _around; ///< of a tile: with some samples beyond it
    SeamHeights _seams;
    double _rootSamples = 0.0; ///< HeightTile::rootSamples
    std::vector<Eigen::Vector2d> _vertices; ///< of the patches: fractional column and row
    SourceMesh _source;
    SourceSamples _samples;
};

} // namespace osgTessLOD::bake
