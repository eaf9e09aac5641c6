// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/NormalMap.h>

#include <osgTessLOD/asset/AssetError.h>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3f;

constexpr std::int64_t kSamples = 4; ///< along a texel's side
/// Texture coordinates as integers, so that on which side of an edge a point lies has no rounding: products stay below 2^61.
constexpr std::int64_t kUnits = std::int64_t{1} << 24;
constexpr float kMostRepeats = 32.0F;
/// Rows of texels that are made together.
constexpr std::uint32_t kBand = 16;
/// What the GPU has of each channel (MaterialState): more would be noise in the file that nobody sees.
constexpr float kLargest = 1023.0F;

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

/// `below` > 0.
std::int64_t floorOf(std::int64_t above, std::int64_t below)
{
    return above >= 0 ? above / below : -((-above + below - 1) / below);
}

std::int64_t ceilingOf(std::int64_t above, std::int64_t below)
{
    return -floorOf(-above, below);
}

/// Of a point on the line from a to b of a triangle to whose inside `cross` is positive: is it the triangle's, or that of the one on the
/// other side? (The rule of rasterizers: one of both.)
bool ownsEdge(const Point& a, const Point& b)
{
    return b.y < a.y || (b.y == a.y && b.x > a.x);
}

/// In the image, turned so that `cross` is positive inside.
struct Triangle {
    std::array<Point, 3> corners;
    std::array<Vector3f, 3> normals;
    std::int64_t area;

    Triangle(const std::array<Eigen::Vector2f, 3>& uvs, const std::array<Vector3f, 3>& ofCorners)
        : corners{toUnits(uvs[0]), toUnits(uvs[1]), toUnits(uvs[2])}
        , normals(ofCorners)
        , area(cross(corners[0], corners[1], corners[2]))
    {
        if (area >= 0) { return; }
        std::swap(corners[1], corners[2]);
        std::swap(normals[1], normals[2]);
        area = -area;
    }

    /// First and last x of the triangle's points of this y, which is no less than its least and no more than its largest; first > last: none.
    std::pair<std::int64_t, std::int64_t> span(std::int64_t y) const
    {
        std::int64_t first = std::min({corners[0].x, corners[1].x, corners[2].x});
        std::int64_t last = std::max({corners[0].x, corners[1].x, corners[2].x});
        for (std::size_t k = 0; k < 3; ++k) {
            const Point& a = corners[k];
            const Point& b = corners[(k + 1) % 3];
            // cross(a, b, p) ≥ 0, or > 0: rise · (x − a.x) ≤ most
            const std::int64_t rise = b.y - a.y;
            const std::int64_t most = (b.x - a.x) * (y - a.y) - (ownsEdge(a, b) ? 0 : 1);
            if (rise > 0) { last = std::min(last, a.x + floorOf(most, rise)); }
            if (rise < 0) { first = std::max(first, a.x + ceilingOf(-most, -rise)); }
            if (rise == 0 && most < 0) { return {0, -1}; }
        }
        return {first, last};
    }

    Vector3f normalAt(const Point& at) const
    {
        Vector3f sum = Vector3f::Zero();
        for (std::size_t k = 0; k < 3; ++k) {
            const auto weight = static_cast<double>(cross(corners[(k + 1) % 3], corners[(k + 2) % 3], at)) / static_cast<double>(area);
            sum += static_cast<float>(weight) * normals[k];
        }
        const float length = sum.norm();
        return length > 0.0F ? Vector3f(sum / length) : sum;
    }
};

/// The map of one material: means of what triangles cover of an image that repeats.
class Rasterizer {
public:
    explicit Rasterizer(std::uint32_t size)
        : _size(size)
        , _across(size * kSamples)
        , _step(kUnits / _across)
        , _normals(std::size_t{3} * size * size, 0.0F)
        , _isCovered(static_cast<std::size_t>(_across * _across), false)
        , _isCoveredTwice(_isCovered)
        , _again(size / kBand, 0)
    {
    }

    void draw(const SourceMesh& mesh, const CornerNormals& normals, const std::vector<std::size_t>& numbers, Progress& progress)
    {
        tbb::parallel_for(std::size_t{0}, _again.size(), [&](std::size_t band) {
            const std::int64_t firstRow = static_cast<std::int64_t>(band) * kBandRows;
            for (const std::size_t t : numbers) {
                const Triangle triangle(mesh.uvs[t], normals[t]);
                if (triangle.area > 0) { draw(triangle, firstRow, _again[band]); }
            }
            progress.step(kBand);
        });
    }

    /// Part of all samples.
    double coverage() const
    {
        const auto covered = std::count(_isCovered.begin(), _isCovered.end(), true);
        return static_cast<double>(covered) / static_cast<double>(_isCovered.size());
    }
    /// Of the texels that are covered, those that are covered twice; each by more than half.
    double partCoveredTwice() const
    {
        std::size_t once = 0;
        std::size_t twice = 0;
        for (std::int64_t row = 0; row < _size; ++row) {
            for (std::int64_t column = 0; column < _size; ++column) {
                once += isMostOf(_isCovered, row, column) ? 1 : 0;
                twice += isMostOf(_isCoveredTwice, row, column) ? 1 : 0;
            }
        }
        return once > 0 ? static_cast<double>(twice) / static_cast<double>(once) : 0.0;
    }

