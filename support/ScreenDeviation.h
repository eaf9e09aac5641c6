// SPDX-License-Identifier: MIT
// How far what is drawn of a baked surface lies from its reference on screen, from many places.
#pragma once

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/DifferenceVectors.h>
#include <osgTessLOD/bake/Triangulation.h>
#include <osgTessLOD/render/AffineMap.h>
#include <osgTessLOD/render/ControlMeshDeformation.h>
#include <osgTessLOD/render/MorphedSurface.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <support/ChartLocator.h>
#include <support/RandomDirection.h>
#include <support/ScreenCamera.h>

#include <osg/Vec3d>
#include <osg/Vec4d>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

namespace osgTessLOD {

/// Does a border of the patch need more than it has, so that nothing is promised of the patch?
inline bool hasSaturatedBorder(const LodAsset& asset, const PatchSelector& selector, std::uint32_t patch,
                               const SelectionView& view, const SelectionOptions& options)
{
    const auto& edges = asset.patches[patch].edges;
    return std::any_of(edges.begin(), edges.end(),
                       [&](std::uint32_t edge) { return selector.edgeLevel(edge, view, options).saturated; });
}

/// Reproducible cameras about an asset: inside of it, close over its surface, where the near plane cuts it and farther, grazing
/// it, from 10⁻³ to 10³ of its size away, and orthographic ones; fields of view of 5° to 140°, turned in any way, in viewports of
/// several shapes.
class RandomCameras {
public:
    RandomCameras(const LodAsset& asset, unsigned seed)
        : _asset(asset)
        , _random(seed)
    {
        for (std::size_t k = 0; k < 3; ++k) {
            _center[static_cast<int>(k)] = 0.5 * (double{asset.boundsMin[k]} + asset.boundsMax[k]);
            _size += std::pow(double{asset.boundsMax[k]} - asset.boundsMin[k], 2.0);
        }
        _size = std::sqrt(_size);
    }

    ScreenCamera next()
    {
        ScreenCamera camera;
        const std::array<std::array<double, 2>, 3> viewports{{{1280.0, 800.0}, {400.0, 900.0}, {64.0, 64.0}}};
        camera.width = viewports[_count % viewports.size()][0];
        camera.height = viewports[_count % viewports.size()][1];
        const double near = 1e-3 * _size;
        osg::Vec3d target = surfacePoint();
        osg::Vec3d eye;
        switch (_count % 5) {
        case 0: eye = _center + (surfacePoint() - _center) * uniform(0.0, 1.0); break;
        case 1: eye = surfacePoint() + direction() * near * std::pow(10.0, uniform(-1.0, 2.5)); break;
        case 2: std::tie(eye, target) = grazing(near * std::pow(10.0, uniform(-1.0, 1.5))); break;
        default: eye = target + direction() * _size * std::pow(10.0, uniform(-3.0, 3.0));
        }
        camera.localToEye = osg::Matrixd::lookAt(eye, target, direction());
        const double aspect = camera.width / camera.height;
        if (_count % 16 == 15) {
            const double half = _size * std::pow(10.0, uniform(-2.0, 2.0));
            camera.projection.makeOrtho(-half * aspect, half * aspect, -half, half, near, 1e6 * near);
        } else {
            camera.projection.makePerspective(uniform(5.0, 140.0), aspect, near, 1e6 * near);
        }
        ++_count;
        return camera;
    }

private:
    double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(_random); }

    osg::Vec3d direction() { return randomDirection(_random); }

    std::size_t surfaceVertex()
    {
        return std::uniform_int_distribution<std::size_t>(0, _asset.levels.front().vertices.size() - 1)(_random);
    }
    /// Of the coarsest level, a triangle per patch.
    osg::Vec3d place(std::size_t vertex) const
    {
        const auto p = _asset.position(_asset.patches[vertex / 3], _asset.levels.front().vertices[vertex]);
        return {p[0], p[1], p[2]};
    }
    osg::Vec3d surfacePoint() { return place(surfaceVertex()); }
    /// Over a corner of a triangle of the coarsest level, and over the next one: eye and target.
    std::pair<osg::Vec3d, osg::Vec3d> grazing(double height)
    {
        const std::size_t corner = surfaceVertex();
        const std::size_t first = corner - corner % 3;
        osg::Vec3d normal = (place(first + 1) - place(first)) ^ (place(first + 2) - place(first));
        normal.normalize();
        return {place(corner) + normal * height, place(first + (corner + 1) % 3) + normal * height};
    }

