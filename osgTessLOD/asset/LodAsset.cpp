// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/LodAsset.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/ChartPoint.h>
#include <osgTessLOD/asset/TessellationPattern.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace osgTessLOD {

namespace {

using LatticePoint = std::array<std::int64_t, 3>;

template <class... Parts>
[[noreturn]] void fail(const Parts&... parts)
{
    std::string message;
    const auto append = [&](const auto& part) {
        if constexpr (std::is_arithmetic_v<std::decay_t<decltype(part)>>) {
            message += std::to_string(part);
        } else {
            message += part;
        }
    };
    (append(parts), ...);
    throw AssetError(message);
}

template <class Numbers>
bool allFinite(const Numbers& numbers)
{
    return std::all_of(numbers.begin(), numbers.end(), [](auto x) { return std::isfinite(x); });
}

std::uint32_t encodeUv(float value, float origin, float step)
{
    if (!(step > 0.0F)) { return 0; }
    const double units = std::round((static_cast<double>(value) - static_cast<double>(origin)) / static_cast<double>(step));
    return static_cast<std::uint32_t>(std::clamp(units, 0.0, static_cast<double>(UvLattice::kUnits)));
}

bool finiteNotNegative(float x)
{
    return std::isfinite(x) && x >= 0.0F;
}

void checkLadder(const LodAsset& asset)
{
    const auto& ladder = asset.ladder;
    if (ladder.empty() || ladder.size() > LodAsset::kMaxLevels) {
        fail("ladder has ", ladder.size(), " levels, not 1 to ", LodAsset::kMaxLevels);
    }
    if (ladder[0] != 1) { fail("ladder starts with factor ", ladder[0], ", not 1"); }
    for (std::size_t level = 0; level < ladder.size(); ++level) {
        if (!TessellationPattern::isValidFactor(ladder[level])) { fail("ladder has the invalid factor ", ladder[level]); }
        if (level == 0) { continue; }
        if (ladder[level] <= ladder[level - 1]) { fail("ladder does not rise at level ", level); }
        if (TessellationPattern::vertexCount(ladder[level - 1]) > LodVertex::kMaxParent + 1) {
            fail("level ", level, " has parents of factor ", ladder[level - 1], ", more than 13 bits can number");
        }
    }
    if (asset.levels.size() != ladder.size()) {
        fail(asset.levels.size(), " levels for a ladder of ", ladder.size());
    }
}

void checkFrame(const LodAsset& asset)
{
    const float step = asset.lattice.step;
    // The largest position there can be must be a number, too.
    if (!(step > 0.0F) || !std::isfinite(step * 0x1p31F)) { fail("lattice step is not a positive, finite number"); }
    if (!allFinite(asset.lattice.origin)) { fail("lattice origin is not finite"); }
    if (!allFinite(asset.boundsMin) || !allFinite(asset.boundsMax)) { fail("bounds are not finite"); }
    for (std::size_t k = 0; k < 3; ++k) {
        if (asset.boundsMin[k] > asset.boundsMax[k]) { fail("bounds are empty: minimum above maximum"); }
    }
}

void checkPatch(const LodAsset& asset, std::size_t p)
{
    const LodPatch& patch = asset.patches[p];
    for (std::size_t s = 0; s < 3; ++s) {
        if (patch.baseVertices[s] >= asset.baseVertices.size()) { fail("patch ", p, ": base vertex out of range"); }
        if (patch.edges[s] >= asset.edges.size()) { fail("patch ", p, ": edge out of range"); }
        if (patch.baseVertices[s] == patch.baseVertices[(s + 1) % 3]) { fail("patch ", p, ": the same corner twice"); }
        if (patch.latticeOrigin[s] > std::numeric_limits<std::int32_t>::max() - Lattice::kMaxOffset) {
            fail("patch ", p, ": lattice origin too large for its offsets");
        }
    }
    if (patch.finestLevel >= asset.ladder.size()) { fail("patch ", p, ": finest level out of range"); }
    if (!allFinite(patch.boundCenter) || !finiteNotNegative(patch.boundRadius)) {
        fail("patch ", p, ": bounding sphere is not finite");
    }
    if (!finiteNotNegative(patch.chartError)) { fail("patch ", p, ": chart error is not a finite number ≥ 0"); }

    const auto& a = patch.coneAxis;
    const float length = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    // A unit vector rounded to float is within 1e-7 of unit length; what is off by 1e-4 was never normalized.
    if (!(std::fabs(length - 1.0F) <= 1e-4F)) {
        fail("patch ", p, ": normal cone's axis is not a unit vector");
    }
}

/// The side of `patch` that is edge `edge`, 3 if none. At most one can be: a patch's corners differ.
std::size_t sideOf(const LodPatch& patch, std::size_t edge)
{
    return static_cast<std::size_t>(std::find(patch.edges.begin(), patch.edges.end(), edge) - patch.edges.begin());
}

/// Patch `turn` of an edge runs along it from its base vertex `turn` to the other.
void checkEdgePatch(const LodAsset& asset, std::size_t e, std::size_t turn)
{
    const LodEdge& edge = asset.edges[e];
    if (edge.patches[turn] >= asset.patches.size()) { fail("edge ", e, ": patch out of range"); }
    const LodPatch& patch = asset.patches[edge.patches[turn]];
    const std::size_t side = sideOf(patch, e);
    if (side == 3) { fail("edge ", e, ": patch ", edge.patches[turn], " does not refer back to it"); }
    if (patch.baseVertices[side] != edge.baseVertices[turn] ||
        patch.baseVertices[(side + 1) % 3] != edge.baseVertices[1 - turn]) {
        fail("edge ", e, ": patch ", edge.patches[turn], " does not run along it in the right direction");
    }
}

void checkEdge(const LodAsset& asset, std::size_t e)
{
    const LodEdge& edge = asset.edges[e];
    checkEdgePatch(asset, e, 0);
    std::uint8_t finest = asset.patches[edge.patches[0]].finestLevel;
    if (edge.patches[1] != kNoPatch) {
        if (edge.patches[0] == edge.patches[1]) { fail("edge ", e, ": the same patch on both sides"); }
        checkEdgePatch(asset, e, 1);
        finest = std::min(finest, asset.patches[edge.patches[1]].finestLevel);
    }
    const bool isOpen = edge.patches[1] == kNoPatch;
    if (isOpen ? edge.finestLevel > finest : edge.finestLevel != finest) {
        fail("edge ", e, ": finest level is not the smaller of its patches'");
    }
    if (edge.coarsestLevel != 0 && (!isOpen || edge.coarsestLevel != edge.finestLevel)) {
        fail("edge ", e, ": coarsest level is neither 0 nor the only one of an open border");
    }
}

void checkTopology(const LodAsset& asset)
{
    if (asset.patches.empty()) { fail("no patches"); }
    if (asset.patches.size() >= kNoPatch || asset.edges.size() >= kNoPatch || asset.baseVertices.size() >= kNoPatch) {
        fail("more patches, edges or base vertices than 32 bits can number");
    }
    for (std::size_t p = 0; p < asset.patches.size(); ++p) { checkPatch(asset, p); }
    for (std::size_t e = 0; e < asset.edges.size(); ++e) { checkEdge(asset, e); }
    for (std::size_t p = 0; p < asset.patches.size(); ++p) {
        for (const std::uint32_t e : asset.patches[p].edges) {
            const auto& sides = asset.edges[e].patches;
            if (sides[0] != p && sides[1] != p) { fail("patch ", p, ": edge ", e, " does not refer back to it"); }
        }
    }
}

/// One level of one patch: its vertices and what their indices mean.
struct PatchLevel {
    const LodPatch& patch;
    const LodVertex* vertices;
    const std::uint32_t* parameters; ///< null: where the pattern has them
    const std::uint32_t* colors;     ///< null: none
    std::size_t level;
    unsigned factor;
    unsigned parentFactor; ///< of the level below, 0 at level 0

