// SPDX-License-Identifier: MIT
#include <fuzz/Targets.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/DisplacementImage.h>
#include <osgTessLOD/bake/HeightField.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

namespace osgTessLOD::fuzz {

namespace {

using bake::HeightField;

/// A kind of file that is tried, and how its content begins.
struct Kind {
    const char* name;
    std::array<std::string_view, 2> beginnings;
};
constexpr std::array<Kind, 4> kKinds{{{"N45E007.hgt", {"", ""}},
                                      {"image.png", {"\x89PNG", "\x89PNG"}},
                                      {"image.tif", {"II", "MM"}},
                                      {"image.exr", {"\x76\x2f\x31\x01", "\x76\x2f\x31\x01"}}}};

std::optional<HeightField> tryToReadHeights(const std::string& path)
{
    try {
        return bake::readHeightField(path, {});
    } catch (const AssetError&) {
        return std::nullopt;
    }
}

void examineHeights(const std::string& path)
{
    std::optional<HeightField> field = tryToReadHeights(path);
    if (!field) { return; }
    if (field->heights.size() != std::size_t{field->columns} * field->rows) { throw Finding("heights are not a grid"); }
    for (std::size_t axis = 0; axis < 2; ++axis) {
        if (!(field->spacing[axis] > 0.0) || !std::isfinite(field->spacing[axis]) ||
            !std::isfinite(field->corner[axis])) {
            throw Finding("heights lie nowhere");
        }
    }
    if (std::any_of(field->heights.begin(), field->heights.end(), [](float h) { return std::isinf(h); })) {
        throw Finding("a height is infinite");
    }
    constexpr std::size_t kMost = 100'000; // more of them show no more
    if (field->heights.size() > kMost) { return; }
    bake::fillVoids(*field, 16);
    const bake::SourceMesh mesh = bake::triangulate(*field);
    if (!mesh.triangles.empty()) { bake::checkMesh(mesh); }
}

void examineDisplacement(const std::string& path)
{
    try {
        const bake::DisplacementImage image = bake::DisplacementImage::read(path, 3);
        for (const double u : {-1e6, 0.0, 0.3, 1.0}) {
            if (!image.vectorAt({u, 1.0 - u}).allFinite()) { throw Finding("a displacement is not finite"); }
        }
    } catch (const AssetError&) { // refused
    }
}

} // namespace

void examineImage(const std::uint8_t* data, std::size_t size)
{
    if (size == 0) { return; }
    const bool isDisplacement = (data[0] & 4U) != 0;
    const Kind& kind = kKinds[data[0] & 3U];
    const std::string content(data + 1, data + size);
    const auto isBeginning = [&](std::string_view beginning) {
        return content.compare(0, beginning.size(), beginning) == 0;
    };
    if (std::none_of(kind.beginnings.begin(), kind.beginnings.end(), isBeginning)) { return; }
    static const TemporaryDirectory folder;
    const std::string path = folder.file(kind.name);
    writeBytes(path, content);
    if (!isDisplacement) {
        examineHeights(path);
    } else if (!kind.beginnings.front().empty()) {
        examineDisplacement(path);
    }
}

} // namespace osgTessLOD::fuzz
