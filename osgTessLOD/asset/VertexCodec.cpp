// SPDX-License-Identifier: MIT
// Parallelogram prediction after Touma and Gotsman, "Triangle mesh compression", 1998, on the tessellator's pattern: along
// a side, ring m has the same segments as ring m + 1 outside it, so that
//
//     o(k)   ── o(k+1)                 i(k) ≈ i(k−1) + o(k+1) − o(k)
//         \     / \                    o: ring m + 1, i: ring m, both counted from the side's corner
//      i(k−1) ── i(k)
#include <osgTessLOD/asset/VertexCodec.h>

#include <osgTessLOD/asset/TessellationPattern.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <memory>

namespace osgTessLOD {

namespace {

/// A vertex is predicted as plus0 + plus1 − minus, indices of earlier vertices of its patch.
struct Prediction {
    std::uint32_t plus0;
    std::uint32_t plus1;
    std::uint32_t minus;
};

/// The border: the straight line on, or the vertex before at the start of a side.
Prediction predictBorder(unsigned factor, std::uint32_t vertex)
{
    const bool twoBefore = (vertex - 1) % factor >= 1;
    return {vertex - 1, vertex - 1, twoBefore ? vertex - 2 : vertex - 1};
}

Prediction predictInner(unsigned factor, std::uint32_t vertex)
{
    using Pattern = TessellationPattern;
    const Pattern::Place at = Pattern::place(factor, vertex);
    if (at.ring == 0) { return {vertex - 1, vertex - 1, vertex - 1}; }
    const auto outer = [&](unsigned side, unsigned step) {
        return Pattern::index(factor, Pattern::Place{at.ring + 1, side, step});
    };
    if (at.side == 0 && at.step == 0) { return {outer(0, 1), outer(2, 2 * at.ring + 1), outer(0, 0)}; }
    // A corner ends the side before it.
    const unsigned side = at.step == 0 ? at.side - 1 : at.side;
    const unsigned step = at.step == 0 ? 2 * at.ring : at.step;
    return {vertex - 1, outer(side, step + 1), outer(side, step)};
}

/// Of every vertex of the pattern but vertex 0, which has nothing before it and is predicted as zero.
std::vector<Prediction> makePredictions(unsigned factor)
{
    const std::uint32_t border = TessellationPattern::borderVertexCount(factor);
    std::vector<Prediction> predictions(TessellationPattern::vertexCount(factor));
    for (std::uint32_t v = 1; v < predictions.size(); ++v) {
        predictions[v] = v < border ? predictBorder(factor, v) : predictInner(factor, v);
    }
    return predictions;
}

// Arithmetic on all four fields of a LodVertex at once, each modulo its own size: 17, 17, 17 and 13 bits.
constexpr std::uint64_t kLowBits = 1ULL | 1ULL << 17 | 1ULL << 34 | 1ULL << 51;
constexpr std::uint64_t kHighBits = 1ULL << 16 | 1ULL << 33 | 1ULL << 50 | 1ULL << 63;
constexpr std::uint64_t kParentBits = 0x1FFFULL << 51;

/// Sums of fields: no carry leaves the bits below a field's highest, whose sum without carry is an exclusive or.
std::uint64_t addFields(std::uint64_t a, std::uint64_t b)
{
    return ((a & ~kHighBits) + (b & ~kHighBits)) ^ ((a ^ b) & kHighBits);
}

std::uint64_t subtractFields(std::uint64_t a, std::uint64_t b)
{
    return ((a | kHighBits) - (b & ~kHighBits)) ^ ((a ^ ~b) & kHighBits);
}

/// All bits of each field whose lowest bit is set in `flags`, a part of kLowBits.
std::uint64_t wholeFields(std::uint64_t flags)
{
    const std::uint64_t parent = flags >> 51;
    const std::uint64_t axes = flags & ~kParentBits;
    return ((axes << 17) - axes) | (0 - parent) << 51;
}

/// Differences, modulo their field, as numbers that are small where the difference is, of either sign.
std::uint64_t fold(std::uint64_t differences)
{
    const std::uint64_t high = differences & kHighBits;
    const std::uint64_t negative = (high & ~kParentBits) >> 16 | high >> 63 << 51;
    return (differences & ~kHighBits) << 1 ^ wholeFields(negative);
}

std::uint64_t unfold(std::uint64_t folded)
{
    return (folded & ~kLowBits) >> 1 ^ wholeFields(folded & kLowBits);
}

std::uint64_t predict(const LodVertex* patch, std::uint32_t vertex, const Prediction& p)
{
    if (vertex == 0) { return 0; }
    const std::uint64_t position = subtractFields(addFields(patch[p.plus0].bits, patch[p.plus1].bits), patch[p.minus].bits);
    return (position & ~kParentBits) | (patch[vertex - 1].bits & kParentBits);
}

std::uint8_t low(std::uint64_t value)
{
    return static_cast<std::uint8_t>(value & 0xFFU);
}

/// Writes a folded residual as number `i` of a block of `n` vertices.
void storePlanes(std::uint8_t* block, std::size_t n, std::size_t i, std::uint64_t r)
{
    block[i] = low(r);
    block[n + i] = low(r >> 8);
    block[2 * n + i] = low(r >> 17);
    block[3 * n + i] = low(r >> 25);
    block[4 * n + i] = low(r >> 34);
    block[5 * n + i] = low(r >> 42);
    block[6 * n + i] = low(r >> 51);
    block[7 * n + i] = low(r >> 59 | (r >> 16 & 1) << 5 | (r >> 33 & 1) << 6 | (r >> 50 & 1) << 7);
}

std::uint64_t loadPlanes(const std::uint8_t* block, std::size_t n, std::size_t i)
{
    const auto byte = [&](std::size_t plane) { return std::uint64_t{block[plane * n + i]}; };
    const std::uint64_t top = byte(7);
    return byte(0) | byte(1) << 8 | (top >> 5 & 1) << 16 | byte(2) << 17 | byte(3) << 25 | (top >> 6 & 1) << 33 |
           byte(4) << 34 | byte(5) << 42 | (top >> 7) << 50 | byte(6) << 51 | (top & 0x1F) << 59;
}

// The same for half of a normal or of a parameter pair.
std::uint32_t foldHalf(std::uint32_t difference)
{
    const std::uint32_t d = difference & 0xFFFFU;
    return (d << 1 & 0xFFFFU) ^ ((d & 0x8000U) != 0 ? 0xFFFFU : 0U);
}

std::uint32_t unfoldHalf(std::uint32_t folded)
{
    return (folded & 0xFFFFU) >> 1 ^ (0U - (folded & 1U)); // modulo 2^16
}

/// From planes to values, block by block through a copy of the block. `load(block, n, i)` gives value i.
template <class Value, class Load>
void gatherPlanes(std::vector<Value>& values, const Load& load)
{
    const std::size_t scratchBytes = std::min(values.size(), kCodecBlock) * sizeof(Value);
    const std::unique_ptr<std::uint8_t[]> scratch(new std::uint8_t[scratchBytes]);
    for (std::size_t first = 0; first < values.size(); first += kCodecBlock) {
        const std::size_t n = std::min(kCodecBlock, values.size() - first);
        std::memcpy(scratch.get(), values.data() + first, n * sizeof(Value));
        for (std::size_t i = 0; i < n; ++i) { values[first + i] = load(scratch.get(), n, i); }
    }
}

/// The vertex that predicts texel `i` of row `j`, where it is texel `at` of the grid.
std::uint32_t normalPredictor(std::uint32_t resolution, std::uint32_t i, std::uint32_t j, std::uint32_t at)
{
    return i > 0 ? at - 1 : at - (resolution + 2 - j); // row j − 1 has resolution + 2 − j texels
}

std::uint32_t combineHalves(std::uint32_t x, std::uint32_t y)
{
    return (x & 0xFFFFU) | y << 16;
}

/// Writes the bytes of a folded residual as number v of `count`, lowest plane first.
void storeBytes(std::uint32_t residual, std::size_t v, std::size_t count, std::uint8_t* content)
{
    const std::size_t blockStart = v / kCodecBlock * kCodecBlock;
    const std::size_t n = std::min(kCodecBlock, count - blockStart);
    std::uint8_t* plane = content + 4 * blockStart + (v - blockStart);
    for (unsigned k = 0; k < 4; ++k) { plane[k * n] = low(residual >> 8 * k); }
}

/// Writes the difference of both halves of values[v] from `predicted` to its planes.
void storeHalves(const std::vector<std::uint32_t>& values, std::size_t v, std::uint32_t predicted,
                 std::uint8_t* content)
{
    const std::uint32_t x = foldHalf((values[v] & 0xFFFFU) - (predicted & 0xFFFFU));
    const std::uint32_t y = foldHalf((values[v] >> 16) - (predicted >> 16));
    storeBytes(combineHalves(x, y), v, values.size(), content);
}

/// From planes to the folded bytes or halves of every value.
void gatherBytes(std::vector<std::uint32_t>& values)
{
    gatherPlanes(values, [](const std::uint8_t* block, std::size_t n, std::size_t i) {
        const auto byte = [&](std::size_t plane) { return std::uint32_t{block[plane * n + i]}; };
        return byte(0) | byte(1) << 8 | byte(2) << 16 | byte(3) << 24;
    });
}

std::uint32_t addHalves(std::uint32_t predicted, std::uint32_t folded)
{
    return combineHalves((predicted & 0xFFFFU) + unfoldHalf(folded), (predicted >> 16) + unfoldHalf(folded >> 16));
}

/// Halves predicted as parallelograms, as positions are.
std::uint32_t predictHalves(const std::uint32_t* patch, std::uint32_t vertex, const Prediction& p)
{
    if (vertex == 0) { return 0; }
    const auto sum = [&](unsigned shift) {
        return (patch[p.plus0] >> shift) + (patch[p.plus1] >> shift) - (patch[p.minus] >> shift);
    };
    return combineHalves(sum(0), sum(16));
}

/// Differences of each byte, modulo 256, as numbers that are small where the difference is.
std::uint32_t foldBytes(std::uint32_t value, std::uint32_t predicted)
{
    std::uint32_t folded = 0;
    for (unsigned shift = 0; shift < 32; shift += 8) {
        const std::uint32_t d = ((value >> shift) - (predicted >> shift)) & 0xFFU;
        folded |= ((d << 1 & 0xFFU) ^ ((d & 0x80U) != 0 ? 0xFFU : 0U)) << shift;
    }
    return folded;
}

std::uint32_t unfoldBytes(std::uint32_t folded, std::uint32_t predicted)
{
    std::uint32_t value = 0;
    for (unsigned shift = 0; shift < 32; shift += 8) {
        const std::uint32_t f = folded >> shift & 0xFFU;
        value |= (((f >> 1 ^ (0U - (f & 1U))) + (predicted >> shift)) & 0xFFU) << shift;
    }
    return value;
}

/// ChartPoint::bits of every vertex of the pattern.
std::vector<std::uint32_t> patternParameters(unsigned factor)
{
    std::vector<std::uint32_t> parameters;
    for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
        parameters.push_back(TessellationPattern::chartPoint(factor, v).bits());
    }
    return parameters;
}

} // namespace