    /// Index of border position 0 … of of `of` segments along a side.
    static std::uint32_t border(unsigned of, std::size_t side, unsigned position)
    {
        return static_cast<std::uint32_t>((side * of + position) % (3 * of));
    }
    const LodVertex& onSide(std::size_t side, unsigned position) const { return vertices[border(factor, side, position)]; }
    ChartPoint parameterOnSide(std::size_t side, unsigned position) const
    {
        return ChartPoint::fromBits(parameters[border(factor, side, position)]);
    }
    LatticePoint lattice(const LodVertex& vertex) const
    {
        const auto offset = vertex.offset();
        LatticePoint sum{};
        for (std::size_t k = 0; k < 3; ++k) { sum[k] = std::int64_t{patch.latticeOrigin[k]} + offset[k]; }
        return sum;
    }
};

[[noreturn]] void failAt(std::size_t p, const PatchLevel& at, std::uint32_t vertex, const char* what)
{
    fail("patch ", p, ", level ", at.level, ", vertex ", vertex, ": ", what);
}

/// Along a side, parents go from its first corner to its last without a gap: each is the one before or the next. Then a
/// border drawn at a coarser level covers that level's border exactly.
void checkBorderParents(std::size_t p, const PatchLevel& at)
{
    for (std::size_t side = 0; side < 3; ++side) {
        unsigned position = 0; // of the parent along the side
        for (unsigned t = 0; t < at.factor; ++t) {
            const std::uint32_t parent = at.onSide(side, t).parent();
            const auto isParent = [&](unsigned u) { return parent == PatchLevel::border(at.parentFactor, side, u); };
            const std::uint32_t vertex = PatchLevel::border(at.factor, side, t);
            if (t == 0) {
                if (!isParent(0)) { failAt(p, at, vertex, "parent of a corner is not the same corner"); }
            } else if (!isParent(position)) {
                if (position == at.parentFactor || !isParent(position + 1)) {
                    failAt(p, at, vertex, "parent is not on the same border in order");
                }
                ++position;
            }
        }
        if (position + 1 < at.parentFactor) {
            failAt(p, at, PatchLevel::border(at.factor, side, at.factor - 1), "parent leaves out part of the border");
        }
    }
}

void checkParents(std::size_t p, const PatchLevel& at)
{
    // The parent has the highest bits, so that the largest word has the largest parent.
    const auto largest = [&](const LodVertex* first, const LodVertex* last) {
        std::uint64_t bits = 0;
        for (; first != last; ++first) { bits = std::max(bits, first->bits); }
        return LodVertex{bits}.parent();
    };
    const std::uint32_t count = TessellationPattern::vertexCount(at.factor);
    const std::uint32_t limit = at.level == 0 ? 1 : TessellationPattern::vertexCount(at.parentFactor);
    if (largest(at.vertices, at.vertices + count) >= limit) {
        fail("patch ", p, ", level ", at.level, ": parent out of range");
    }
    if (at.level > 0) { checkBorderParents(p, at); }
}

void checkCorners(const LodAsset& asset, std::size_t p, const PatchLevel& at)
{
    for (std::size_t side = 0; side < 3; ++side) {
        const auto& base = asset.baseVertices[at.patch.baseVertices[side]];
        if (at.lattice(at.onSide(side, 0)) != LatticePoint{base[0], base[1], base[2]}) {
            failAt(p, at, PatchLevel::border(at.factor, side, 0), "corner is not at its base vertex");
        }
    }
}

void checkParameters(std::size_t p, const PatchLevel& at)
{
    if (at.parameters == nullptr) { return; }
    for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(at.factor); ++v) {
        if (!ChartPoint::fromBits(at.parameters[v]).isInside()) {
            failAt(p, at, v, "parameters are outside the patch");
        }
    }
    for (unsigned side = 0; side < 3; ++side) {
        if (at.parameterOnSide(side, 0) != borderParameter(side, 0)) {
            failAt(p, at, PatchLevel::border(at.factor, side, 0), "parameters of a corner are not the corner's");
        }
        for (unsigned t = 1; t < at.factor; ++t) {
            const ChartPoint point = at.parameterOnSide(side, t);
            if (borderParameter(side, alongBorder(side, point)) != point) {
                failAt(p, at, PatchLevel::border(at.factor, side, t), "parameters are not on the vertex's border");
            }
        }
    }
}