    /// Three numbers for each texel, not unit vectors; all 0: nothing is there.
    std::vector<float> takeNormals() { return std::move(_normals); }

private:
    static constexpr std::int64_t kBandRows = kBand * kSamples;
    /// Of which there may be millions: after so many the rest tells nothing more.
    static constexpr std::int64_t kMostLayers = 8;

    /// Are most samples of a texel true?
    bool isMostOf(const std::vector<bool>& samples, std::int64_t row, std::int64_t column) const
    {
        std::int64_t count = 0;
        for (std::int64_t r = 0; r < kSamples; ++r) {
            const auto first = samples.begin() + ((row * kSamples + r) * _across + column * kSamples);
            count += std::count(first, first + kSamples, true);
        }
        return 2 * count > kSamples * kSamples;
    }

    /// Samples are in the middles of steps, and go on beyond the image.
    std::int64_t sampleFrom(std::int64_t at) const { return ceilingOf(at - _step / 2, _step); }
    std::int64_t sampleTo(std::int64_t at) const { return floorOf(at - _step / 2, _step); }

    /// Into a band of rows of the image, each of its repeats.
    void draw(const Triangle& triangle, std::int64_t bandRow, std::int64_t& again)
    {
        const auto& corners = triangle.corners;
        const auto [top, bottom] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
        const std::int64_t first = sampleFrom(top);
        const std::int64_t last = sampleTo(bottom);
        for (std::int64_t repeat = floorOf(first - bandRow, _across); repeat * _across + bandRow <= last; ++repeat) {
            const std::int64_t begin = repeat * _across + bandRow;
            const std::int64_t end = std::min(last, begin + kBandRows - 1);
            for (std::int64_t row = std::max(first, begin); row <= end; ++row) { drawRow(triangle, row, again); }
        }
    }

    void drawRow(const Triangle& triangle, std::int64_t row, std::int64_t& again)
    {
        if (again > kMostLayers * kBandRows * _across) { return; }
        const std::int64_t y = row * _step + _step / 2;
        const std::int64_t imageRow = row & (_across - 1); // a power of two
        const auto [left, right] = triangle.span(y);
        const std::int64_t last = sampleTo(right);
        for (std::int64_t column = sampleFrom(left); column <= last; ++column) {
            const std::int64_t imageColumn = column & (_across - 1);
            const auto sample = static_cast<std::size_t>(imageRow * _across + imageColumn);
            if (_isCovered[sample]) {
                _isCoveredTwice[sample] = true;
                ++again;
            }
            _isCovered[sample] = true;
            const auto texel = static_cast<std::size_t>(imageRow / kSamples * _size + imageColumn / kSamples);
            Eigen::Map<Vector3f> sum(&_normals[3 * texel]);
            sum += triangle.normalAt({column * _step + _step / 2, y});
        }
    }

    std::int64_t _size;
    std::int64_t _across; ///< samples
    std::int64_t _step;   ///< between them
    std::vector<float> _normals;
    std::vector<bool> _isCovered; ///< by sample; a band has words of its own
    std::vector<bool> _isCoveredTwice;
    std::vector<std::int64_t> _again; ///< by band: how often something covered was covered once more
};

/// Makes unit vectors of a map's normals, and fills what has none ring by ring around what has: with the mean of those of the rings before
/// that are next to it, so that charts grow until they meet. The map repeats.
class GutterFill {
public:
    GutterFill(std::vector<float>& normals, std::uint32_t size)
        : _normals(normals)
        , _size(size)
        , _states(std::size_t{size} * size, State::Empty)
    {
    }

    void fill()
    {
        for (std::size_t texel = 0; texel < _states.size(); ++texel) {
            if (setNormal(texel, at(texel))) { _states[texel] = State::Known; }
        }
        std::vector<std::size_t> ring;
        for (std::size_t texel = 0; texel < _states.size(); ++texel) {
            if (_states[texel] == State::Known) { addNeighbours(texel, ring); }
        }
        std::vector<std::size_t> next;
        while (!ring.empty()) {
            // A texel whose neighbours cancel out has the normal of one of them.
            for (const std::size_t texel : ring) {
                Vector3f sum = Vector3f::Zero();
                Vector3f any = Vector3f::Zero();
                forEachNeighbour(texel, [&](std::size_t other) {
                    if (_states[other] != State::Known) { return; }
                    sum += at(other);
                    any = at(other);
                });
                if (!setNormal(texel, sum)) { setNormal(texel, any); }
            }
            for (const std::size_t texel : ring) { _states[texel] = State::Known; }
            next.clear();
            for (const std::size_t texel : ring) { addNeighbours(texel, next); }
            ring.swap(next);
        }
    }

private:
    enum class State : std::uint8_t { Empty, InRing, Known };

    Vector3f at(std::size_t texel) const { return Eigen::Map<const Vector3f>(&_normals[3 * texel]); }

