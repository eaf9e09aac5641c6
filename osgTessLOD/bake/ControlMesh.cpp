// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/ControlMesh.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/SourceSurface.h>
#include <osgTessLOD/bake/SurfaceCollapser.h>

#include <Eigen/Geometry>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace osgTessLOD::bake {

namespace {

/// Face numbers grow to about three times the source's and carry two more bits in the history.
constexpr std::size_t kMostTriangles = 300'000'000;

/// Leaves of the even parametrization, compared with the source's triangles: longest edge, source vertices in one.
constexpr double kLeafSide = 2.0;
constexpr unsigned kPointsPerLeaf = 2;
constexpr std::size_t kBisectionsPerPoint = 128;

std::uint32_t checkedFaceCount(const SourceMesh& source)
{
    if (source.triangles.size() > kMostTriangles) {
        throw AssetError(source.name + ": " + std::to_string(source.triangles.size()) + " triangles; at most " +
                         std::to_string(kMostTriangles) + " can be baked");
    }
    return static_cast<std::uint32_t>(source.triangles.size());
}

} // namespace

ControlMesh::ControlMesh(SourceMesh source, const ControlMeshOptions& options, Progress& progress)
    : _source(std::move(source))
    , _history(checkedFaceCount(_source))
{
    _frame = _source.frame;
    _name = _source.name;
    _attributes = attributesOf(_source);
    _materials = _source.materials;
    const std::vector<RemainingFace> faces = collapseSurface(_source, options, _history, progress);

    std::vector<std::uint32_t> baseOf(_source.positions.size(), CollapseHistory::kNone);
    std::vector<std::array<std::uint32_t, 3>> patches;
    std::uint32_t largestNumber = 0;
    for (const RemainingFace& face : faces) {
        std::array<std::uint32_t, 3> patch{};
        for (std::size_t k = 0; k < 3; ++k) {
            std::uint32_t& base = baseOf[face.vertices[k]];
            if (base == CollapseHistory::kNone) {
                base = static_cast<std::uint32_t>(_baseVertices.size());
                _baseVertices.push_back(face.vertices[k]);
            }
            patch[k] = base;
        }
        patches.push_back(patch);
        _patchFaces.push_back({face.number, face.corner});
        largestNumber = std::max(largestNumber, face.number);
    }
    _patchOfFace.assign(largestNumber + 1, CollapseHistory::kNone);
    for (std::size_t p = 0; p < _patchFaces.size(); ++p) {
        _patchOfFace[_patchFaces[p].face] = static_cast<std::uint32_t>(p);
    }
    _topology = PatchTopology::build(static_cast<std::uint32_t>(_baseVertices.size()), std::move(patches));

    _faceOfVertex.assign(_source.positions.size(), CollapseHistory::kNone);
    for (std::size_t t = 0; t < _source.triangles.size(); ++t) {
        for (const std::uint32_t v : _source.triangles[t]) { _faceOfVertex[v] = static_cast<std::uint32_t>(t); }
    }
    _cornerNormals = cornerNormals(_source, options.creaseAngleRadians);
    _stretchMap = std::make_unique<StretchMap>(_topology, bisectPatches(progress), std::vector<char>{}, progress);
}

BisectionForest::Limits ControlMesh::parametrizationLimits() const
{
    double area = 0.0;
    for (const auto& t : _source.triangles) {
        const Eigen::Vector3d& a = _source.positions[t[0]];
        area += 0.5 * (_source.positions[t[1]] - a).cross(_source.positions[t[2]] - a).norm();
    }
    // Side of the mean source triangle if it were equilateral, area = √3/4 · side².
    const double side = std::sqrt(area / static_cast<double>(_source.triangles.size()) * 4.0 / std::sqrt(3.0));
    BisectionForest::Limits limits{};
    limits.longestEdge = kLeafSide * side;
    limits.mostPoints = kPointsPerLeaf;
    limits.mostBisectionsPerPoint = kBisectionsPerPoint;
    return limits;
}

BisectionForest ControlMesh::bisectPatches(Progress& progress) const
{
    progress.begin("bisection", _source.positions.size(), "vertices");
    std::vector<FacePoint> points(_source.positions.size());
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t v) {
        points[v] = toCollapsed(sourceVertex(static_cast<std::uint32_t>(v)));
    });
    const auto surface = [&](std::uint32_t patch, const Eigen::Vector3d& barycentric) {
        progress.step(0);
        return position(fromCollapsed({patch, barycentric}));
    };
    BisectionForest forest(_topology, surface, points, parametrizationLimits());
    progress.step(points.size());
    progress.end();
    return forest;
}

FacePoint ControlMesh::toCollapsed(const FacePoint& sourcePoint) const
{
    const FacePoint coarse = _history.toCoarse(sourcePoint);
    const std::uint32_t patch = _patchOfFace[coarse.face];
    const auto corner = static_cast<Eigen::Index>(_patchFaces[patch].corner);
    FacePoint result{patch, Eigen::Vector3d::Zero()};
    for (Eigen::Index k = 0; k < 3; ++k) { result.barycentric[k] = coarse.barycentric[(corner + k) % 3]; }
    return result;
}

FacePoint ControlMesh::fromCollapsed(const FacePoint& patchPoint) const
{
    const PatchFace& at = _patchFaces[patchPoint.face];
    FacePoint coarse{at.face, Eigen::Vector3d::Zero()};
    for (Eigen::Index k = 0; k < 3; ++k) { coarse.barycentric[(at.corner + k) % 3] = patchPoint.barycentric[k]; }
    return _history.toSource(coarse);
}

FacePoint ControlMesh::toPatch(const FacePoint& sourcePoint) const
{
    return _stretchMap->toEven(toCollapsed(sourcePoint));
}

FacePoint ControlMesh::toSource(const FacePoint& patchPoint) const
{
    return fromCollapsed(_stretchMap->fromEven(patchPoint));
}

FacePoint ControlMesh::sourceVertex(std::uint32_t vertex) const
{
    const std::uint32_t face = _faceOfVertex[vertex];
    FacePoint point{face, Eigen::Vector3d::Zero()};
    for (std::size_t k = 0; k < 3; ++k) {
        if (_source.triangles[face][k] == vertex) { point.barycentric[static_cast<Eigen::Index>(k)] = 1.0; }
    }
    return point;
}

FacePoint ControlMesh::patchPointOf(std::uint32_t vertex) const
{
    return toPatch(sourceVertex(vertex));
}

Eigen::Vector3d ControlMesh::position(const FacePoint& sourcePoint) const
{
    return positionAt(_source, sourcePoint);
}

SurfacePoint ControlMesh::evaluate(std::uint32_t patch, const Eigen::Vector3d& barycentric) const
{
    return surfaceAt(_source, _cornerNormals, toSource({patch, barycentric}));
}

std::uint16_t ControlMesh::materialOf(std::uint32_t patch) const
{
    return _source.materialOf(toSource({patch, Eigen::Vector3d::Constant(1.0 / 3.0)}).face);
}

} // namespace osgTessLOD::bake
