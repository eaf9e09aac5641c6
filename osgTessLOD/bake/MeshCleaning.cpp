// SPDX-License-Identifier: MIT
// Cleaning works on flat arrays over corners (= half-edges): half-edge 3f + k runs from corner k of face f to corner
// k + 1 (mod 3), and "corner h" is where half-edge h starts.
//
//     weld → drop degenerate, duplicate faces → link half-edges → orient → cut → one vertex per fan
#include <osgTessLOD/bake/SourceMesh.h>

#include <osgTessLOD/asset/AssetError.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>

namespace osgTessLOD::bake {

namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Triangles = std::vector<Triangle>;

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

// --------------------------------------------------------------------------------------------- weld, drop faces ---

/// The first of each class of equal items among 0 … count − 1, by a flat open-addressing hash table.
template <typename Hash, typename Equal>
std::vector<std::uint32_t> firstOfEqual(std::size_t count, Hash hash, Equal equal)
{
    std::size_t capacity = 16;
    while (capacity < count + count / 2) { capacity *= 2; }
    std::vector<std::uint32_t> table(capacity, kNone), first(count);
    for (std::uint32_t i = 0; i < count; ++i) {
        std::size_t slot = hash(i) & (capacity - 1);
        while (table[slot] != kNone && !equal(table[slot], i)) { slot = (slot + 1) & (capacity - 1); }
        if (table[slot] == kNone) { table[slot] = i; }
        first[i] = table[slot];
    }
    return first;
}

std::uint64_t mix(std::uint64_t h, std::uint64_t value) // splitmix64's finalizer
{
    h = (h ^ value) + 0x9E3779B97F4A7C15U;
    h = (h ^ (h >> 30)) * 0xBF58476D1CE4E5B9U;
    h = (h ^ (h >> 27)) * 0x94D049BB133111EBU;
    return h ^ (h >> 31);
}

/// Of the `count` classes, by the class of every colour.
std::vector<Rgba> meanColors(const std::vector<Rgba>& colors, const std::vector<std::uint32_t>& classes, std::uint32_t count)
{
    std::vector<std::array<std::uint32_t, 4>> sums(count);
    std::vector<std::uint32_t> members(count, 0);
    for (std::size_t i = 0; i < colors.size(); ++i) {
        for (std::size_t k = 0; k < 4; ++k) { sums[classes[i]][k] += colors[i][k]; }
        ++members[classes[i]];
    }
    std::vector<Rgba> means(count);
    for (std::uint32_t c = 0; c < count; ++c) {
        for (std::size_t k = 0; k < 4; ++k) {
            means[c][k] = static_cast<std::uint8_t>((sums[c][k] + members[c] / 2) / members[c]);
        }
    }
    return means;
}

std::uint64_t weldVertices(SourceMesh& mesh)
{
    const auto hash = [&](std::uint32_t v) {
        std::uint64_t h = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double coordinate = mesh.positions[v][axis] + 0.0; // −0 becomes 0, which it equals
            std::uint64_t bits = 0;
            std::memcpy(&bits, &coordinate, sizeof bits);
            h = mix(h, bits);
        }
        return h;
    };
    const auto equal = [&](std::uint32_t a, std::uint32_t b) { return mesh.positions[a] == mesh.positions[b]; };
    std::vector<std::uint32_t> index = firstOfEqual(mesh.positions.size(), hash, equal);
    std::uint32_t kept = 0;
    for (std::uint32_t v = 0; v < index.size(); ++v) { // index[v] ≤ v: its new number is known by now
        const bool isFirst = index[v] == v;
        if (isFirst) { mesh.positions[kept] = mesh.positions[v]; }
        index[v] = isFirst ? kept++ : index[index[v]];
    }
    const std::uint64_t welded = mesh.positions.size() - kept;
    mesh.positions.resize(kept);
    if (!mesh.colors.empty()) { mesh.colors = meanColors(mesh.colors, index, kept); }
    for (Triangle& triangle : mesh.triangles) {
        for (std::uint32_t& v : triangle) { v = index[v]; }
    }
    return welded;
}

