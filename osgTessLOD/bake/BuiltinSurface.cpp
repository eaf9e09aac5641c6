// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/BuiltinSurface.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/BuiltinShape.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;

constexpr unsigned kFinestFactor = 128;            ///< pattern factor of a patch of 24,576 triangles
constexpr double kTrianglesPerPatch = 1.5 * kFinestFactor * kFinestFactor;
constexpr std::uint64_t kMostTriangles = 4'000'000'000U;

/// How the corners of a control mesh's patches are interpolated into the shape's domain.
enum class Domain {
    Sheet,    ///< corners are points of the sheet
    Sphere,   ///< corners are unit vectors; interpolated points are normalized
    Parallels ///< corners are (way from pole to pole 0 … 1, turn, 1, or 0 for a pole, whose turn is any)
};

struct ControlMesh {
    Domain domain = Domain::Sheet;
    std::uint32_t vertexCount = 0;
    std::vector<std::array<std::uint32_t, 3>> patches;
    std::vector<std::array<Vector3d, 3>> corners;  ///< in the domain; per patch, for turns that pass 1

    void add(const std::array<std::uint32_t, 3>& vertices, const Vector3d& a, const Vector3d& b, const Vector3d& c)
    {
        patches.push_back(vertices);
        corners.push_back({a, b, c});
    }
};

ControlMesh icosahedron()
{
    const double g = 0.5 * (1.0 + std::sqrt(5.0));
    std::array<Vector3d, 12> v{Vector3d(-1, g, 0), Vector3d(1, g, 0), Vector3d(-1, -g, 0), Vector3d(1, -g, 0),
                               Vector3d(0, -1, g), Vector3d(0, 1, g), Vector3d(0, -1, -g), Vector3d(0, 1, -g),
                               Vector3d(g, 0, -1), Vector3d(g, 0, 1), Vector3d(-g, 0, -1), Vector3d(-g, 0, 1)};
    for (Vector3d& p : v) { p.normalize(); }
    constexpr std::array<std::array<std::uint32_t, 3>, 20> kFaces{{
        {0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
        {3, 9, 4}, {3, 4, 2}, {3, 2, 6}, {3, 6, 8}, {3, 8, 9}, {4, 9, 5}, {2, 4, 11}, {6, 2, 10}, {8, 6, 7}, {9, 8, 1}}};
    ControlMesh mesh;
    mesh.domain = Domain::Sphere;
    mesh.vertexCount = 12;
    for (const auto& f : kFaces) { mesh.add(f, v[f[0]], v[f[1]], v[f[2]]); }
    return mesh;
}

/// The sheet: 4 × 4 quadrilaterals of size 1, each cut in two, with alternating diagonals.
ControlMesh sheet()
{
    constexpr std::uint32_t kCells = 4, kPoints = kCells + 1;
    ControlMesh mesh;
    mesh.vertexCount = kPoints * kPoints;
    const auto at = [](std::uint32_t v) { return Vector3d(v % kPoints, v / kPoints, 0.0); };
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) { mesh.add({a, b, c}, at(a), at(b), at(c)); };
    for (std::uint32_t j = 0; j < kCells; ++j) {
        for (std::uint32_t i = 0; i < kCells; ++i) {
            const std::uint32_t a = j * kPoints + i, b = a + 1, c = b + kPoints, d = a + kPoints;
            if ((i + j) % 2 == 0) {
                add(a, b, c);
                add(a, c, d);
            } else {
                add(a, b, d);
                add(b, c, d);
            }
        }
    }
    return mesh;
}