/// Both patches of edge `e` have the same border at a level: positions, parameters, and parents as positions along it.
void checkSharedBorder(std::size_t e, const PatchLevel& a, std::size_t sideA, const PatchLevel& b, std::size_t sideB)
{
    const unsigned f = a.factor;
    for (unsigned t = 1; t < f; ++t) {
        const LodVertex& u = a.onSide(sideA, t);
        const LodVertex& v = b.onSide(sideB, f - t);
        if (a.lattice(u) != b.lattice(v)) {
            fail("edge ", e, ", level ", a.level, ", position ", t, ": its patches' vertices differ");
        }
        if (a.parameters != nullptr) {
            const auto along = [](const PatchLevel& level, std::size_t side, unsigned position) {
                return alongBorder(static_cast<unsigned>(side), level.parameterOnSide(side, position));
            };
            if (along(a, sideA, t) + along(b, sideB, f - t) != ChartPoint::kUnits) {
                fail("edge ", e, ", level ", a.level, ", position ", t, ": its patches' parameters differ");
            }
        }
        if (a.colors != nullptr && a.colors[PatchLevel::border(f, sideA, t)] != b.colors[PatchLevel::border(f, sideB, f - t)]) {
            fail("edge ", e, ", level ", a.level, ", position ", t, ": its patches' colours differ");
        }
        if (a.level == 0) { continue; }
        // Both parents are on their side, so each has exactly one position there.
        const unsigned g = a.parentFactor;
        const unsigned position = (u.parent() + 3 * g - static_cast<unsigned>(sideA) * g) % (3 * g);
        if (v.parent() != PatchLevel::border(g, sideB, g - position)) {
            fail("edge ", e, ", level ", a.level, ", position ", t, ": its patches' parents differ");
        }
    }
}