double boxDiagonal(const std::vector<Eigen::Vector3d>& positions, const Triangles& triangles)
{
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Eigen::Vector3d low = Eigen::Vector3d::Constant(kInfinity), high = -low;
    for (const Triangle& triangle : triangles) {
        for (const std::uint32_t v : triangle) {
            low = low.cwiseMin(positions[v]);
            high = high.cwiseMax(positions[v]);
        }
    }
    return triangles.empty() ? 0.0 : (high - low).stableNorm();
}

/// Drops the faces, with what belongs to their corners, for which `isDropped(number)`. Returns how many.
template <typename IsDropped> std::uint64_t dropFaces(SourceMesh& mesh, IsDropped isDropped)
{
    std::size_t kept = 0;
    for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
        if (isDropped(f)) { continue; }
        mesh.triangles[kept] = mesh.triangles[f];
        if (!mesh.uvs.empty()) { mesh.uvs[kept] = mesh.uvs[f]; }
        if (!mesh.triangleMaterials.empty()) { mesh.triangleMaterials[kept] = mesh.triangleMaterials[f]; }
        ++kept;
    }
    const std::uint64_t dropped = mesh.triangles.size() - kept;
    mesh.triangles.resize(kept);
    if (!mesh.uvs.empty()) { mesh.uvs.resize(kept); }
    if (!mesh.triangleMaterials.empty()) { mesh.triangleMaterials.resize(kept); }
    return dropped;
}

/// Faces with two equal corners, or whose doubled area is below 1e-30 of the box's diagonal squared. Doubles resolve
/// 1e-16 of the diagonal, so that the smallest triangle they can tell from a line is about 1e-32: what this drops has no
/// area beyond rounding at the mesh's size, and no real sliver is lost.
std::uint64_t dropDegenerateFaces(SourceMesh& mesh)
{
    const double diagonal = boxDiagonal(mesh.positions, mesh.triangles);
    return dropFaces(mesh, [&](std::uint32_t f) {
        const Triangle& t = mesh.triangles[f];
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) { return true; }
        const Eigen::Vector3d& o = mesh.positions[t[0]];
        const Eigen::Vector3d a = (mesh.positions[t[1]] - o) / diagonal, b = (mesh.positions[t[2]] - o) / diagonal;
        return !(a.cross(b).stableNorm() > 1e-30);
    });
}

std::uint64_t dropDuplicateFaces(SourceMesh& mesh)
{
    const auto sorted = [&](std::uint32_t f) {
        Triangle t = mesh.triangles[f];
        std::sort(t.begin(), t.end());
        return t;
    };
    const auto hash = [&](std::uint32_t f) {
        const Triangle t = sorted(f);
        return mix(mix(t[0], t[1]), t[2]);
    };
    const auto equal = [&](std::uint32_t a, std::uint32_t b) { return sorted(a) == sorted(b); };
    const std::vector<std::uint32_t> first = firstOfEqual(mesh.triangles.size(), hash, equal);
    return dropFaces(mesh, [&](std::uint32_t f) { return first[f] != f; });
}

// ------------------------------------------------------------------------------------------- half-edges, orient ---

