// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/SurfaceMesh.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/AtomicFile.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TessellationPattern.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

namespace osgTessLOD {

namespace {

constexpr std::uint32_t kUnset = 0xFFFFFFFFU;

std::size_t findLevel(const LodAsset& asset, unsigned factor)
{
    const auto found = std::find(asset.ladder.begin(), asset.ladder.end(), factor);
    if (found != asset.ladder.end()) { return static_cast<std::size_t>(found - asset.ladder.begin()); }
    std::string ladder;
    for (const unsigned f : asset.ladder) { ladder += (ladder.empty() ? "" : ", ") + std::to_string(f); }
    throw AssetError("factor " + std::to_string(factor) + " is not in the ladder " + ladder);
}

/// Numbers the surface's vertices: base vertices, then those inside edges, then those inside patches, each when first met.
class SurfaceBuilder {
public:
    SurfaceBuilder(const LodAsset& asset, std::size_t level)
        : _asset(asset)
        , _level(level)
        , _baseIds(asset.baseVertices.size(), kUnset)
        , _edgeIds(asset.edges.size(), kUnset)
    {
        for (std::size_t l = 0; l < asset.levels.size(); ++l) {
            _slots.push_back(asset.levelSlots(l));
            _patterns.emplace_back();
        }
    }

    SurfaceMesh build()
    {
        for (std::size_t p = 0; p < _asset.patches.size(); ++p) { addPatch(p); }
        return std::move(_mesh);
    }

private:
    std::size_t levelOf(const LodEdge& edge) const
    {
        return std::max<std::size_t>(std::min<std::size_t>(_level, edge.finestLevel), edge.coarsestLevel);
    }
    /// No coarser than its borders.
    std::size_t levelOf(const LodPatch& patch) const
    {
        std::size_t level = std::min<std::size_t>(_level, patch.finestLevel);
        for (const std::uint32_t e : patch.edges) { level = std::max(level, levelOf(_asset.edges[e])); }
        return level;
    }

    /// A pattern vertex of some level of a patch.
    struct PatternVertex {
        std::size_t level;
        std::uint32_t index;
    };

    std::size_t numberInLevel(std::size_t p, PatternVertex v) const
    {
        return _slots[v.level][p] * std::size_t{TessellationPattern::vertexCount(_asset.ladder[v.level])} + v.index;
    }
    LodVertex vertex(std::size_t p, PatternVertex v) const
    {
        return _asset.levels[v.level].vertices[numberInLevel(p, v)];
    }

    std::uint32_t addVertex(std::size_t p, PatternVertex v)
    {
        const auto local = _asset.position(_asset.patches[p], vertex(p, v));
        std::array<double, 3> position{};
        for (std::size_t k = 0; k < 3; ++k) { position[k] = _asset.lattice.origin[k] + local[k]; }
        _mesh.positions.push_back(position);
        if (_asset.hasColors()) {
            const std::uint32_t bits = _asset.levels[v.level].colors[numberInLevel(p, v)];
            const auto channel = [&](unsigned shift) { return static_cast<std::uint8_t>(bits >> shift & 0xFFU); };
            _mesh.colors.push_back({channel(0), channel(8), channel(16), channel(24)});
        }
        return static_cast<std::uint32_t>(_mesh.positions.size() - 1);
    }

    std::array<float, 2> uv(std::size_t p, PatternVertex v) const
    {
        constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
        const auto decoded = _asset.uvLattice.decode(_asset.levels[v.level].uvs[numberInLevel(p, v)]);
        return decoded[2] > 0.0F ? std::array<float, 2>{decoded[0], decoded[1]} : std::array<float, 2>{kNone, kNone};
    }

    /// Id of the edge's first inner vertex; they follow each other from its base vertex 0 to its base vertex 1.
    std::uint32_t edgeIds(std::uint32_t e)
    {
        if (_edgeIds[e] != kUnset) { return _edgeIds[e]; }
        const LodEdge& edge = _asset.edges[e];
        const std::size_t p = edge.patches[0];
        const auto& sides = _asset.patches[p].edges;
        const auto side = static_cast<std::uint32_t>(std::find(sides.begin(), sides.end(), e) - sides.begin());
        const std::size_t level = levelOf(edge);
        const unsigned factor = _asset.ladder[level];
        _edgeIds[e] = static_cast<std::uint32_t>(_mesh.positions.size());
        for (unsigned t = 1; t < factor; ++t) { addVertex(p, {level, side * factor + t}); }
        return _edgeIds[e];
    }

    std::uint32_t cornerId(std::size_t p, unsigned corner)
    {
        std::uint32_t& id = _baseIds[_asset.patches[p].baseVertices[corner]];
        if (id == kUnset) { id = addVertex(p, {0, corner}); }
        return id;
    }

    /// Where border vertex `v` of a side of patch p stands once lagged to its edge's level.
    PatternVertex lagged(std::size_t p, PatternVertex v, unsigned side) const
    {
        const LodEdge& edge = _asset.edges[_asset.patches[p].edges[side]];
        for (; v.level > levelOf(edge); --v.level) { v.index = vertex(p, v).parent(); }
        return v;
    }