    bool setNormal(std::size_t texel, const Vector3f& direction)
    {
        const float length = direction.norm();
        if (!(length > 1e-3F)) { return false; }
        Eigen::Map<Vector3f> normal(&_normals[3 * texel]);
        normal = direction / length;
        return true;
    }

    template <typename Visit> void forEachNeighbour(std::size_t texel, const Visit& visit) const
    {
        const std::size_t last = _size - 1; // a power of two less 1
        const std::size_t x = texel & last;
        const std::size_t y = texel / _size;
        for (const std::size_t row : {y + last, y, y + 1}) {
            for (const std::size_t column : {x + last, x, x + 1}) {
                const std::size_t other = (row & last) * _size + (column & last);
                if (other != texel) { visit(other); }
            }
        }
    }

    void addNeighbours(std::size_t texel, std::vector<std::size_t>& ring)
    {
        forEachNeighbour(texel, [&](std::size_t other) {
            if (_states[other] != State::Empty) { return; }
            _states[other] = State::InRing;
            ring.push_back(other);
        });
    }

    std::vector<float>& _normals;
    std::size_t _size;
    std::vector<State> _states;
};

ImageData imageOf(std::vector<float> normals, std::uint32_t size)
{
    GutterFill(normals, size).fill();
    for (float& part : normals) { part = std::round((0.5F * part + 0.5F) * kLargest) / kLargest; }
    ImageData image;
    image.width = image.height = size;
    image.channels = 3;
    image.largestInteger = 65535.0;
    image.pixels = std::move(normals);
    return image;
}

constexpr char kAdvice[] = "which a normal map cannot have: bake normals per patch (without --normal-map)";

std::string nameOf(const SourceMesh& mesh, std::optional<std::uint16_t> material)
{
    const bool isNamed = material && *material < mesh.materials.size() && !mesh.materials[*material].name.empty();
    return isNamed ? " of material " + mesh.materials[*material].name : std::string();
}

void checkTextureCoordinates(const SourceMesh& mesh, std::optional<std::uint16_t> material, const std::vector<std::size_t>& triangles)
{
    for (const std::size_t t : triangles) {
        if (!mesh.hasUvs(t)) {
            throw AssetError(fmt::format("{}: has faces{} without texture coordinates, {}", mesh.name, nameOf(mesh, material), kAdvice));
        }
        for (const Eigen::Vector2f& uv : mesh.uvs[t]) {
            if (uv.cwiseAbs().maxCoeff() <= kMostRepeats) { continue; }
            throw AssetError(fmt::format("{}: has texture coordinates{} ({}, {}) beyond {}, {}", mesh.name, nameOf(mesh, material), uv.x(),
                                         uv.y(), kMostRepeats, kAdvice));
        }
    }
}

NormalMap makeNormalMap(const SourceMesh& mesh, const CornerNormals& normals, const std::vector<std::size_t>& triangles,
                        std::optional<std::uint16_t> material, std::uint32_t size, Progress& progress)
{
    checkTextureCoordinates(mesh, material, triangles);
    Rasterizer rasterizer(size);
    rasterizer.draw(mesh, normals, triangles, progress);
    NormalMap map;
    map.material = material;
    map.coverage = rasterizer.coverage();
    if (map.coverage == 0.0) {
        throw AssetError(mesh.name + ": texture coordinates" + nameOf(mesh, material) + " cover nothing of a normal map");
    }
    map.coveredTwice = rasterizer.partCoveredTwice();
    if (map.coveredTwice > kMostCoveredTwice) {
        throw AssetError(fmt::format("{}: the texture coordinates{} overlap in {:.1f} % of what they cover, {}, or unwrap it anew", mesh.name,
                                     nameOf(mesh, material), 100.0 * map.coveredTwice, kAdvice));
    }
    map.image = imageOf(rasterizer.takeNormals(), size);
    return map;
}

} // namespace

void makeNormalMaps(const SourceMesh& mesh, const CornerNormals& normals, std::uint32_t size, bool together, Progress& progress,
                    const std::function<void(NormalMap map)>& use)
{
    if (mesh.uvs.empty()) { throw AssetError(mesh.name + ": no texture coordinates for a normal map"); }
    std::vector<std::vector<std::size_t>> byMaterial(together ? 1 : std::max<std::size_t>(1, mesh.materials.size()));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) { byMaterial[together ? 0 : mesh.materialOf(t)].push_back(t); }
    const auto isUsed = [](const std::vector<std::size_t>& triangles) { return !triangles.empty(); };
    progress.begin("normal map", static_cast<std::uint64_t>(std::count_if(byMaterial.begin(), byMaterial.end(), isUsed)) * size, "rows");
    for (std::size_t m = 0; m < byMaterial.size(); ++m) {
        if (!isUsed(byMaterial[m])) { continue; }
        const auto material = together ? std::nullopt : std::optional<std::uint16_t>(static_cast<std::uint16_t>(m));
        use(makeNormalMap(mesh, normals, byMaterial[m], material, size, progress));
    }
    progress.end();
}

} // namespace osgTessLOD::bake
