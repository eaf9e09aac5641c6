// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/PolygonMesh.h>

#include <osgTessLOD/bake/MeshReader.h>

#include <algorithm>
#include <map>
#include <utility>

namespace osgTessLOD::bake {

namespace {

/// For each position the number of the first equal one among those that are different.
std::vector<std::uint32_t> weld(const std::vector<Eigen::Vector3d>& positions, std::vector<Eigen::Vector3d>& welded)
{
    std::map<std::array<double, 3>, std::uint32_t> known;
    std::vector<std::uint32_t> numbers;
    for (const Eigen::Vector3d& p : positions) {
        const auto number = static_cast<std::uint32_t>(welded.size());
        const auto [at, isNew] = known.try_emplace({p.x() + 0.0, p.y() + 0.0, p.z() + 0.0}, number); // −0 becomes 0
        if (isNew) { welded.push_back(p); }
        numbers.push_back(at->second);
    }
    return numbers;
}

bool hasEqualCorners(std::vector<std::uint32_t> corners)
{
    std::sort(corners.begin(), corners.end());
    return std::adjacent_find(corners.begin(), corners.end()) != corners.end();
}

} // namespace

PolygonMesh polygonsOf(const RawMesh& raw, const std::vector<std::array<Eigen::Vector2f, 3>>& uvs)
{
    PolygonMesh mesh;
    const std::vector<std::uint32_t> numbers = weld(raw.positions, mesh.positions);
    auto quad = raw.quads.begin();
    for (std::size_t t = 0; t < raw.triangles.size(); ++t) {
        const bool isQuad = quad != raw.quads.end() && *quad == t;
        std::vector<std::uint32_t> corners(raw.triangles[t].begin(), raw.triangles[t].end());
        std::vector<Eigen::Vector2f> cornerUvs;
        if (!uvs.empty()) { cornerUvs.assign(uvs[t].begin(), uvs[t].end()); }
        if (isQuad) { // a b c and a c d
            ++quad;
            ++t;
            corners.push_back(raw.triangles[t][2]);
            if (!uvs.empty()) { cornerUvs.push_back(uvs[t][2]); }
        }
        for (std::uint32_t& corner : corners) { corner = numbers[corner]; }
        if (hasEqualCorners(corners)) { continue; }
        mesh.corners.insert(mesh.corners.end(), corners.begin(), corners.end());
        mesh.uvs.insert(mesh.uvs.end(), cornerUvs.begin(), cornerUvs.end());
        mesh.starts.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
    }
    return mesh;
}

TriangulatedPolygons triangulate(const PolygonMesh& mesh)
{
    TriangulatedPolygons result;
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        result.triangles.push_back({mesh.corners[a], mesh.corners[b], mesh.corners[c]});
        if (!mesh.uvs.empty()) { result.uvs.push_back({mesh.uvs[a], mesh.uvs[b], mesh.uvs[c]}); }
    };
    for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
        const std::uint32_t first = mesh.starts[f];
        const std::uint32_t count = mesh.starts[f + 1] - first;
        const auto at = [&](std::uint32_t k) { return mesh.positions[mesh.corners[first + k]]; };
        if (count == 4 && (at(1) - at(3)).squaredNorm() < (at(0) - at(2)).squaredNorm()) {
            add(first, first + 1, first + 3);
            add(first + 1, first + 2, first + 3);
            continue;
        }
        for (std::uint32_t k = 2; k < count; ++k) { add(first, first + k - 1, first + k); }
    }
    return result;
}

} // namespace osgTessLOD::bake