    const LodAsset& _asset;
    std::mt19937_64 _random;
    osg::Vec3d _center;
    double _size = 0.0;
    unsigned _count = 0;
};

/// Compares patches as drawn, by the CPU twin of the shaders, with the charts that their asset was made of. Keeps references.
class ScreenDeviation {
public:
    ScreenDeviation(const bake::PatchedSurface& surface, const LodAsset& asset)
        : _asset(asset)
        , _surface(asset)
        , _chartTriangles(bake::Triangulation::ofPattern(surface.charts.factor))
        , _chartPoints(bake::patternPoints(surface.charts.factor))
        , _chartLocator(_chartTriangles, _chartPoints)
    {
        const bake::WorkingFrame& frame = surface.map->frame();
        const Eigen::Vector3d origin(asset.lattice.origin[0], asset.lattice.origin[1], asset.lattice.origin[2]);
        for (const bake::PatchChart& chart : surface.charts.charts) {
            std::vector<Eigen::Vector3d>& positions = _charts.emplace_back();
            for (const Eigen::Vector3d& p : chart.positions) {
                positions.emplace_back(frame.center - origin + frame.scale * p);
            }
        }
        for (const std::uint16_t factor : asset.ladder) { _patterns.push_back(bake::Triangulation::ofPattern(factor)); }
    }

    /// The largest distance, in pixels, between a point of the patch that is in view and the point of its chart with the same
    /// parameters (those of vertices on their way between levels rounded to the chart's lattice, as by the bake). At all
    /// vertices of both and wherever their edges cross. A chart's point behind the eye counts as the viewport's diagonal away.
    /// 0 if nothing is in view. With a deformation: of what is drawn of it, from where it takes the chart's points.
    double pixels(const PatchRecord& record, const ScreenCamera& camera,
                  const ControlMeshDeformation* deformation = nullptr) const
    {
        const Drawn drawn = draw(record, deformation);
        const bake::DifferenceVectors differences({_patterns[drawn.level], drawn.points}, {_chartTriangles, _chartPoints});
        const osg::Matrixd localToClip = camera.localToClip();
        double largest = 0.0;
        for (const bake::DifferenceVectors::Row& row : differences.rows()) {
            const osg::Vec4d at = blend(drawn.positions, row.levelVertices, row.levelWeights) * localToClip;
            if (!isInView(at)) { continue; }
            const osg::Vec4d chart = blend(_charts[record.patch], row.chartVertices, row.chartWeights);
            const osg::Vec4d wanted =
                deformed(chart, drawn, row.levelVertices, row.levelWeights, record.patch, deformation) * localToClip;
            largest = std::max(largest, distance(at, wanted, camera));
        }
        return largest;
    }

    struct Sampled {
        double pixels = 0.0;      ///< the largest distance
        std::uint64_t points = 0; ///< in view
    };
    /// The same at `count` random points of the patch's triangles.
    template <typename Random>
    Sampled sample(const PatchRecord& record, const ScreenCamera& camera, std::size_t count, Random& random,
                   const ControlMeshDeformation* deformation = nullptr) const
    {
        const Drawn drawn = draw(record, deformation);
        const auto& triangles = _patterns[drawn.level].triangles();
        const osg::Matrixd localToClip = camera.localToClip();
        std::uniform_int_distribution<std::size_t> which(0, triangles.size() - 1);
        std::uniform_real_distribution<double> uniform(0.0, 1.0);
        Sampled sampled;
        for (std::size_t k = 0; k < count; ++k) {
            const auto& corners = triangles[which(random)];
            const double root = std::sqrt(uniform(random)); // evenly over the triangle
            const double part = uniform(random);
            const std::array<double, 3> weights{1.0 - root, root * (1.0 - part), root * part};
            const osg::Vec4d at = blend(drawn.positions, corners, weights) * localToClip;
            if (!isInView(at)) { continue; }
            double u = 0.0;
            double v = 0.0;
            for (std::size_t c = 0; c < 3; ++c) {
                u += weights[c] * drawn.points[corners[c]].u;
                v += weights[c] * drawn.points[corners[c]].v;
            }
            const ChartLocator::Place place = _chartLocator.at(u, v);
            const osg::Vec4d chart = blend(_charts[record.patch], place.vertices, place.weights);
            const osg::Vec4d wanted = deformed(chart, drawn, corners, weights, record.patch, deformation) * localToClip;
            sampled.pixels = std::max(sampled.pixels, distance(at, wanted, camera));
            ++sampled.points;
        }
        return sampled;
    }

private:
    /// A patch as drawn.
    struct Drawn {
        unsigned level;
        std::vector<Eigen::Vector3d> positions; ///< asset frame
        std::vector<ChartPoint> points;
        std::vector<MorphedSurface::Vec3> weights; ///< of the patch's corners, not rounded
    };