std::uint32_t nextCorner(std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
std::uint32_t previousCorner(std::uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }
std::uint32_t startOf(const Triangles& triangles, std::uint32_t h) { return triangles[h / 3][h % 3]; }
std::uint32_t endOf(const Triangles& triangles, std::uint32_t h) { return startOf(triangles, nextCorner(h)); }

struct Links {
    std::vector<std::uint32_t> mate;     ///< per half-edge the other one of a two-sided edge, else kNone
    std::uint64_t crowdedEdges = 0;      ///< with more than two half-edges, which are left without a mate
};

/// Pairs the half-edges of every edge that has exactly two, whatever their directions. Half-edges are bucketed by their
/// smaller vertex (counting sort), then sorted by the larger one within each small bucket.
Links linkHalfEdges(const Triangles& triangles, std::size_t vertexCount)
{
    const auto count = static_cast<std::uint32_t>(3 * triangles.size());
    const auto low = [&](std::uint32_t h) { return std::min(startOf(triangles, h), endOf(triangles, h)); };
    const auto high = [&](std::uint32_t h) { return std::max(startOf(triangles, h), endOf(triangles, h)); };
    std::vector<std::uint32_t> bucketEnd(vertexCount + 1, 0), order(count);
    for (std::uint32_t h = 0; h < count; ++h) { ++bucketEnd[low(h) + 1]; }
    for (std::size_t v = 0; v < vertexCount; ++v) { bucketEnd[v + 1] += bucketEnd[v]; }
    for (std::uint32_t h = 0; h < count; ++h) { order[bucketEnd[low(h)]++] = h; } // starts become ends

    Links links;
    links.mate.assign(count, kNone);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> bucket; // larger vertex, half-edge
    for (std::size_t v = 0; v < vertexCount; ++v) {
        bucket.clear();
        for (std::uint32_t i = v == 0 ? 0 : bucketEnd[v - 1]; i < bucketEnd[v]; ++i) {
            bucket.emplace_back(high(order[i]), order[i]);
        }
        std::sort(bucket.begin(), bucket.end());
        for (std::size_t i = 0; i < bucket.size();) {
            std::size_t end = i + 1;
            while (end < bucket.size() && bucket[end].first == bucket[i].first) { ++end; }
            if (end - i == 2) {
                links.mate[bucket[i].second] = bucket[i + 1].second;
                links.mate[bucket[i + 1].second] = bucket[i].second;
            }
            links.crowdedEdges += end - i > 2 ? 1 : 0;
            i = end;
        }
    }
    return links;
}

/// Which faces to turn so that each component agrees with itself as far as it can, and with most of its faces as they
/// came. Breadth first over the links; edges that close a loop the wrong way round are left for cutConflicts().
std::vector<std::uint8_t> chooseFlips(const Triangles& triangles, const Links& links, std::uint64_t& components)
{
    constexpr std::uint8_t kUnseen = 2;
    std::vector<std::uint8_t> flip(triangles.size(), kUnseen);
    std::vector<std::uint32_t> queue;
    for (std::uint32_t seed = 0; seed < triangles.size(); ++seed) {
        if (flip[seed] != kUnseen) { continue; }
        ++components;
        queue.assign(1, seed);
        flip[seed] = 0;
        std::size_t turned = 0;
        for (std::size_t i = 0; i < queue.size(); ++i) {
            for (std::uint32_t h = 3 * queue[i]; h < 3 * queue[i] + 3; ++h) {
                const std::uint32_t g = links.mate[h];
                if (g == kNone || flip[g / 3] != kUnseen) { continue; }
                const bool sameDirection = startOf(triangles, h) == startOf(triangles, g);
                flip[g / 3] = static_cast<std::uint8_t>(flip[h / 3] ^ (sameDirection ? 1 : 0));
                turned += flip[g / 3];
                queue.push_back(g / 3);
            }
        }
        if (2 * turned > queue.size()) {
            for (const std::uint32_t f : queue) { flip[f] ^= 1; }
        }
    }
    return flip;
}

/// Turns faces by exchanging corners 1 and 2, which exchanges half-edges 0 and 2, in `links` too.
std::uint64_t applyFlips(SourceMesh& mesh, Links& links, const std::vector<std::uint8_t>& flip)
{
    Triangles& triangles = mesh.triangles;
    const auto renumbered = [&](std::uint32_t h) { return flip[h / 3] ? 3 * (h / 3) + 2 - h % 3 : h; };
    std::uint64_t turned = 0;
    for (std::size_t f = 0; f < triangles.size(); ++f) {
        if (!flip[f]) { continue; }
        std::swap(triangles[f][1], triangles[f][2]);
        if (!mesh.uvs.empty()) { std::swap(mesh.uvs[f][1], mesh.uvs[f][2]); }
        std::swap(links.mate[3 * f], links.mate[3 * f + 2]);
        ++turned;
    }
    if (turned == 0) { return 0; }
    for (std::uint32_t& mate : links.mate) { mate = mate == kNone ? kNone : renumbered(mate); }
    return turned;
}

/// Parts the mates that still run the same way. Returns how many edges.
std::uint64_t cutConflicts(const Triangles& triangles, Links& links)
{
    std::uint64_t cut = 0;
    for (std::uint32_t h = 0; h < links.mate.size(); ++h) {
        const std::uint32_t g = links.mate[h];
        if (g == kNone || startOf(triangles, h) != startOf(triangles, g)) { continue; }
        links.mate[h] = links.mate[g] = kNone;
        ++cut;
    }
    return cut;
}

// --------------------------------------------------------------------------------------------------------- fans ---

/// Calls visit(corner) for every corner of the fan that `start` belongs to:
///
///          mate(previous(h)) ◄── h ──► next(mate(h))        around the vertex that all of them start at
template <typename Visit>
void visitFan(const Links& links, std::uint32_t start, Visit visit)
{
    std::uint32_t h = start;
    do {
        visit(h);
        h = links.mate[previousCorner(h)];
    } while (h != kNone && h != start);
    if (h == start) { return; }
    for (std::uint32_t g = links.mate[start]; g != kNone; g = links.mate[h]) {
        h = nextCorner(g);
        visit(h);
    }
}

/// Gives every fan but a vertex's first a copy of the vertex. Returns the number of vertices that had several.
///
/// Afterwards every directed edge occurs once: two half-edges u → v in faces of one fan around u would both be its ends,
/// but one end of an oriented fan leaves u and the other arrives there. For the same reason the two sides of a cut edge
/// that share both their fans join again, which is right: they are then the edge's only faces.
std::uint64_t splitFans(SourceMesh& mesh, const Links& links)
{
    const std::size_t originalCount = mesh.positions.size();
    std::vector<std::uint8_t> fans(originalCount, 0); // 0, 1, or 2 for several
    std::vector<bool> seen(links.mate.size(), false);
    std::uint64_t split = 0;
    for (std::uint32_t corner = 0; corner < links.mate.size(); ++corner) {
        if (seen[corner]) { continue; }
        std::uint32_t vertex = startOf(mesh.triangles, corner);
        const bool isFirst = fans[vertex] == 0;
        split += fans[vertex] == 1 ? 1 : 0;
        fans[vertex] = isFirst ? 1 : 2;
        if (!isFirst) {
            mesh.positions.push_back(Eigen::Vector3d(mesh.positions[vertex]));
            if (!mesh.colors.empty()) { mesh.colors.push_back(Rgba(mesh.colors[vertex])); }
            vertex = static_cast<std::uint32_t>(mesh.positions.size() - 1);
        }
        visitFan(links, corner, [&](std::uint32_t h) {
            seen[h] = true;
            mesh.triangles[h / 3][h % 3] = vertex;
        });
    }
    return split;
}

/// Removes vertices that no face uses. Returns how many.
std::uint64_t dropVertices(SourceMesh& mesh)
{
    std::vector<std::uint32_t> newIndex(mesh.positions.size(), kNone);
    for (const Triangle& triangle : mesh.triangles) {
        for (const std::uint32_t v : triangle) { newIndex[v] = 0; }
    }
    std::uint32_t kept = 0;
    for (std::size_t v = 0; v < newIndex.size(); ++v) {
        if (newIndex[v] == kNone) { continue; }
        mesh.positions[kept] = mesh.positions[v];
        if (!mesh.colors.empty()) { mesh.colors[kept] = mesh.colors[v]; }
        newIndex[v] = kept++;
    }
    const std::uint64_t dropped = mesh.positions.size() - kept;
    mesh.positions.resize(kept);
    if (!mesh.colors.empty()) { mesh.colors.resize(kept); }
    for (Triangle& triangle : mesh.triangles) {
        for (std::uint32_t& v : triangle) { v = newIndex[v]; }
    }
    return dropped;
}

/// Edges with one face. Only half-edges without a mate can be that; the two sides of a cut that joined again are not.
std::uint64_t countBoundaryEdges(const Triangles& triangles, const Links& links)
{
    std::vector<std::uint64_t> edges;
    for (std::uint32_t h = 0; h < links.mate.size(); ++h) {
        if (links.mate[h] != kNone) { continue; }
        const std::uint64_t a = startOf(triangles, h), b = endOf(triangles, h);
        edges.push_back(std::min(a, b) << 32 | std::max(a, b));
    }
    std::sort(edges.begin(), edges.end());
    std::uint64_t boundary = 0;
    for (std::size_t i = 0; i < edges.size();) {
        const std::size_t sides = i + 1 < edges.size() && edges[i + 1] == edges[i] ? 2 : 1;
        boundary += sides == 1 ? 1 : 0;
        i += sides;
    }
    return boundary;
}

} // namespace

