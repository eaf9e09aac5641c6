// SPDX-License-Identifier: MIT
#include "ModelField.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace osgTessLOD::benchmarks {

namespace {

/// Appends `from`, `count` times over.
template <typename Element> void repeat(const std::vector<Element>& from, std::size_t count, std::vector<Element>& to)
{
    to.reserve(from.size() * count);
    for (std::size_t k = 0; k < count; ++k) { to.insert(to.end(), from.begin(), from.end()); }
}

} // namespace

LodAsset fieldOf(const LodAsset& model, unsigned side)
{
    LodAsset field;
    field.technique = model.technique;
    field.source = model.source;
    field.ladder = model.ladder;
    field.lattice = model.lattice;
    field.boundsMin = model.boundsMin;
    field.boundsMax = model.boundsMax;
    std::array<std::int32_t, 2> spacing{}; // lattice steps
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const float size = model.boundsMax[axis] - model.boundsMin[axis];
        spacing[axis] = static_cast<std::int32_t>(std::ceil(1.1F * size / model.lattice.step));
        field.boundsMax[axis] += static_cast<float>(spacing[axis]) * model.lattice.step * static_cast<float>(side - 1);
    }
    for (unsigned copy = 0; copy < side * side; ++copy) {
        const std::array<std::int32_t, 2> shift{static_cast<std::int32_t>(copy % side) * spacing[0],
                                                static_cast<std::int32_t>(copy / side) * spacing[1]};
        const auto firstVertex = static_cast<std::uint32_t>(field.baseVertices.size());
        const auto firstEdge = static_cast<std::uint32_t>(field.edges.size());
        const auto firstPatch = static_cast<std::uint32_t>(field.patches.size());
        for (std::array<std::int32_t, 3> vertex : model.baseVertices) {
            for (std::size_t axis = 0; axis < 2; ++axis) { vertex[axis] += shift[axis]; }
            field.baseVertices.push_back(vertex);
        }
        for (LodEdge edge : model.edges) {
            for (std::uint32_t& vertex : edge.baseVertices) { vertex += firstVertex; }
            for (std::uint32_t& patch : edge.patches) { patch += patch == kNoPatch ? 0 : firstPatch; }
            field.edges.push_back(edge);
        }
        for (LodPatch patch : model.patches) {
            for (std::uint32_t& vertex : patch.baseVertices) { vertex += firstVertex; }
            for (std::uint32_t& edge : patch.edges) { edge += firstEdge; }
            for (std::size_t axis = 0; axis < 2; ++axis) {
                patch.latticeOrigin[axis] += shift[axis];
                patch.boundCenter[axis] += static_cast<float>(shift[axis]) * model.lattice.step;
            }
            field.patches.push_back(patch);
        }
    }
    for (const LodLevel& level : model.levels) {
        LodLevel& made = field.levels.emplace_back();
        repeat(level.vertices, std::size_t{side} * side, made.vertices);
        repeat(level.errors, std::size_t{side} * side, made.errors);
    }
    return field;
}

} // namespace osgTessLOD::benchmarks