void checkErrors(const LodLevel& level, std::size_t l)
{
    for (std::size_t slot = 0; slot < level.errors.size(); ++slot) {
        const LevelError& error = level.errors[slot];
        const auto& q = error.quadratic.q;
        if (!allFinite(q) || !finiteNotNegative(error.isotropic) || q[0] < 0.0F || q[1] < 0.0F || q[2] < 0.0F) {
            fail("level ", l, ", error ", slot, ": not finite numbers ≥ 0");
        }
        if (!(error.coneCosine >= -1.0F && error.coneCosine <= 1.0F)) {
            fail("level ", l, ", error ", slot, ": the cosine of its normal cone is none");
        }
    }
}

void checkCount(std::size_t l, const char* what, std::size_t count, std::size_t wanted)
{
    if (count != wanted) { fail("level ", l, ": ", count, " ", what, ", not ", wanted); }
}

void checkAttributes(const LodAsset& asset, std::size_t l)
{
    const LodLevel& level = asset.levels[l];
    checkCount(l, "texture coordinates", level.uvs.size(), asset.hasUvs() ? level.vertices.size() : 0);
    checkCount(l, "colours", level.colors.size(), asset.hasColors() ? level.vertices.size() : 0);
    for (std::size_t v = 0; v < level.uvs.size(); ++v) {
        const std::uint32_t bits = level.uvs[v];
        if (bits != UvLattice::kNone && std::max(bits & 0xFFFFU, bits >> 16) > UvLattice::kUnits) {
            fail("level ", l, ", vertex ", v, ": texture coordinates out of range");
        }
    }
}

std::size_t patchesReaching(const LodAsset& asset, std::size_t l)
{
    return static_cast<std::size_t>(std::count_if(asset.patches.begin(), asset.patches.end(),
                                                  [&](const LodPatch& patch) { return patch.finestLevel >= l; }));
}