CleaningReport cleanMesh(SourceMesh& mesh)
{
    CleaningReport report;
    report.weldedVertices = weldVertices(mesh);
    report.degenerateFaces = dropDegenerateFaces(mesh);
    report.duplicateFaces = dropDuplicateFaces(mesh);
    report.unreferencedVertices = dropVertices(mesh);
    if (mesh.triangles.empty()) { throw AssetError(mesh.name + ": no face has an area"); }

    Links links = linkHalfEdges(mesh.triangles, mesh.positions.size());
    const std::vector<std::uint8_t> flip = chooseFlips(mesh.triangles, links, report.components);
    report.flippedFaces = applyFlips(mesh, links, flip);
    report.nonManifoldEdges = links.crowdedEdges + cutConflicts(mesh.triangles, links);
    report.nonManifoldVertices = splitFans(mesh, links);
    report.boundaryEdges = countBoundaryEdges(mesh.triangles, links);
    for (std::size_t t = 0; t < mesh.uvs.size(); ++t) { report.facesWithoutUvs += mesh.hasUvs(t) ? 0 : 1; }
    assert(isOrientedManifold(mesh));
    return report;
}

std::vector<std::string> repairsOf(const CleaningReport& report)
{
    std::vector<std::string> repairs;
    const auto add = [&](std::uint64_t count, const char* one, const char* several, const char* done) {
        if (count > 0) { repairs.push_back(std::to_string(count) + " " + (count == 1 ? one : several) + " " + done); }
    };
    add(report.degenerateFaces, "face without an area", "faces without an area", "dropped");
    add(report.duplicateFaces, "duplicate face", "duplicate faces", "dropped");
    add(report.flippedFaces, "face", "faces", "turned to agree with the others");
    add(report.nonManifoldEdges, "non-manifold edge", "non-manifold edges", "cut open");
    add(report.nonManifoldVertices, "non-manifold vertex", "non-manifold vertices", "split");
    add(report.facesWithoutUvs, "face", "faces", "without texture coordinates, unlike the others");
    return repairs;
}

bool isOrientedManifold(const SourceMesh& mesh)
{
    for (const Triangle& t : mesh.triangles) {
        if (std::max({t[0], t[1], t[2]}) >= mesh.positions.size()) { return false; }
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) { return false; }
    }
    Links links = linkHalfEdges(mesh.triangles, mesh.positions.size());
    if (links.crowdedEdges != 0 || cutConflicts(mesh.triangles, links) != 0) { return false; }
    std::vector<bool> hasFan(mesh.positions.size(), false), seen(links.mate.size(), false);
    for (std::uint32_t corner = 0; corner < links.mate.size(); ++corner) {
        if (seen[corner]) { continue; }
        const std::uint32_t vertex = startOf(mesh.triangles, corner);
        if (hasFan[vertex]) { return false; }
        hasFan[vertex] = true;
        visitFan(links, corner, [&](std::uint32_t h) { seen[h] = true; });
    }
    return true;
}

} // namespace osgTessLOD::bake