    /// Id of a border vertex on a side of patch p, at the edge's level.
    std::uint32_t borderId(std::size_t p, PatternVertex v, unsigned side)
    {
        const std::uint32_t e = _asset.patches[p].edges[side];
        const LodEdge& edge = _asset.edges[e];
        const unsigned factor = _asset.ladder[v.level];
        const unsigned step = (v.index + 3 * factor - side * factor) % (3 * factor);
        if (step == 0) { return cornerId(p, side); }
        if (step == factor) { return cornerId(p, (side + 1) % 3); }
        const unsigned alongEdge = edge.patches[0] == p ? step : factor - step;
        return edgeIds(e) + alongEdge - 1;
    }

    void addPatch(std::size_t p)
    {
        const std::size_t level = levelOf(_asset.patches[p]);
        const unsigned factor = _asset.ladder[level];
        const std::uint32_t count = TessellationPattern::vertexCount(factor);
        _ids.resize(count);
        _uvs.resize(_asset.hasUvs() ? count : 0);
        for (std::uint32_t v = 0; v < count; ++v) {
            const bool onBorder = v < TessellationPattern::borderVertexCount(factor);
            const PatternVertex stands = onBorder ? lagged(p, {level, v}, v / factor) : PatternVertex{level, v};
            _ids[v] = onBorder ? borderId(p, stands, v / factor) : addVertex(p, stands);
            if (!_uvs.empty()) { _uvs[v] = uv(p, stands); }
        }
        if (!_patterns[level]) { _patterns[level].emplace(factor); }
        for (const auto& t : _patterns[level]->triangles()) {
            const std::array<std::uint32_t, 3> ids{_ids[t[0]], _ids[t[1]], _ids[t[2]]};
            if (ids[0] == ids[1] || ids[1] == ids[2] || ids[2] == ids[0]) { continue; }
            _mesh.triangles.push_back(ids);
            if (!_uvs.empty()) { _mesh.uvs.push_back({_uvs[t[0]], _uvs[t[1]], _uvs[t[2]]}); }
        }
    }

    const LodAsset& _asset;
    std::size_t _level;
    std::vector<std::uint32_t> _baseIds;
    std::vector<std::uint32_t> _edgeIds;
    std::vector<std::vector<std::uint32_t>> _slots;               ///< per level
    std::vector<std::optional<TessellationPattern>> _patterns;    ///< per level, made when needed
    std::vector<std::uint32_t> _ids;                              ///< of the present patch's pattern vertices
    std::vector<std::array<float, 2>> _uvs;                       ///< of the same, if the asset has any
    SurfaceMesh _mesh;
};

template <class Number>
void appendNumber(std::string& bytes, Number value)
{
    static_assert(sizeof(Number) == 4 || sizeof(Number) == 8);
    std::conditional_t<sizeof(Number) == 4, std::uint32_t, std::uint64_t> bits = 0;
    std::memcpy(&bits, &value, sizeof(Number));
    for (std::size_t k = 0; k < sizeof(Number); ++k) { bytes += static_cast<char>(bits >> (8 * k) & 0xFF); }
}

bool fitsFloat(const SurfaceMesh& mesh)
{
    for (const auto& position : mesh.positions) {
        for (const double x : position) {
            if (!(std::fabs(x) <= std::numeric_limits<float>::max())) { return false; }
            if (static_cast<double>(static_cast<float>(x)) != x) { return false; }
        }
    }
    return true;
}

/// Hands the bytes on in pieces, so that a large mesh is not held twice.
void flushPiece(std::ostream& stream, std::string& bytes, bool last)
{
    constexpr std::size_t kPiece = std::size_t{1} << 20;
    if (bytes.size() < kPiece && !last) { return; }
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.clear();
}

} // namespace

SurfaceMesh extractSurface(const LodAsset& asset, unsigned factor)
{
    return SurfaceBuilder(asset, findLevel(asset, factor)).build();
}

void writePly(const std::string& path, const SurfaceMesh& mesh)
{
    const bool asFloat = fitsFloat(mesh);
    const std::string type = asFloat ? "float" : "double";
    std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.positions.size());
    for (const char* axis : {"x", "y", "z"}) { bytes += "\nproperty " + type + " " + axis; }
    const auto channels = mesh.colors.empty() ? std::vector<std::string>{} : std::vector<std::string>{"red", "green", "blue", "alpha"};
    for (const std::string& channel : channels) { bytes += "\nproperty uchar " + channel; }
    bytes += "\nelement face " + std::to_string(mesh.triangles.size());
    bytes += "\nproperty list uchar uint vertex_indices";
    if (!mesh.uvs.empty()) { bytes += "\nproperty list uchar float texcoord"; }
    bytes += "\nend_header\n";

    AtomicFile file(path);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        for (const double x : mesh.positions[v]) {
            if (asFloat) {
                appendNumber(bytes, static_cast<float>(x));
            } else {
                appendNumber(bytes, x);
            }
        }
        if (!mesh.colors.empty()) { bytes.append(mesh.colors[v].begin(), mesh.colors[v].end()); }
        flushPiece(file.stream(), bytes, false);
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        bytes += '\3';
        for (const std::uint32_t v : mesh.triangles[t]) { appendNumber(bytes, v); }
        if (!mesh.uvs.empty()) {
            bytes += '\6';
            for (const auto& uv : mesh.uvs[t]) {
                for (const float x : uv) { appendNumber(bytes, x); }
            }
        }
        flushPiece(file.stream(), bytes, false);
    }
    flushPiece(file.stream(), bytes, true);
    file.commit();
}

} // namespace osgTessLOD
