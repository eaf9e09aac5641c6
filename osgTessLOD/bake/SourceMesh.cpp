// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/SourceMesh.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/CatmullClark.h>
#include <osgTessLOD/bake/MaterialFiles.h>
#include <osgTessLOD/bake/MeshReader.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>
#include <new>

namespace osgTessLOD::bake {

namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Triangles = std::vector<Triangle>;

/// Corners that another step of smoothing makes faces of: what fits the memory of ordinary machines.
constexpr std::size_t kMostSmoothedCorners = 50'000'000;
constexpr std::size_t kMaxTriangles = 0xFFFFFFFFU / 3; // corners are numbered by 32 bits
constexpr double kMaxCoordinate = 1e150; // its square, and sums of a few, stay finite

RawMesh parseByExtension(const std::string& path)
{
    std::string extension = std::filesystem::path(path).extension().string();
    for (char& c : extension) { c = static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }
    using Parser = RawMesh (*)(const std::string&);
    const Parser parse = extension == ".ply" ? parsePly : extension == ".obj" ? parseObj
                         : extension == ".off" ? parseOff : extension == ".stl" ? parseStl : nullptr;
    if (!parse) {
        throw AssetError("unknown format '" + extension + "' (known: meshes .ply, .obj, .off, .stl; heights .png, .tif, .exr, .hgt)");
    }
    const std::string content = readFile(path);
    if (content.empty()) { throw AssetError("the file is empty"); }
    return parse(content);
}

void checkPositions(const std::vector<Eigen::Vector3d>& positions)
{
    for (std::size_t v = 0; v < positions.size(); ++v) {
        const double largest = positions[v].cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
        if (largest <= kMaxCoordinate) { continue; }
        throw AssetError("vertex " + std::to_string(v) + " (counted from 0) has a coordinate that is " +
                         (std::isfinite(largest) ? "larger than 1e150" : "not finite"));
    }
}

void checkElements(const std::vector<Eigen::Vector3d>& positions, const Triangles& triangles)
{
    if (positions.empty()) { throw AssetError("no vertices"); }
    if (triangles.empty()) { throw AssetError("no faces"); }
    if (triangles.size() > kMaxTriangles) { throw AssetError("more triangles than can be numbered"); }
    checkPositions(positions);
}

/// Turns the diagonal of quadrilaterals a b c d that the fan's a–c folds over and b–d does not: concave ones.
void improveQuads(RawMesh& mesh)
{
    const auto agree = [&](const Triangle& s, const Triangle& t) {
        const auto normal = [&](const Triangle& f) {
            const Eigen::Vector3d& o = mesh.positions[f[0]];
            return (mesh.positions[f[1]] - o).cross(mesh.positions[f[2]] - o).stableNormalized().eval();
        };
        return normal(s).dot(normal(t)) > 0.0;
    };
    for (const std::uint32_t first : mesh.quads) {
        Triangle& s = mesh.triangles[first];
        Triangle& t = mesh.triangles[first + 1];
        const Triangle turnedS{s[0], s[1], t[2]}, turnedT{s[1], s[2], t[2]};
        if (agree(s, t) || !agree(turnedS, turnedT)) { continue; }
        s = turnedS;
        t = turnedT;
        if (mesh.uvTriangles.empty()) { continue; }
        Triangle& uvS = mesh.uvTriangles[first];
        Triangle& uvT = mesh.uvTriangles[first + 1];
        const Triangle turnedUvT{uvS[1], uvS[2], uvT[2]};
        uvS[2] = uvT[2];
        uvT = turnedUvT;
    }
}

void checkMaterials(const SourceMesh& mesh)
{
    const std::vector<std::uint16_t>& numbers = mesh.triangleMaterials;
    if (!numbers.empty() && numbers.size() != mesh.triangles.size()) { throw AssetError("not as many materials as faces"); }
    if (std::any_of(numbers.begin(), numbers.end(), [&](std::uint16_t m) { return m >= mesh.materials.size(); })) {
        throw AssetError("a face has a material that does not exist");
    }
}

constexpr float kMaxUv = 1e6F; // beyond, single precision leaves nothing of a texture

bool isUsable(const Eigen::Vector2f& uv)
{
    return std::fabs(uv.x()) <= kMaxUv && std::fabs(uv.y()) <= kMaxUv; // NaN is not
}

/// Texture coordinates of every corner; empty where no triangle has any.
std::vector<std::array<Eigen::Vector2f, 3>> cornerUvs(const RawMesh& raw)
{
    std::vector<std::array<Eigen::Vector2f, 3>> uvs;
    if (raw.uvs.empty()) { return uvs; }
    const Eigen::Vector2f none = Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN());
    const std::vector<Triangle>& numbers = raw.uvTriangles.empty() ? raw.triangles : raw.uvTriangles;
    uvs.resize(numbers.size(), {none, none, none});
    bool any = false;
    for (std::size_t t = 0; t < numbers.size(); ++t) {
        std::array<Eigen::Vector2f, 3> corners{none, none, none};
        bool isMarked = true; // as untextured
        for (std::size_t k = 0; k < 3; ++k) {
            if (numbers[t][k] != RawMesh::kNoUv) { corners[k] = raw.uvs[numbers[t][k]]; }
            isMarked = isMarked && corners[k] == Eigen::Vector2f(-1.0F, -1.0F);
        }
        if (isMarked || !std::all_of(corners.begin(), corners.end(), isUsable)) { continue; }
        uvs[t] = corners;
        any = true;
    }
    if (!any) { uvs.clear(); }
    return uvs;
}