/// What a level has for each patch.
void checkLevelErrors(const LodAsset& asset, std::size_t l)
{
    const LodLevel& level = asset.levels[l];
    checkCount(l, "errors", level.errors.size(), patchesReaching(asset, l));
    checkErrors(level, l);
    checkCount(l, "errors of texture coordinates", level.uvErrors.size(), asset.hasUvs() ? level.errors.size() : 0);
    if (!std::all_of(level.uvErrors.begin(), level.uvErrors.end(), finiteNotNegative)) {
        fail("level ", l, ": errors of texture coordinates are not finite numbers ≥ 0");
    }
}

void checkUvLattice(const LodAsset& asset)
{
    const UvLattice& lattice = asset.uvLattice;
    for (std::size_t k = 0; k < 2; ++k) {
        const float largest = lattice.origin[k] + static_cast<float>(UvLattice::kUnits) * lattice.step[k];
        if (!std::isfinite(lattice.origin[k]) || !finiteNotNegative(lattice.step[k]) || !std::isfinite(largest)) {
            fail("the grid of texture coordinates is not finite");
        }
    }
}

/// What a level has for each vertex.
void checkLevelVertices(const LodAsset& asset, std::size_t l)
{
    const LodLevel& level = asset.levels[l];
    const unsigned factor = asset.ladder[l];
    const std::size_t count = TessellationPattern::vertexCount(factor);
    checkCount(l, "vertices", level.vertices.size(), patchesReaching(asset, l) * count);
    if (!level.parameters.empty() && level.parameters.size() != level.vertices.size()) {
        fail("level ", l, ": ", level.parameters.size(), " parameters, not ", level.vertices.size(), " or none");
    }
    checkAttributes(asset, l);

    const std::vector<std::uint32_t> slots = asset.levelSlots(l);
    const unsigned parentFactor = l == 0 ? 0 : asset.ladder[l - 1];
    const auto patchLevel = [&](std::size_t p) {
        const std::size_t first = slots[p] * count;
        const std::uint32_t* parameters = level.parameters.empty() ? nullptr : level.parameters.data() + first;
        const std::uint32_t* colors = level.colors.empty() ? nullptr : level.colors.data() + first;
        return PatchLevel{asset.patches[p], level.vertices.data() + first, parameters, colors, l, factor, parentFactor};
    };
    for (std::size_t p = 0; p < asset.patches.size(); ++p) {
        if (slots[p] == kNoPatch) { continue; }
        checkParents(p, patchLevel(p));
        checkCorners(asset, p, patchLevel(p));
        checkParameters(p, patchLevel(p));
    }
    for (std::size_t e = 0; e < asset.edges.size(); ++e) {
        const LodEdge& edge = asset.edges[e];
        if (edge.patches[1] == kNoPatch || edge.finestLevel < l) { continue; }
        const PatchLevel a = patchLevel(edge.patches[0]);
        const PatchLevel b = patchLevel(edge.patches[1]);
        checkSharedBorder(e, a, sideOf(a.patch, e), b, sideOf(b.patch, e));
    }
}

void checkNormalResolutions(const NormalTexture& normals)
{
    const std::uint32_t r = normals.resolution;
    if (r == 0) {
        if (!normals.levels.empty()) { fail("normals of resolution 0 with levels"); }
        return;
    }
    if ((r & (r - 1)) != 0 || r > NormalTexture::kMaxResolution) {
        fail("normal resolution ", r, " is not a power of two up to ", NormalTexture::kMaxResolution);
    }
    const std::size_t level = normals.resolutionCount();
    if (normals.levels.size() < level) { fail("normals have too few levels"); }
    if (normals.levels.size() > level) { fail("normals have too many levels"); }
}

