// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace osgTessLOD {

/// The reversible transforms that make vertices, their parameters and normals of a .tlod file compress well: every value becomes its
/// difference from a prediction out of values before it in the same patch, small numbers of either sign, and the bytes
/// of one significance are gathered in planes. Content has exactly the size of the values in memory, so that decoding
/// works in place: the content is decompressed right into the array it belongs to.
///
/// Values are cut into blocks of kCodecBlock, without regard to patches, the last one shorter. Within a block of n values
/// come planes of n bytes each, with d an axis' residual in 17 bits and p the parent's in 13, least significant bit the sign:
///
///     vertices   x0–7  x8–15  y0–7  y8–15  z0–7  z8–15  p0–7  (p8–12 | x16 << 5 | y16 << 6 | z16 << 7)
///     parameters u0–7  u8–15  v0–7  v8–15
///     normals    x0–7  x8–15  y0–7  y8–15
///     uvs        u0–7  u8–15  v0–7  v8–15
///     colors     red  green  blue  alpha
constexpr std::size_t kCodecBlock = std::size_t{1} << 17;

/// `content` has 8 · vertices.size() bytes; the vertices are whole patches of pattern `factor`. Positions are
/// predicted as parallelograms with the ring outside (see VertexCodec.cpp), parents as the previous vertex's.
OSGTESSLOD_EXPORT void encodeVertices(unsigned factor, const std::vector<LodVertex>& vertices, std::uint8_t* content);
/// The array's memory holds content; afterwards it holds the vertices. Any content gives some vertices.
OSGTESSLOD_EXPORT void decodeVertices(unsigned factor, std::vector<LodVertex>& vertices);

/// As encodeVertices for LodLevel::parameters, 4 · parameters.size() bytes. A vertex is predicted to lie where the pattern
/// has it. Any content gives some numbers, not all of them points of the patch.
OSGTESSLOD_EXPORT void encodeParameters(unsigned factor, const std::vector<std::uint32_t>& parameters,
                                        std::uint8_t* content);
OSGTESSLOD_EXPORT void decodeParameters(unsigned factor, std::vector<std::uint32_t>& parameters);

/// As encodeVertices for one resolution of a NormalTexture, 4 · normals.size() bytes. A normal is predicted as the one
/// before it in its row of the grid, the first of a row as the first of the row before.
OSGTESSLOD_EXPORT void encodeNormals(std::uint32_t resolution, const std::vector<std::uint32_t>& normals,
                                     std::uint8_t* content);
OSGTESSLOD_EXPORT void decodeNormals(std::uint32_t resolution, std::vector<std::uint32_t>& normals);

/// As encodeVertices for LodLevel::uvs, 4 · uvs.size() bytes, predicted as positions are.
OSGTESSLOD_EXPORT void encodeUvs(unsigned factor, const std::vector<std::uint32_t>& uvs, std::uint8_t* content);
OSGTESSLOD_EXPORT void decodeUvs(unsigned factor, std::vector<std::uint32_t>& uvs);

/// As encodeVertices for LodLevel::colors, 4 · colors.size() bytes. A colour is predicted as that of a vertex next to it.
OSGTESSLOD_EXPORT void encodeColors(unsigned factor, const std::vector<std::uint32_t>& colors, std::uint8_t* content);
OSGTESSLOD_EXPORT void decodeColors(unsigned factor, std::vector<std::uint32_t>& colors);

} // namespace osgTessLOD
