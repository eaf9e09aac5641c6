// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/ElevationMap.h>

#include <osgTessLOD/bake/CollapseHistory.h>
#include <osgTessLOD/bake/ElevationGuide.h>
#include <osgTessLOD/bake/ElevationRegions.h>
#include <osgTessLOD/bake/SourceSurface.h>
#include <osgTessLOD/bake/SurfaceCollapser.h>
#include <osgTessLOD/bake/VertexNormals.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kNone = ElevationBase::kNone;
/// Collapses are guided by where the history carries vertices, not by rays: the margin makes up for most of the difference.
constexpr double kGuideCosine = 0.2;
/// A ray whose triangle in its cell misses it by more than this may belong to a triangle that bulges into the cell.
constexpr double kMissed = 1e-9;

/// The source triangle that a collapsed face is, or kNone.
std::uint32_t ownTriangleOf(const RemainingFace& face, const SourceMesh& source)
{
    return face.number < source.triangles.size() ? face.number : kNone;
}

/// Base vertices, patches and rays of what collapses left.
ElevationBase baseOf(const SourceMesh& source, const std::vector<RemainingFace>& faces)
{
    ElevationBase base;
    std::vector<std::uint32_t> number(source.positions.size(), kNone);
    std::vector<std::array<std::uint32_t, 3>> patches;
    std::vector<Vector3d> positions;
    for (const RemainingFace& face : faces) {
        std::array<std::uint32_t, 3> patch{};
        for (std::size_t k = 0; k < 3; ++k) {
            std::uint32_t& own = number[face.vertices[k]];
            if (own == kNone) {
                own = static_cast<std::uint32_t>(base.vertices.size());
                base.vertices.push_back(face.vertices[k]);
                positions.push_back(source.positions[face.vertices[k]]);
            }
            patch[k] = own;
        }
        patches.push_back(patch);
        base.ownTriangle.push_back(ownTriangleOf(face, source));
    }
    const std::vector<Vector3d> normals = vertexNormals(positions, patches);
    for (const auto& patch : patches) {
        RayPrism& prism = base.prisms.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            prism.positions[k] = positions[patch[k]];
            prism.normals[k] = normals[patch[k]];
        }
    }
    base.topology = PatchTopology::build(static_cast<std::uint32_t>(positions.size()), std::move(patches));
    return base;
}

/// Where the history carries each source vertex.
std::vector<FacePoint> carriedVertices(const SourceMesh& source, const CollapseHistory& history,
                                       const std::vector<RemainingFace>& faces)
{
    std::uint32_t largest = 0;
    for (const RemainingFace& face : faces) { largest = std::max(largest, face.number); }
    std::vector<std::uint32_t> patchOfFace(largest + 1, kNone);
    for (std::uint32_t p = 0; p < faces.size(); ++p) { patchOfFace[faces[p].number] = p; }
    std::vector<FacePoint> points(source.positions.size());
    for (std::uint32_t t = 0; t < source.triangles.size(); ++t) {
        for (Eigen::Index k = 0; k < 3; ++k) {
            points[source.triangles[t][static_cast<std::size_t>(k)]] = {t, Vector3d::Unit(k)};
        }
    }
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t v) {
        const FacePoint coarse = history.toCoarse(points[v]);
        const std::uint32_t patch = patchOfFace[coarse.face];
        points[v].face = patch;
        for (Eigen::Index k = 0; k < 3; ++k) {
            points[v].barycentric[k] = coarse.barycentric[(faces[patch].corner + k) % 3];
        }
    });
    return points;
}

