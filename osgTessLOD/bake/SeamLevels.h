// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// The border of a tile of terrain along which it meets the next one, as samples of heights.
struct SeamLine {
    std::vector<float> heights; ///< two at least, one spacing apart; no voids
    unsigned roots = 1;         ///< equal parts that bisection starts from
};

/// How finely a seam is drawn: a function of the samples on it alone, so that tiles baked apart find the same.
///
/// Each root is bisected into parts that have even segments, a power of two of them, whose ends lie on the samples' polyline. A
/// patch whose side is a part, or what bisection makes of one, has the part's segments along it: both tiles draw the same
/// polyline, whatever patches they have there.
class OSGTESSLOD_EXPORT SeamLevels {
public:
    /// Parts are bisected while half of `factor` segments are farther than `patchTolerance` from the samples, in height, or longer
    /// than `factor` / 2 samples; they have as many as it takes to be within `tolerance`, half of `factor` at most: from afar, the
    /// triangles of patches along seams grow with the square. Places along the seam are counted in units of which `rootUnits`,
    /// a power of two, make a root.
    SeamLevels(const SeamLine& line, unsigned factor, double patchTolerance, double tolerance, std::int64_t rootUnits);

    /// Is there more than one part between these places, ends of what bisection makes of a root?
    bool isDivided(std::int64_t from, std::int64_t to) const;
    /// Segments between them, within one part; 0: less than one.
    unsigned segments(std::int64_t from, std::int64_t to) const;

private:
    struct Part {
        std::int64_t first;
        std::int64_t last;
        unsigned segments;
    };

    void divide(const SeamLine& line, std::int64_t first, std::int64_t last);
    const Part& partAt(std::int64_t from) const;
    double deviation(const SeamLine& line, std::int64_t first, std::int64_t last, unsigned segments) const;

    unsigned _mostSegments;
    double _longest; ///< segment, in samples
    double _patchTolerance;
    double _tolerance;
    double _samplesPerUnit;
    std::vector<Part> _parts; ///< one after the other
};

/// Height on the polyline of the samples: the same bits for the same samples.
OSGTESSLOD_EXPORT double heightOnSeam(const std::vector<float>& heights, double at);

} // namespace osgTessLOD::bake