    Drawn draw(const PatchRecord& record, const ControlMeshDeformation* deformation) const
    {
        Drawn drawn{MorphedSurface::drawnLevel(record.edgeLevels), {}, {}, {}};
        const std::uint32_t count = TessellationPattern::vertexCount(_asset.ladder[drawn.level]);
        for (std::uint32_t v = 0; v < count; ++v) {
            const auto point = _surface.tessLodSurfacePoint(record.patch, record.edgeLevels, v);
            osg::Vec3f at(point.position[0], point.position[1], point.position[2]);
            if (deformation != nullptr) { at = deformation->tessLodDeformed(at, point.weights, record.patch); }
            drawn.positions.emplace_back(at.x(), at.y(), at.z());
            drawn.points.push_back(rounded(point.weights));
            drawn.weights.push_back(point.weights);
        }
        return drawn;
    }

    /// Where the deformation takes a point with the weights that what is drawn has at these vertices' mean.
    osg::Vec4d deformed(const osg::Vec4d& point, const Drawn& drawn, const std::array<std::uint32_t, 3>& vertices,
                        const std::array<double, 3>& weights, std::uint32_t patch,
                        const ControlMeshDeformation* deformation) const
    {
        if (deformation == nullptr) { return point; }
        const osg::Vec3d p(point.x(), point.y(), point.z());
        osg::Vec3d sum;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            double weight = 0.0;
            for (std::size_t k = 0; k < 3; ++k) { weight += weights[k] * double{drawn.weights[vertices[k]][corner]}; }
            sum += deformation->maps()[_asset.patches[patch].baseVertices[corner]](p) * weight;
        }
        return {sum, 1.0};
    }

    static bool isInView(const osg::Vec4d& clip)
    {
        return clip.w() > 0.0 && std::fabs(clip.x()) <= clip.w() && std::fabs(clip.y()) <= clip.w();
    }

    static ChartPoint rounded(const MorphedSurface::Vec3& weights)
    {
        const auto units = [&](std::size_t k) {
            return static_cast<std::int32_t>(std::lround(double{weights[k]} * ChartPoint::kUnits));
        };
        ChartPoint point{units(1), units(2)};
        if (weights[0] <= 0.0F) { point.v = ChartPoint::kUnits - point.u; } // on that side
        point.v = std::min(point.v, ChartPoint::kUnits - point.u);
        return point;
    }

    static osg::Vec4d blend(const std::vector<Eigen::Vector3d>& positions, const std::array<std::uint32_t, 3>& vertices,
                            const std::array<double, 3>& weights)
    {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (std::size_t k = 0; k < 3; ++k) { sum += weights[k] * positions[vertices[k]]; }
        return {sum.x(), sum.y(), sum.z(), 1.0};
    }

    static double distance(const osg::Vec4d& a, const osg::Vec4d& b, const ScreenCamera& camera)
    {
        if (!(b.w() > 0.0)) { return std::hypot(camera.width, camera.height); }
        return std::hypot(0.5 * camera.width * (a.x() / a.w() - b.x() / b.w()),
                          0.5 * camera.height * (a.y() / a.w() - b.y() / b.w()));
    }

    const LodAsset& _asset;
    MorphedSurface _surface;
    bake::Triangulation _chartTriangles;
    std::vector<ChartPoint> _chartPoints;
    ChartLocator _chartLocator;
    std::vector<std::vector<Eigen::Vector3d>> _charts; ///< asset frame
    std::vector<bake::Triangulation> _patterns;        ///< per level
};

} // namespace osgTessLOD