/// Has smaller patches made next time where the check failed.
void tighten(const ElevationBase& base, const ElevationRegions& regions, ElevationGuide& guide)
{
    std::vector<std::vector<std::uint32_t>> held(base.prisms.size()); // by where they are and where they were carried
    for (std::uint32_t v = 0; v < base.guesses.size(); ++v) {
        const std::uint32_t carried = base.guesses[v].face;
        const std::uint32_t found = regions.vertices()[v].patch;
        held[carried].push_back(v);
        if (found != kNone && found != carried) { held[found].push_back(v); }
    }
    for (std::uint32_t p = 0; p < held.size(); ++p) {
        if (regions.fails()[p] == 0) { continue; }
        for (const std::uint32_t v : base.topology.patches[p]) { held[p].push_back(base.vertices[v]); }
        constexpr double kTrianglesPerVertex = 2.0;
        const double weight = kTrianglesPerVertex * static_cast<double>(held[p].size());
        for (const std::uint32_t v : held[p]) { guide.tighten(v, weight); }
    }
}

} // namespace

ElevationMap::ElevationMap(SourceMesh source, const ControlMeshOptions& options, Progress& progress)
    : _source(std::move(source))
{
    _source.uvs.clear();
    _source.triangleMaterials.clear();
    _frame = _source.frame;
    _name = _source.name;
    _attributes = attributesOf(_source);
    _cornerNormals = cornerNormals(_source, options.creaseAngleRadians);
    ElevationGuide guide(_source, kGuideCosine);
    for (;;) {
        ++_rounds;
        CollapseHistory history(static_cast<std::uint32_t>(_source.triangles.size()));
        const std::vector<RemainingFace> faces = collapseSurface(_source, options, history, progress, &guide);
        ElevationBase base = baseOf(_source, faces);
        base.guesses = carriedVertices(_source, history, faces);
        const ElevationRegions regions(_source, base);
        if (regions.isElevation()) {
            adopt(base, regions);
            return;
        }
        tighten(base, regions, guide);
    }
}

void ElevationMap::adopt(const ElevationBase& base, const ElevationRegions& regions)
{
    _topology = base.topology;
    _patches.resize(base.prisms.size());
    tbb::parallel_for(std::size_t{0}, _patches.size(), [&](std::size_t p) {
        Patch& patch = _patches[p];
        patch.prism = base.prisms[p];
        patch.ownTriangle = base.ownTriangle[p];
        if (patch.ownTriangle == kNone) {
            patch.reach = regions.reach(static_cast<std::uint32_t>(p));
            fillGrid(regions.overlaps()[p], patch);
            return;
        }
        const auto& corners = _source.triangles[patch.ownTriangle];
        while (corners[patch.ownCorner] != base.vertices[base.topology.patches[p][0]]) { ++patch.ownCorner; }
        patch.triangles = {patch.ownTriangle};
    });
    for (const ElevationRegions::Location& at : regions.vertices()) {
        _vertices.push_back({at.patch, at.point.barycentric.cwiseMax(0.0)});
    }
    locateSamples(regions);
}

namespace {

unsigned cellOf(unsigned resolution, double weight)
{
    return std::min(resolution - 1, static_cast<unsigned>(std::clamp(weight, 0.0, 1.0) * resolution));
}

} // namespace

void ElevationMap::fillGrid(const std::vector<ElevationRegions::Overlap>& overlaps, Patch& patch)
{
    patch.resolution = std::max(1U, static_cast<unsigned>(std::sqrt(static_cast<double>(overlaps.size()))));
    const unsigned n = patch.resolution;
    const auto forEachCell = [&](const ElevationRegions::Overlap& box, auto&& visit) {
        for (unsigned y = cellOf(n, box.low[2]); y <= cellOf(n, box.high[2]); ++y) {
            for (unsigned x = cellOf(n, box.low[1]); x <= cellOf(n, box.high[1]); ++x) { visit(y * n + x); }
        }
    };
    patch.firstInCell.assign(std::size_t{n} * n + 1, 0);
    for (const auto& box : overlaps) {
        forEachCell(box, [&](unsigned cell) { ++patch.firstInCell[cell + 1]; });
    }
    for (std::size_t i = 1; i < patch.firstInCell.size(); ++i) { patch.firstInCell[i] += patch.firstInCell[i - 1]; }
    std::vector<std::uint32_t> next(patch.firstInCell.begin(), patch.firstInCell.end() - 1);
    patch.triangles.resize(patch.firstInCell.back());
    for (const auto& box : overlaps) {
        forEachCell(box, [&](unsigned cell) { patch.triangles[next[cell]++] = box.triangle; });
    }
}

