// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <cstdint>

/// The arithmetic of selecting patches, eight at a time. What it computes and why: LevelNeed.cpp. All lengths are in the units of
/// PatchBlocks. Every build of it gives the same bits.
namespace osgTessLOD::kernel {

constexpr unsigned kLanes = 8;

/// What all patches of one view share.
struct View {
    float eyeHigh[3]; ///< the eye, rounded
    float eyeLow[3];  ///< what was lost
    float axis[3];
    float slope; ///< tolerance per distance; orthographic: the tolerance
    float leastCosine;
    float most; ///< the largest need
    int top;    ///< the finest level that may be asked for
    int levelCount;
    bool orthographic;
    bool conservative;
    bool isotropic;
};

struct alignas(32) Spheres {
    float x[kLanes];
    float y[kLanes];
    float z[kLanes];
    float radius[kLanes];
};

/// Of one level. Both errors fall by 1 / LevelNeed::kErrorRatio at least from level to level.
struct alignas(32) Errors {
    float q[6][kLanes]; ///< ViewError::q
    float isotropic[kLanes];
    float coneCosine[kLanes]; ///< LevelError::coneCosine
};

/// LodPatch::coneAxis.
struct alignas(32) ConeAxes {
    float x[kLanes];
    float y[kLanes];
    float z[kLanes];
};

/// How patches meet. Sides are of 0, 1, 2; what lies on the other side of an open border is the side itself.
struct alignas(32) Borders {
    std::uint32_t twins[3][kLanes];     ///< positions of the patches on the other side
    std::uint32_t twinSides[3][kLanes]; ///< and of which of their sides
    float finest[3][kLanes];            ///< level of the border
    float coarsest[3][kLanes];          ///< it is drawn at this level at least: 0 but for seams
    float reach[kLanes];                ///< the largest of these
    std::uint32_t numbers[kLanes];      ///< of the patches in the asset
};

/// A number per patch of a block. Pointers to needs are to arrays of these.
struct alignas(32) Lanes {
    float at[kLanes];
};

struct alignas(32) Levels {
    float edges[3][kLanes];
    int drawn[kLanes]; ///< index of the level that the patch is drawn with
};

struct Kernel {
    /// What patches in such spheres, or points with radius 0, need. `errors`: a row per level. `hint`: a level to begin the
    /// search with, and the one it ended with; results do not depend on it.
    void (*needs)(const View& view, const Spheres& spheres, const Errors* errors, int& hint, float* needs);
    /// Bit k: sphere k lies behind the plane n · p + d ≥ 0, `plane` = n, d with n of unit length.
    unsigned (*behind)(const float* plane, const Spheres& spheres);
    /// Bit k: no triangle of patch k, whose normals are so far from the axis, shows its front (`sign` 1), or its back (−1),
    /// wherever in the sphere it lies.
    unsigned (*hidden)(const View& view, const Spheres& spheres, const ConeAxes& axes, const Lanes& cosines,
                       float sign);
    /// Levels of the patches at position `first` and after: of borders the larger need of both sides, as far as the border
    /// goes and at most `cap`, of seams the one that they have. `needs`: at [side · stride + position]; stride 0 where all sides of a patch need the same. Bit k
    /// of the result: patch k is saturated.
    unsigned (*levels)(const View& view, const Borders& borders, const float* needs, std::uint32_t stride,
                       std::uint32_t first, float cap, Levels& levels);
};

/// For any processor.
OSGTESSLOD_EXPORT const Kernel& baseline();
/// Null where this processor has no AVX2.
OSGTESSLOD_EXPORT const Kernel* avx2();
/// The fastest that this processor has.
OSGTESSLOD_EXPORT const Kernel& best();

} // namespace osgTessLOD::kernel
