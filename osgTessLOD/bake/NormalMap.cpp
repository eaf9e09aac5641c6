// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/NormalMap.h>

#include <osgTessLOD/asset/AssetError.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3f;

constexpr std::uint32_t kSamples = 4; ///< along a texel's side
/// Texture coordinates as integers, so that on which side of an edge a point lies has no rounding.
constexpr std::int64_t kUnits = std::int64_t{1} << 24;
/// Beyond it they would have no place among these.
constexpr float kMostRepeats = 64.0F;

struct Point {
    std::int64_t x;
    std::int64_t y; ///< from the top, as rows are
};

Point toUnits(const Eigen::Vector2f& uv)
{
    const auto units = [](float part) { return std::llround(double{part} * double{kUnits}); };
    return {units(uv.x()), kUnits - units(uv.y())};
}

std::int64_t cross(const Point& a, const Point& b, const Point& c)
{
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Of a point on the line from a to b of a triangle to whose inside `cross` is positive: is it the triangle's, or that of the one on the
/// other side? (The rule of rasterizers: one of both.)
bool ownsEdge(const Point& a, const Point& b)
{
    return b.y < a.y || (b.y == a.y && b.x > a.x);
}

/// Finest first: means of what triangles cover, and, after filling, of what is nearby.
class FilledPyramid {
public:
    explicit FilledPyramid(std::vector<Vector3f> sums, std::uint32_t size)
        : _size(size)
    {
        _levels.push_back(std::move(sums));
        for (std::uint32_t s = size / 2; s > 0; s /= 2) { _levels.push_back(halved(_levels.back(), s)); }
        for (std::size_t level = _levels.size() - 1; level-- > 0;) { fill(level); }
    }

    const std::vector<Vector3f>& finest() const { return _levels.front(); }

private:
    static std::vector<Vector3f> halved(const std::vector<Vector3f>& fine, std::uint32_t size)
    {
        std::vector<Vector3f> coarse(std::size_t{size} * size);
        for (std::size_t y = 0; y < size; ++y) {
            for (std::size_t x = 0; x < size; ++x) {
                const std::size_t at = 2 * y * 2 * size + 2 * x;
                coarse[y * size + x] = fine[at] + fine[at + 1] + fine[at + 2 * size] + fine[at + 2 * size + 1];
            }
        }
        return coarse;
    }

    /// What has nothing takes over from the coarser level.
    void fill(std::size_t level)
    {
        const std::size_t size = _size >> level;
        for (std::size_t y = 0; y < size; ++y) {
            for (std::size_t x = 0; x < size; ++x) {
                Vector3f& sum = _levels[level][y * size + x];
                if (sum.isZero(0.0F)) { sum = _levels[level + 1][y / 2 * (size / 2) + x / 2]; }
            }
        }
    }

    std::uint32_t _size;
    std::vector<std::vector<Vector3f>> _levels;
};

/// The map of one material as triangles are added to it.
class Rasterizer {
public:
    explicit Rasterizer(std::uint32_t size)
        : _size(size)
        , _sums(std::size_t{size} * size, Vector3f::Zero())
        , _isCovered(std::size_t{size} * size * kSamples * kSamples, false)
    {
    }

    void add(std::array<Point, 3> corners, std::array<Vector3f, 3> normals)
    {
        std::int64_t area = cross(corners[0], corners[1], corners[2]);
        if (area == 0) { return; }
        if (area < 0) {
            std::swap(corners[1], corners[2]);
            std::swap(normals[1], normals[2]);
            area = -area;
        }
        const auto [left, right] = std::minmax({corners[0].x, corners[1].x, corners[2].x});
        const auto [top, bottom] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
        for (std::int64_t row = sampleBefore(top); row <= sampleBefore(bottom) + 1; ++row) {
            for (std::int64_t column = sampleBefore(left); column <= sampleBefore(right) + 1; ++column) {
                addSample(corners, normals, area, column, row);
            }
        }
    }

    std::uint64_t covered() const { return _covered; }
    std::uint64_t coveredTwice() const { return _coveredTwice; }

    NormalMap map(std::uint16_t material)
    {
        NormalMap map;
        map.material = material;
        const double samples = static_cast<double>(_isCovered.size());
        map.coverage = static_cast<double>(_covered) / samples;
        map.coveredTwice = _covered > 0 ? static_cast<double>(_coveredTwice) / static_cast<double>(_covered) : 0.0;
        const FilledPyramid filled(std::move(_sums), _size);
        map.image.width = map.image.height = _size;
        map.image.channels = 3;
        map.image.largestInteger = 65535.0;
        map.image.pixels.reserve(3 * filled.finest().size());
        for (const Vector3f& sum : filled.finest()) {
            const float length = sum.norm();
            const Vector3f n = length > 0.0F ? Vector3f(sum / length) : Vector3f::Zero();
            for (int k = 0; k < 3; ++k) { map.image.pixels.push_back(0.5F * n[k] + 0.5F); }
        }
        return map;
    }

private:
    std::int64_t step() const { return kUnits / (std::int64_t{_size} * kSamples); }
    /// Samples are in the middles of steps, and go on beyond the image.
    std::int64_t sampleBefore(std::int64_t at) const
    {
        return static_cast<std::int64_t>(std::floor(static_cast<double>(at) / static_cast<double>(step()))) - 1;
    }
    /// The image repeats.
    std::size_t wrapped(std::int64_t sample) const
    {
        const std::int64_t across = std::int64_t{_size} * kSamples; // a power of two
        return static_cast<std::size_t>(sample & (across - 1));
    }

    void addSample(const std::array<Point, 3>& corners, const std::array<Vector3f, 3>& normals, std::int64_t area,
                   std::int64_t column, std::int64_t row)
    {
        const Point at{column * step() + step() / 2, row * step() + step() / 2};
        std::array<float, 3> weights;
        for (std::size_t k = 0; k < 3; ++k) {
            const Point& a = corners[(k + 1) % 3];
            const Point& b = corners[(k + 2) % 3];
            const std::int64_t side = cross(a, b, at);
            if (side < 0 || (side == 0 && !ownsEdge(a, b))) { return; }
            weights[k] = static_cast<float>(static_cast<double>(side) / static_cast<double>(area));
        }
        const std::size_t x = wrapped(column);
        const std::size_t y = wrapped(row);
        const std::size_t sample = y * _size * kSamples + x;
        if (_isCovered[sample]) { ++_coveredTwice; }
        else { ++_covered; }
        _isCovered[sample] = true;
        Vector3f normal = weights[0] * normals[0] + weights[1] * normals[1] + weights[2] * normals[2];
        const float length = normal.norm();
        if (length > 0.0F) { normal /= length; }
        _sums[y / kSamples * _size + x / kSamples] += normal;
    }

    std::uint32_t _size;
    std::vector<Vector3f> _sums;
    std::vector<bool> _isCovered; ///< by sample
    std::uint64_t _covered = 0;
    std::uint64_t _coveredTwice = 0;
};

void checkTextureCoordinates(const SourceMesh& mesh)
{
    if (mesh.uvs.empty()) { throw AssetError(mesh.name + ": no texture coordinates for a normal map"); }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!mesh.hasUvs(t)) {
            throw AssetError(mesh.name + ": has faces without texture coordinates, which a normal map cannot have: bake "
                                         "normals per patch (without --normal-map)");
        }
        for (const Eigen::Vector2f& uv : mesh.uvs[t]) {
            if (uv.cwiseAbs().maxCoeff() <= kMostRepeats) { continue; }
            throw AssetError(fmt::format("{}: has texture coordinates ({}, {}) beyond {}, which a normal map cannot have: bake normals "
                                         "per patch (without --normal-map)",
                                         mesh.name, uv.x(), uv.y(), kMostRepeats));
        }
    }
}