/// Two poles and ten parallels of three vertices: 3 + 9 · 6 + 3 patches. The seashell coils along its meridians.
ControlMesh coil()
{
    constexpr std::uint32_t kSectors = 3, kParallels = 10, kNorth = kSectors * kParallels, kSouth = kNorth + 1;
    ControlMesh mesh;
    mesh.domain = Domain::Parallels;
    mesh.vertexCount = kSouth + 1;
    const auto index = [](std::uint32_t ring, std::uint32_t sector) { return ring * kSectors + sector % kSectors; };
    const auto at = [](std::uint32_t ring, std::uint32_t sector) {
        const double twist = 0.5 * ring; // half a sector per ring keeps the patches from needling
        return Vector3d((ring + 1.0) / (kParallels + 1.0), (sector + twist) / kSectors, 1.0);
    };
    const Vector3d north(0.0, 0.0, 0.0), south(1.0, 0.0, 0.0);
    for (std::uint32_t s = 0; s < kSectors; ++s) {
        mesh.add({kNorth, index(0, s), index(0, s + 1)}, north, at(0, s), at(0, s + 1));
        for (std::uint32_t r = 0; r + 1 < kParallels; ++r) {
            mesh.add({index(r, s), index(r + 1, s), index(r, s + 1)}, at(r, s), at(r + 1, s), at(r, s + 1));
            mesh.add({index(r, s + 1), index(r + 1, s), index(r + 1, s + 1)}, at(r, s + 1), at(r + 1, s), at(r + 1, s + 1));
        }
        mesh.add({kSouth, index(kParallels - 1, s + 1), index(kParallels - 1, s)}, south, at(kParallels - 1, s + 1),
                 at(kParallels - 1, s));
    }
    return mesh;
}

/// Point of the domain at `weights` of a patch's corners.
Vector3d domainPoint(Domain domain, const std::array<Vector3d, 3>& c, const Vector3d& weights)
{
    Vector3d p = weights[0] * c[0] + weights[1] * c[1] + weights[2] * c[2];
    if (domain == Domain::Sheet) { return p; }
    if (domain == Domain::Sphere) { return p.normalized(); }
    double turn = 0.0, sum = 0.0;
    for (int i = 0; i < 3; ++i) {
        const double w = weights[i] * c[static_cast<std::size_t>(i)][2];
        turn += w * c[static_cast<std::size_t>(i)][1];
        sum += w;
    }
    turn = sum > 0.0 ? turn / sum : 0.0;
    constexpr double kPi = 3.14159265358979323846;
    const double longitude = 2.0 * kPi * (turn - std::floor(turn)), latitude = kPi * p[0];
    return Vector3d(std::sin(latitude) * std::cos(longitude), std::sin(latitude) * std::sin(longitude), std::cos(latitude));
}

/// Two unit vectors that span the domain's tangent plane, with first × second outward.
std::array<Vector3d, 2> tangents(Domain domain, const Vector3d& point)
{
    if (domain == Domain::Sheet) { return {Vector3d::UnitX(), Vector3d::UnitY()}; }
    Eigen::Index axis = 0;
    point.cwiseAbs().minCoeff(&axis);
    const Vector3d first = point.cross(Vector3d::Unit(axis)).normalized();
    return {first, point.cross(first)};
}

/// Splits every triangle of a mesh into s², keeping per new triangle its origin and its corners' places there.
struct RefinedPatch {
    std::uint32_t base;
    std::array<std::array<std::uint16_t, 2>, 3> corners; ///< weights of base corners 1 and 2, times s
};

/// Numbers the points of the refined mesh: base vertices, then points inside edges, then points inside patches.
class RefinedVertices {
public:
    RefinedVertices(const PatchTopology& base, std::uint32_t splits) : _base(base), _splits(splits) {}

    std::uint32_t count() const
    {
        return static_cast<std::uint32_t>(insidePatch(static_cast<std::uint32_t>(_base.patches.size())));
    }

