// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// A point within a face: weights of its corners, in the face's own corner order.
struct FacePoint {
    std::uint32_t face;
    Eigen::Vector3d barycentric;
};

/// The bijective map between a mesh and what half-edge collapses made of it, as the sequence of local maps that each
/// collapse carried (Lee et al., MAPS, 1998; Liu et al., successive self-parameterization, 2020).
///
/// A collapse of v into w replaces the faces around v by a fan from w over the same polygon:
///
///        r2 ───── r1                 r2 ───── r1
///       /  \     /  \               /     ／    \           old faces (v, ri, ri+1), without the gap on a boundary
///      r3 ── v ── r0 = w    ──►    r3 ──────────  w        new faces (w, ri+1, ri+2)
///       \  /     \  /               \     ＼    /
///        r4 ───── r5                 r4 ───── r5
///
/// Both triangulations are laid into one plane, where every triangle of both is positively oriented, so a point passes
/// from one to the other by its position there; along a crease, from one side's triangles to the same side's. Every face ever made has its own number: the source's faces come
/// first, in their order.
class OSGTESSLOD_EXPORT CollapseHistory {
public:
    static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
    static constexpr std::size_t kMaxRing = 64;

    /// One collapse. The ring holds ringSize ≥ 3 vertices counter-clockwise, w first.
    struct Step {
        unsigned ringSize = 0;
        /// Which of the ringSize sectors around v has no face: kNoGap for an interior vertex, else 0 or ringSize − 1.
        unsigned gap = kNoGap;
        std::array<Eigen::Vector2f, kMaxRing> ring;  ///< positions in the plane
        Eigen::Vector2f center;                      ///< of v
        std::array<std::uint32_t, kMaxRing> oldFace; ///< face of sector i, (v, ring[i], ring[i+1])
        std::array<std::uint8_t, kMaxRing> corner;   ///< which corner of that face v is
        /// Ring index of the other end of a crease or seam through v and w, whose sides points do not change; 0: none. v, w
        /// and that end lie on one line of the plane.
        unsigned crease = 0;

        static constexpr unsigned kNoGap = 0xFFFFFFFFU;

        /// Smallest ratio of a triangle's area, of both triangulations, to their mean; ≤ 0 if one is not positive.
        double quality() const;

        /// The new face (its index j) that takes over a point of sector i, and the point's weights in it; `weights` are of
        /// v, ring[i], ring[i+1].
        FacePoint carry(unsigned sector, const Eigen::Vector3d& weights) const;
    };

    explicit CollapseHistory(std::uint32_t sourceFaces);

    /// Records a collapse whose quality() is positive. Returns the first of its ringSize − 2 new faces' numbers; new face
    /// j has corners w, ring[j+1], ring[j+2] in this order.
    std::uint32_t add(const Step& step);

    std::uint32_t sourceFaces() const { return _sourceFaces; }
    std::size_t stepCount() const { return _steps.size(); }

    /// The point of the collapsed mesh (a face that no step replaced) that a point of the source's face maps to.
    FacePoint toCoarse(FacePoint point) const;
    /// The inverse.
    FacePoint toSource(FacePoint point) const;

    /// Positive orientation of both triangulations of every step, and equal areas: throws std::logic_error otherwise.
    void validate() const;

private:
    struct StoredStep {
        std::uint64_t firstRing;    ///< into _ring: center, ring[0] …
        std::uint64_t firstOldFace; ///< into _oldFaces: ringSize entries, the gap's unused
        std::uint32_t firstNewFace;
        std::uint8_t ringSize;
        std::uint8_t gap;           ///< kMaxRing: none
        std::uint8_t crease;
    };

    std::uint32_t _sourceFaces;
    std::vector<StoredStep> _steps;
    std::vector<Eigen::Vector2f> _ring;
    std::vector<std::uint32_t> _oldFaces;         ///< face · 4 + corner of v
    std::vector<std::uint32_t> _replacedBy;       ///< per face: step that replaced it, kNone
    std::vector<std::uint32_t> _createdBy;        ///< per face beyond the source's: step that made it

    Eigen::Vector2d ringPoint(const StoredStep& step, unsigned i) const;
};

} // namespace osgTessLOD::bake