std::string nameOf(const SourceMesh& mesh, std::uint16_t material)
{
    const bool isNamed = material < mesh.materials.size() && !mesh.materials[material].name.empty();
    return isNamed ? " of material " + mesh.materials[material].name : std::string();
}

} // namespace

std::vector<NormalMap> makeNormalMaps(const SourceMesh& mesh, const CornerNormals& normals, std::uint32_t size,
                                      Progress& progress)
{
    checkTextureCoordinates(mesh);
    std::vector<std::vector<std::size_t>> byMaterial(std::max<std::size_t>(1, mesh.materials.size()));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) { byMaterial[mesh.materialOf(t)].push_back(t); }
    progress.begin("normal map", mesh.triangles.size(), "triangles");
    std::vector<NormalMap> maps;
    for (std::size_t m = 0; m < byMaterial.size(); ++m) {
        if (byMaterial[m].empty()) { continue; }
        Rasterizer rasterizer(size);
        for (const std::size_t t : byMaterial[m]) {
            const auto& uv = mesh.uvs[t];
            rasterizer.add({toUnits(uv[0]), toUnits(uv[1]), toUnits(uv[2])}, normals[t]);
            progress.step(1);
        }
        const auto material = static_cast<std::uint16_t>(m);
        if (rasterizer.covered() == 0) {
            throw AssetError(mesh.name + ": texture coordinates" + nameOf(mesh, material) + " cover nothing of a normal map");
        }
        maps.push_back(rasterizer.map(material));
        if (maps.back().coveredTwice > kMostCoveredTwice) {
            throw AssetError(fmt::format("{}: the texture coordinates{} overlap in {:.1f} % of what they cover, which a normal map "
                                         "cannot have: bake normals per patch (without --normal-map), or unwrap it anew",
                                         mesh.name, nameOf(mesh, material), 100.0 * maps.back().coveredTwice));
        }
    }
    progress.end();
    return maps;
}

} // namespace osgTessLOD::bake