    /// The point of base patch `p` with weights (splits − i − j, i, j).
    std::uint32_t index(std::uint32_t p, std::uint32_t i, std::uint32_t j) const
    {
        const std::uint32_t k = _splits - i - j;
        if (i == _splits) { return _base.patches[p][1]; }
        if (j == _splits) { return _base.patches[p][2]; }
        if (k == _splits) { return _base.patches[p][0]; }
        if (j == 0) { return onEdge(p, 0, i); }
        if (k == 0) { return onEdge(p, 1, j); }
        if (i == 0) { return onEdge(p, 2, k); }
        // Row j = 1 … has splits − 1 − j points.
        const std::uint32_t before = (j - 1) * (_splits - 1) - j * (j - 1) / 2;
        return insidePatch(p) + before + i - 1;
    }

private:
    std::uint32_t onEdge(std::uint32_t p, std::uint32_t side, std::uint32_t step) const
    {
        const std::uint32_t e = _base.patchEdges[p][side];
        const auto& edge = _base.edges[e];
        const bool along = edge.patches[0] == p && edge.sides[0] == side;
        return _base.vertexCount + e * (_splits - 1) + (along ? step : _splits - step) - 1;
    }
    std::uint32_t insidePatch(std::uint32_t p) const
    {
        const auto edges = static_cast<std::uint32_t>(_base.edges.size());
        return _base.vertexCount + edges * (_splits - 1) + p * ((_splits - 1) * (_splits - 2) / 2);
    }

    const PatchTopology& _base;
    std::uint32_t _splits;
};

class BuiltinSurface final : public PatchMap {
public:
    BuiltinSurface(std::string name, ControlMesh control, std::uint32_t splits, unsigned factor,
                   std::unique_ptr<BuiltinShape> shape)
        : _control(std::move(control)), _splits(splits), _factor(factor), _shape(std::move(shape))
    {
        _name = std::move(name);
        refine();
        fitFrame();
    }

    std::uint64_t sourceTriangles() const override { return _patches.size() * (3 * std::uint64_t{_factor} * _factor / 2); }
    unsigned referenceFactor() const override { return _factor; }

    SurfacePoint evaluate(std::uint32_t patch, const Vector3d& barycentric) const override
    {
        const Vector3d point = domainPointOf(patch, barycentric);
        return {(_shape->position(point) - _frame.center) / _frame.scale, normalAt(point)};
    }

private:
    Vector3d domainPointOf(std::uint32_t patch, const Vector3d& barycentric) const
    {
        const RefinedPatch& refined = _patches[patch];
        Vector3d weights = Vector3d::Zero();
        for (std::size_t c = 0; c < 3; ++c) {
            const double w = barycentric[static_cast<Eigen::Index>(c)];
            const std::uint32_t i = refined.corners[c][0], j = refined.corners[c][1];
            weights += w * Vector3d(_splits - i - j, i, j);
        }
        return domainPoint(_control.domain, _control.corners[refined.base], weights / _splits);
    }

    /// By central differences in the domain, which does not know the patches: the same on both sides of a border.
    Vector3d normalAt(const Vector3d& point) const
    {
        const auto at = [&](const Vector3d& p) {
            return _shape->position(_control.domain == Domain::Sheet ? p : p.normalized());
        };
        const std::array<Vector3d, 2> t = tangents(_control.domain, point);
        // A thousandth of the reference's sampling distance or so; wider where the surface is pinched to nothing.
        for (double step = 1e-5 / _splits; step < 1e-1; step *= 10.0) {
            const Vector3d a = at(point + step * t[0]) - at(point - step * t[0]);
            const Vector3d b = at(point + step * t[1]) - at(point - step * t[1]);
            const Vector3d normal = a.cross(b);
            const double length = normal.norm();
            if (length > 1e-9 * a.norm() * b.norm() && length > 0.0) { return normal / length; }
        }
        return _control.domain == Domain::Sheet ? Vector3d::UnitZ().eval() : point;
    }