void checkMaterials(const LodAsset& asset)
{
    const std::vector<std::uint16_t>& numbers = asset.patchMaterials;
    if (asset.materials.size() > LodAsset::kMaxMaterials) { fail("more materials than 16 bits can number"); }
    if (numbers.size() != (asset.materials.size() > 1 ? asset.patches.size() : 0)) {
        fail(numbers.size(), " patches have one of ", asset.materials.size(), " materials");
    }
    for (std::size_t p = 0; p < numbers.size(); ++p) {
        if (numbers[p] >= asset.materials.size()) { fail("patch ", p, ": material out of range"); }
    }
    for (std::size_t m = 0; m < asset.materials.size(); ++m) {
        const LodReflectance& r = asset.materials[m].reflectance;
        if (!allFinite(r.ambient) || !allFinite(r.diffuse) || !allFinite(r.specular) || !allFinite(r.emission) ||
            !(r.shininess >= 0.0F && r.shininess <= 128.0F)) {
            fail("material ", m, ": a number is out of range");
        }
        for (const LodTexture& texture : asset.materials[m].textures) {
            if (texture.image.empty()) { fail("material ", m, ": a texture has no image"); }
        }
    }
    for (std::size_t i = 0; i < asset.images.size(); ++i) {
        if (asset.images[i].name.empty() || asset.images[i].bytes.empty()) { fail("image ", i, " is empty"); }
    }
}

} // namespace

std::uint32_t UvLattice::encode(float u, float v) const
{
    if (!std::isfinite(u) || !std::isfinite(v)) { return kNone; }
    return encodeUv(u, origin[0], step[0]) | encodeUv(v, origin[1], step[1]) << 16;
}

bool LodAsset::hasSeams() const
{
    return std::any_of(edges.begin(), edges.end(), [](const LodEdge& edge) { return edge.coarsestLevel > 0; });
}

unsigned LodAsset::levelsUpTo(unsigned factor) const
{
    const auto isAbove = [factor](std::uint16_t f) { return f > factor; };
    return std::max(1U, static_cast<unsigned>(std::find_if(ladder.begin(), ladder.end(), isAbove) - ladder.begin()));
}

std::vector<std::uint32_t> LodAsset::levelSlots(std::size_t level) const
{
    std::vector<std::uint32_t> slots(patches.size(), kNoPatch);
    std::uint32_t next = 0;
    for (std::size_t p = 0; p < patches.size(); ++p) {
        if (patches[p].finestLevel >= level) { slots[p] = next++; }
    }
    return slots;
}

std::array<float, 3> LodAsset::position(const LodPatch& patch, LodVertex vertex) const
{
    const auto offset = vertex.offset();
    std::array<float, 3> result{};
    for (std::size_t k = 0; k < 3; ++k) {
        result[k] = static_cast<float>(patch.latticeOrigin[k] + offset[k]) * lattice.step;
    }
    return result;
}

const LodImage* LodAsset::imageOf(const LodTexture& texture) const
{
    const auto found =
        std::find_if(images.begin(), images.end(), [&](const LodImage& image) { return image.name == texture.image; });
    return found != images.end() ? &*found : nullptr;
}

void LodAsset::validate() const
{
    validateFrame();
    for (std::size_t level = 0; level < levels.size(); ++level) { validateLevel(level); }
    for (std::size_t level = 0; level < normals.levels.size(); ++level) { validateNormals(level); }
}

void LodAsset::validateFrame() const
{
    checkLadder(*this);
    checkFrame(*this);
    checkTopology(*this);
    checkUvLattice(*this);
    for (std::size_t level = 0; level < levels.size(); ++level) { checkLevelErrors(*this, level); }
    checkNormalResolutions(normals);
    checkMaterials(*this);
}

void LodAsset::validateLevel(std::size_t level) const
{
    checkLevelVertices(*this, level);
}

void LodAsset::validateNormals(std::size_t level) const
{
    const std::size_t texels = patches.size() * NormalTexture::texelCount(1U << level);
    if (normals.levels[level].size() != texels) {
        fail("normals of resolution ", 1U << level, ": ", normals.levels[level].size(), " texels, not ", texels);
    }
}

} // namespace osgTessLOD