/// Every sample's ray continues that of a vertex of its triangle.
void ElevationMap::locateSamples(const ElevationRegions& regions)
{
    const std::vector<FacePoint> points = samplePoints(_source);
    std::vector<std::uint32_t> patchOfOwn(_source.triangles.size(), kNone);
    for (std::uint32_t p = 0; p < _patches.size(); ++p) {
        if (_patches[p].ownTriangle != kNone) { patchOfOwn[_patches[p].ownTriangle] = p; }
    }
    _samples.positions.resize(points.size());
    _samples.patches.resize(points.size());
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
        const FacePoint& point = points[i];
        _samples.positions[i] = positionAt(_source, point);
        _samples.patches[i] = patchOfOwn[point.face];
        for (std::size_t k = 0; k < 3 && _samples.patches[i] == kNone; ++k) {
            const std::uint32_t vertex = _source.triangles[point.face][k];
            _samples.patches[i] = regions.locate(_samples.positions[i], regions.vertices()[vertex]).patch;
        }
        if (_samples.patches[i] == kNone) { _samples.patches[i] = _vertices[_source.triangles[point.face][0]].face; }
    });
}

std::size_t ElevationMap::ownTriangles() const
{
    return static_cast<std::size_t>(
        std::count_if(_patches.begin(), _patches.end(), [](const Patch& patch) { return patch.ownTriangle != kNone; }));
}

std::vector<std::uint32_t> ElevationMap::trianglesOf(std::uint32_t patch) const
{
    std::vector<std::uint32_t> triangles = _patches[patch].triangles;
    std::sort(triangles.begin(), triangles.end());
    triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
    return triangles;
}

FacePoint ElevationMap::toSource(const FacePoint& patchPoint) const
{
    const Patch& patch = _patches[patchPoint.face];
    const Vector3d& b = patchPoint.barycentric;
    if (patch.ownTriangle != kNone) {
        FacePoint point{patch.ownTriangle, Vector3d::Zero()};
        for (Eigen::Index k = 0; k < 3; ++k) { point.barycentric[(patch.ownCorner + k) % 3] = b[k]; }
        return point;
    }
    const Vector3d start = patch.prism.pointAt(b);
    const Vector3d ray = patch.prism.rayAt(b);
    FacePoint best{patch.triangles.front(), Vector3d::Zero()};
    double inside = -std::numeric_limits<double>::infinity();
    const auto offer = [&](std::uint32_t triangle) {
        const Vector3d weights = rayWeights(_source, triangle, start, ray);
        if (weights.minCoeff() > inside) {
            const double height = (positionAt(_source, {triangle, weights}) - start).dot(ray) / ray.squaredNorm();
            if (height < patch.reach[0] - kMissed || height > patch.reach[1] + kMissed) { return; }
            inside = weights.minCoeff();
            best = {triangle, weights};
        }
    };
    const unsigned cell = cellOf(patch.resolution, b[2]) * patch.resolution + cellOf(patch.resolution, b[1]);
    std::for_each(patch.triangles.begin() + patch.firstInCell[cell],
                  patch.triangles.begin() + patch.firstInCell[cell + 1], offer);
    if (inside < -kMissed) { std::for_each(patch.triangles.begin(), patch.triangles.end(), offer); }
    best.barycentric = best.barycentric.cwiseMax(0.0);
    best.barycentric /= best.barycentric.sum();
    return best;
}

SurfacePoint ElevationMap::evaluate(std::uint32_t patch, const Vector3d& barycentric) const
{
    return surfaceAt(_source, _cornerNormals, toSource({patch, barycentric}));
}

} // namespace osgTessLOD::bake