void encodeVertices(unsigned factor, const std::vector<LodVertex>& vertices, std::uint8_t* content)
{
    const std::vector<Prediction> predictions = makePredictions(factor);
    assert(vertices.size() % predictions.size() == 0);
    const LodVertex* patch = vertices.data();
    std::uint32_t inPatch = 0;
    for (std::size_t v = 0; v < vertices.size(); ++v) {
        const std::size_t blockStart = v / kCodecBlock * kCodecBlock;
        const std::size_t n = std::min(kCodecBlock, vertices.size() - blockStart);
        const std::uint64_t predicted = predict(patch, inPatch, predictions[inPatch]);
        storePlanes(content + 8 * blockStart, n, v - blockStart, fold(subtractFields(vertices[v].bits, predicted)));
        if (++inPatch == predictions.size()) {
            patch += inPatch;
            inPatch = 0;
        }
    }
}

void decodeVertices(unsigned factor, std::vector<LodVertex>& vertices)
{
    gatherPlanes(vertices, [](const std::uint8_t* block, std::size_t n, std::size_t i) {
        return LodVertex{loadPlanes(block, n, i)};
    });
    const std::vector<Prediction> predictions = makePredictions(factor);
    assert(vertices.size() % predictions.size() == 0);
    for (std::size_t first = 0; first < vertices.size(); first += predictions.size()) {
        LodVertex* patch = vertices.data() + first;
        for (std::uint32_t v = 0; v < predictions.size(); ++v) {
            patch[v].bits = addFields(predict(patch, v, predictions[v]), unfold(patch[v].bits));
        }
    }
}