    void refine()
    {
        const PatchTopology base = PatchTopology::build(_control.vertexCount, _control.patches);
        const RefinedVertices vertices(base, _splits);
        std::vector<std::array<std::uint32_t, 3>> patches;
        const auto add = [&](std::uint32_t p, const std::array<std::array<std::uint32_t, 2>, 3>& places) {
            RefinedPatch refined{p, {}};
            std::array<std::uint32_t, 3> corners{};
            for (std::size_t c = 0; c < 3; ++c) {
                corners[c] = vertices.index(p, places[c][0], places[c][1]);
                refined.corners[c] = {static_cast<std::uint16_t>(places[c][0]), static_cast<std::uint16_t>(places[c][1])};
            }
            patches.push_back(corners);
            _patches.push_back(refined);
        };
        for (std::uint32_t p = 0; p < base.patches.size(); ++p) {
            for (std::uint32_t j = 0; j < _splits; ++j) {
                for (std::uint32_t i = 0; i + j < _splits; ++i) {
                    add(p, {{{i, j}, {i + 1, j}, {i, j + 1}}});
                    if (i + j + 1 < _splits) { add(p, {{{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}}); }
                }
            }
        }
        _topology = PatchTopology::build(vertices.count(), std::move(patches));
    }

    /// The bounding box as a regular sampling of the unsplit patches sees it.
    void fitFrame()
    {
        constexpr int kSteps = 128;
        Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
        for (const auto& corners : _control.corners) {
            for (int j = 0; j <= kSteps; ++j) {
                for (int i = 0; i + j <= kSteps; ++i) {
                    const Vector3d weights = Vector3d(kSteps - i - j, i, j) / kSteps;
                    const Vector3d p = _shape->position(domainPoint(_control.domain, corners, weights));
                    low = low.cwiseMin(p);
                    high = high.cwiseMax(p);
                }
            }
        }
        _frame.center = 0.5 * (low + high);
        _frame.scale = (high - low).norm();
    }

    ControlMesh _control;
    std::uint32_t _splits;
    unsigned _factor;
    std::unique_ptr<BuiltinShape> _shape;
    std::vector<RefinedPatch> _patches;
};

/// One of the built-ins, before it is split.
struct Recipe {
    const char* name;
    ControlMesh (*control)();
    std::unique_ptr<BuiltinShape> (*shape)(unsigned extraOctaves);
};

constexpr std::array<Recipe, 4> kRecipes{{{"asteroid", icosahedron, makeAsteroidShape},
                                          {"bricks", sheet, makeBricksShape},
                                          {"seashell", coil, makeSeashellShape},
                                          {"glacier", sheet, makeGlacierShape}}};

/// Smallest s for which s² parts of each patch need not more than 24,576 triangles each, up to 1 %.
std::uint32_t splitsFor(std::uint64_t triangles, std::size_t basePatches)
{
    const double perPatch = static_cast<double>(triangles) / static_cast<double>(basePatches);
    std::uint32_t splits = 1;
    while (perPatch > 1.01 * kTrianglesPerPatch * splits * splits) { ++splits; }
    return splits;
}

/// The even pattern factor whose 1.5 factor² triangles come nearest to `perPatch`.
unsigned factorFor(double perPatch)
{
    const auto miss = [&](unsigned factor) { return std::abs(1.5 * factor * factor - perPatch); };
    unsigned best = 2;
    for (unsigned factor = 4; factor <= kFinestFactor; factor += 2) {
        if (miss(factor) < miss(best)) { best = factor; }
    }
    return best;
}

} // namespace

const std::vector<std::string>& builtinSurfaceNames()
{
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const Recipe& recipe : kRecipes) { all.emplace_back(recipe.name); }
        return all;
    }();
    return names;
}

std::unique_ptr<PatchMap> makeBuiltinSurface(const std::string& name, std::uint64_t triangles)
{
    const auto recipe = std::find_if(kRecipes.begin(), kRecipes.end(), [&](const Recipe& r) { return name == r.name; });
    if (recipe == kRecipes.end()) {
        std::string known;
        for (const std::string& n : builtinSurfaceNames()) { known += (known.empty() ? "" : ", ") + n; }
        throw AssetError("unknown built-in surface '" + name + "' (known: " + known + ")");
    }
    if (triangles > kMostTriangles) { throw AssetError("built-in surfaces have at most 4,000,000,000 triangles"); }
    ControlMesh control = recipe->control();
    const std::uint32_t splits = splitsFor(triangles, control.patches.size());
    const double patches = static_cast<double>(control.patches.size()) * splits * splits;
    const unsigned factor = triangles == 0 ? kFinestFactor : factorFor(static_cast<double>(triangles) / patches);
    const auto extraOctaves = static_cast<unsigned>(std::lround(std::log2(splits)));
    return std::make_unique<BuiltinSurface>(name, std::move(control), splits, factor, recipe->shape(extraOctaves));
}

} // namespace osgTessLOD::bake