/// What `fill` makes of the content of a mesh file; its errors name the file.
template <typename Fill> SourceMesh importWith(const std::string& path, const Fill& fill)
{
    try {
        RawMesh raw = parseByExtension(path);
        checkElements(raw.positions, raw.triangles);
        SourceMesh mesh;
        mesh.name = path;
        fill(std::move(raw), mesh);
        return mesh;
    } catch (const AssetError& error) {
        throw AssetError(path + ": " + error.what());
    } catch (const std::bad_alloc&) {
        throw AssetError(path + ": not enough memory");
    }
}

} // namespace

SourceMesh importMesh(const std::string& path)
{
    return importWith(path, [](RawMesh raw, SourceMesh& mesh) {
        improveQuads(raw);
        mesh.uvs = cornerUvs(raw);
        addMaterials(raw, mesh.name, mesh);
        mesh.positions = std::move(raw.positions);
        mesh.triangles = std::move(raw.triangles);
        mesh.colors = std::move(raw.colors);
    });
}

SourceMesh importSmoothedMesh(const std::string& path, unsigned steps)
{
    return importWith(path, [&](const RawMesh& raw, SourceMesh& mesh) {
        addMaterials(raw, mesh.name, mesh);
        if (!mesh.triangleMaterials.empty()) {
            mesh.warnings.push_back("a mesh that is smoothed has one material: the first of " +
                                    std::to_string(mesh.materials.size()));
            mesh.materials.resize(1);
            mesh.triangleMaterials.clear();
        }
        PolygonMesh polygons = polygonsOf(raw, cornerUvs(raw));
        if (polygons.faceCount() == 0) { throw AssetError("no face has an area"); }
        for (unsigned step = 0; step < steps; ++step) {
            if (polygons.corners.size() > kMostSmoothedCorners) {
                throw AssetError("smoothed so often it has more than " + std::to_string(kMostSmoothedCorners) + " faces");
            }
            polygons = subdivideCatmullClark(polygons);
        }
        TriangulatedPolygons triangulated = triangulate(polygons);
        mesh.positions = std::move(polygons.positions);
        mesh.triangles = std::move(triangulated.triangles);
        mesh.uvs = std::move(triangulated.uvs);
    });
}

void checkMesh(const SourceMesh& mesh)
{
    try {
        checkElements(mesh.positions, mesh.triangles);
        for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
            const Triangle& t = mesh.triangles[f];
            if (std::max({t[0], t[1], t[2]}) < mesh.positions.size()) { continue; }
            throw AssetError("face " + std::to_string(f) + " (counted from 0) has a vertex that does not exist");
        }
        if (!mesh.uvs.empty() && mesh.uvs.size() != mesh.triangles.size()) {
            throw AssetError("not as many texture coordinates as faces");
        }
        if (!mesh.colors.empty() && mesh.colors.size() != mesh.positions.size()) {
            throw AssetError("not as many colours as vertices");
        }
        checkMaterials(mesh);
    } catch (const AssetError& error) {
        throw AssetError(mesh.name + ": " + error.what());
    }
}

SurfaceAttributes attributesOf(const SourceMesh& mesh)
{
    SurfaceAttributes attributes;
    attributes.uvs = !mesh.uvs.empty();
    attributes.colors = !mesh.colors.empty();
    attributes.materials = !mesh.triangleMaterials.empty();
    Eigen::AlignedBox2f box;
    for (std::size_t t = 0; t < mesh.uvs.size(); ++t) {
        if (!mesh.hasUvs(t)) { continue; }
        for (const Eigen::Vector2f& uv : mesh.uvs[t]) { box.extend(uv); }
    }
    if (!box.isEmpty()) { attributes.uvTolerance = box.sizes() / static_cast<float>(UvLattice::kUnits); }
    return attributes;
}

void normalizeFrame(SourceMesh& mesh)
{
    if (mesh.positions.empty()) { throw AssetError(mesh.name + ": no vertices"); }
    Eigen::Vector3d low = mesh.positions.front(), high = low;
    for (const Eigen::Vector3d& p : mesh.positions) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    const Eigen::Vector3d center = 0.5 * low + 0.5 * high;
    const double diagonal = (high - low).stableNorm();
    if (!(diagonal > 0.0)) { throw AssetError(mesh.name + ": all vertices lie in one point"); }
    for (Eigen::Vector3d& p : mesh.positions) { p = (p - center) / diagonal; }
    mesh.frame.center += mesh.frame.scale * center;
    mesh.frame.scale *= diagonal;
}

} // namespace osgTessLOD::bake