void encodeParameters(unsigned factor, const std::vector<std::uint32_t>& parameters, std::uint8_t* content)
{
    const std::vector<std::uint32_t> predicted = patternParameters(factor);
    assert(parameters.size() % predicted.size() == 0);
    for (std::size_t v = 0; v < parameters.size(); ++v) {
        storeHalves(parameters, v, predicted[v % predicted.size()], content);
    }
}

void decodeParameters(unsigned factor, std::vector<std::uint32_t>& parameters)
{
    gatherBytes(parameters);
    const std::vector<std::uint32_t> predicted = patternParameters(factor);
    assert(parameters.size() % predicted.size() == 0);
    for (std::size_t v = 0; v < parameters.size(); ++v) {
        parameters[v] = addHalves(predicted[v % predicted.size()], parameters[v]);
    }
}

void encodeUvs(unsigned factor, const std::vector<std::uint32_t>& uvs, std::uint8_t* content)
{
    const std::vector<Prediction> predictions = makePredictions(factor);
    const std::size_t count = predictions.size();
    assert(uvs.size() % count == 0);
    for (std::size_t v = 0; v < uvs.size(); ++v) {
        const auto inPatch = static_cast<std::uint32_t>(v % count);
        storeHalves(uvs, v, predictHalves(uvs.data() + (v - inPatch), inPatch, predictions[inPatch]), content);
    }
}

