// SPDX-License-Identifier: MIT
#include "SyntheticAsset.h"

#include <osgTessLOD/asset/VertexCodec.h>

#include <gtest/gtest.h>

#include <cstring>
#include <random>

namespace osgTessLOD {
namespace {

template <class Value>
std::vector<Value> asValues(const std::vector<std::uint8_t>& content)
{
    std::vector<Value> values(content.size() / sizeof(Value));
    std::memcpy(static_cast<void*>(values.data()), content.data(), content.size());
    return values;
}

std::vector<LodVertex> throughCodec(unsigned factor, const std::vector<LodVertex>& vertices)
{
    std::vector<std::uint8_t> content(8 * vertices.size());
    encodeVertices(factor, vertices, content.data());
    auto result = asValues<LodVertex>(content);
    decodeVertices(factor, result);
    return result;
}

TEST(VertexCodec, anyVerticesComeBack)
{
    std::mt19937_64 random(4);
    for (const unsigned factor : {1U, 2U, 4U, 6U, 10U, 64U, 128U}) {
        std::vector<LodVertex> vertices(3 * std::size_t{TessellationPattern::vertexCount(factor)});
        for (LodVertex& v : vertices) { v.bits = random(); }
        EXPECT_EQ(throughCodec(factor, vertices), vertices) << factor;
        for (LodVertex& v : vertices) { v.bits = random() % 2 == 0 ? 0 : ~std::uint64_t{0}; }
        EXPECT_EQ(throughCodec(factor, vertices), vertices) << factor;
    }
}

TEST(VertexCodec, patchesMayLieAcrossBlocks)
{
    std::mt19937_64 random(5);
    std::vector<LodVertex> vertices((2 * kCodecBlock / 7 + 1) * 7); // of factor 2; 7 does not divide a block
    ASSERT_GT(vertices.size(), 2 * kCodecBlock);
    for (LodVertex& v : vertices) { v.bits = random(); }
    EXPECT_EQ(throughCodec(2, vertices), vertices);
}

TEST(VertexCodec, aFlatPatchIsAllZeroBehindItsBorder)
{
    // On a plane the inner vertices are their parallelograms' fourth corners, but for the corner 0 of each ring and the centre.
    constexpr unsigned kFactor = 16;
    const auto asset = synthetic::build(
        {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, [](const synthetic::Point& p) { return p; }, 1.0, 0.1},
        {1, kFactor}, false);
    auto vertices = asset.levels[1].vertices;
    // Positions in units of a third of a segment are integers: exact on the lattice.
    for (std::uint32_t v = 0; v < vertices.size(); ++v) {
        const auto b = TessellationPattern::barycentric(kFactor, v);
        vertices[v] = LodVertex::pack({static_cast<std::int32_t>(100 * b[1]), static_cast<std::int32_t>(50 * b[2]), 7}, 0);
    }
    std::vector<std::uint8_t> content(8 * vertices.size());
    encodeVertices(kFactor, vertices, content.data());
    std::size_t predicted = 0;
    for (std::size_t v = 0; v < vertices.size(); ++v) {
        bool zero = true;
        for (std::size_t plane = 0; plane < 8; ++plane) { zero = zero && content[plane * vertices.size() + v] == 0; }
        predicted += zero ? 1 : 0;
    }
    // Left over: 2 at the start of each of the border's sides but that vertex 0 is shared, 7 ring corners, the centre.
    EXPECT_GE(predicted, vertices.size() - (6 + 7 + 1));
}

TEST(VertexCodec, anyParametersComeBack)
{
    std::mt19937 random(9);
    for (const unsigned factor : {1U, 2U, 6U, 64U, 128U}) {
        std::vector<std::uint32_t> parameters(12 * std::size_t{TessellationPattern::vertexCount(factor)});
        for (auto& p : parameters) { p = static_cast<std::uint32_t>(random()); }
        std::vector<std::uint8_t> content(4 * parameters.size());
        encodeParameters(factor, parameters, content.data());
        auto result = asValues<std::uint32_t>(content);
        decodeParameters(factor, result);
        EXPECT_EQ(result, parameters) << factor;
    }
}

TEST(VertexCodec, parametersAtThePatternsPlacesAreAllZero)
{
    std::vector<std::uint32_t> parameters;
    for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(10); ++v) {
        parameters.push_back(TessellationPattern::chartPoint(10, v).bits());
    }
    std::vector<std::uint8_t> content(4 * parameters.size(), 0xFF);
    encodeParameters(10, parameters, content.data());
    EXPECT_EQ(content, std::vector<std::uint8_t>(content.size(), 0));
}

TEST(VertexCodec, anyNormalsComeBack)
{
    std::mt19937 random(6);
    for (const std::uint32_t resolution : {1U, 2U, 8U, 256U}) {
        std::vector<std::uint32_t> normals(5 * std::size_t{NormalTexture::texelCount(resolution)});
        for (auto& n : normals) { n = static_cast<std::uint32_t>(random()); }
        std::vector<std::uint8_t> content(4 * normals.size());
        encodeNormals(resolution, normals, content.data());
        auto result = asValues<std::uint32_t>(content);
        decodeNormals(resolution, result);
        EXPECT_EQ(result, normals) << resolution;
    }
}

TEST(VertexCodec, anyUvsAndColoursComeBack)
{
    std::mt19937 random(5);
    for (const unsigned factor : {1U, 2U, 6U, 64U}) {
        std::vector<std::uint32_t> words(TessellationPattern::vertexCount(factor) * (factor == 64 ? 45 : 3)); // over blocks
        for (std::uint32_t& word : words) { word = static_cast<std::uint32_t>(random()); }
        words.back() = UvLattice::kNone;
        std::vector<std::uint32_t> back(words.size());
        encodeUvs(factor, words, reinterpret_cast<std::uint8_t*>(back.data()));
        decodeUvs(factor, back);
        EXPECT_EQ(back, words) << "factor " << factor;
        encodeColors(factor, words, reinterpret_cast<std::uint8_t*>(back.data()));
        decodeColors(factor, back);
        EXPECT_EQ(back, words) << "factor " << factor;
    }
}

TEST(VertexCodec, uvsLinearInThePatternAreZeroBehindTheBorder)
{
    std::vector<std::uint32_t> uvs;
    for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(16); ++v) {
        const auto b = TessellationPattern::barycentric(16, v);
        uvs.push_back(static_cast<std::uint32_t>(100 * b[0] + 7 * b[1]) | static_cast<std::uint32_t>(3000 + 50 * b[2]) << 16);
    }
    std::vector<std::uint8_t> content(4 * uvs.size());
    encodeUvs(16, uvs, content.data());
    std::size_t predicted = 0;
    for (std::size_t v = 0; v < uvs.size(); ++v) {
        bool zero = true;
        for (std::size_t plane = 0; plane < 4; ++plane) { zero = zero && content[plane * uvs.size() + v] == 0; }
        predicted += zero ? 1 : 0;
    }
    EXPECT_GE(predicted, uvs.size() - (6 + 7 + 1)) << "as of a flat patch's positions";
}

TEST(VertexCodec, anyContentGivesSomeVertices)
{
    std::mt19937 random(7);
    std::vector<std::uint8_t> content(8 * 2 * std::size_t{TessellationPattern::vertexCount(8)});
    for (auto& byte : content) { byte = static_cast<std::uint8_t>(random()); }
    auto vertices = asValues<LodVertex>(content);
    decodeVertices(8, vertices);
    std::vector<std::uint8_t> again(content.size());
    encodeVertices(8, vertices, again.data());
    EXPECT_EQ(again, content); // one to one: no two contents mean the same vertices
}

} // namespace
} // namespace osgTessLOD