void decodeUvs(unsigned factor, std::vector<std::uint32_t>& uvs)
{
    gatherBytes(uvs);
    const std::vector<Prediction> predictions = makePredictions(factor);
    assert(uvs.size() % predictions.size() == 0);
    for (std::size_t first = 0; first < uvs.size(); first += predictions.size()) {
        std::uint32_t* patch = uvs.data() + first;
        for (std::uint32_t v = 0; v < predictions.size(); ++v) {
            patch[v] = addHalves(predictHalves(patch, v, predictions[v]), patch[v]);
        }
    }
}

void encodeColors(unsigned factor, const std::vector<std::uint32_t>& colors, std::uint8_t* content)
{
    const std::vector<Prediction> predictions = makePredictions(factor);
    const std::size_t count = predictions.size();
    assert(colors.size() % count == 0);
    for (std::size_t v = 0; v < colors.size(); ++v) {
        const std::uint32_t* patch = colors.data() + v / count * count;
        const std::uint32_t predicted = v % count == 0 ? 0 : patch[predictions[v % count].plus0];
        storeBytes(foldBytes(colors[v], predicted), v, colors.size(), content);
    }
}

void decodeColors(unsigned factor, std::vector<std::uint32_t>& colors)
{
    gatherBytes(colors);
    const std::vector<Prediction> predictions = makePredictions(factor);
    assert(colors.size() % predictions.size() == 0);
    for (std::size_t first = 0; first < colors.size(); first += predictions.size()) {
        std::uint32_t* patch = colors.data() + first;
        for (std::uint32_t v = 0; v < predictions.size(); ++v) {
            patch[v] = unfoldBytes(patch[v], v == 0 ? 0 : patch[predictions[v].plus0]);
        }
    }
}

void encodeNormals(std::uint32_t resolution, const std::vector<std::uint32_t>& normals, std::uint8_t* content)
{
    std::size_t v = 0;
    while (v < normals.size()) {
        const std::uint32_t* patch = normals.data() + v;
        std::uint32_t at = 0;
        for (std::uint32_t j = 0; j <= resolution; ++j) {
            for (std::uint32_t i = 0; i + j <= resolution; ++i, ++at, ++v) {
                const std::uint32_t predicted = at == 0 ? 0 : patch[normalPredictor(resolution, i, j, at)];
                storeHalves(normals, v, predicted, content);
            }
        }
    }
}

void decodeNormals(std::uint32_t resolution, std::vector<std::uint32_t>& normals)
{
    gatherBytes(normals);
    const std::uint32_t texels = NormalTexture::texelCount(resolution);
    for (std::size_t first = 0; first < normals.size(); first += texels) {
        std::uint32_t* patch = normals.data() + first;
        std::uint32_t at = 0;
        for (std::uint32_t j = 0; j <= resolution; ++j) {
            for (std::uint32_t i = 0; i + j <= resolution; ++i, ++at) {
                const std::uint32_t predicted = at == 0 ? 0 : patch[normalPredictor(resolution, i, j, at)];
                patch[at] = addHalves(predicted, patch[at]);
            }
        }
    }
}

} // namespace osgTessLOD
