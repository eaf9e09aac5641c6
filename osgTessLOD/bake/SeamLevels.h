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

/// What all tiles of a terrain have in common. Places along a seam are counted in units.
struct SeamOptions {
    unsigned factor = 64;         ///< the largest of patches
    double patchTolerance = 0.0;  ///< parts are bisected while half of `factor` segments are farther than this from the samples, in height
    double tolerance = 0.0;       ///< parts have as many segments as it takes to be this near, half of `factor` at most
    std::int64_t rootUnits = 1;   ///< units of a root, a power of two
    std::int64_t shortestPart = 1; ///< units that no part is shorter and no segment longer than, a power of two
};

/// How finely a seam is drawn: a function of the samples on it alone, so that tiles baked apart find the same.
///
/// Each root is bisected into parts that have even segments, a power of two of them, whose ends lie on the samples' polyline. A
/// patch whose side is a part, or what bisection makes of one, has the part's segments along it: both tiles draw the same
/// polyline, whatever patches they have there. No segment is longer than a part may be short: parts of one seam that bisection
/// carries to another one where they meet leave every side a segment there. Parts have no more than half of the largest factor, as the triangles of
/// patches along them, which are drawn from afar, too, grow with the square.
class OSGTESSLOD_EXPORT SeamLevels {
public:
    SeamLevels(const SeamLine& line, const SeamOptions& options);

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

    SeamOptions _options;
    unsigned _mostSegments;
    double _samplesPerUnit;
    std::vector<Part> _parts; ///< one after the other
};

/// Height on the polyline of the samples: the same bits for the same samples.
OSGTESSLOD_EXPORT double heightOnSeam(const std::vector<float>& heights, double at);

} // namespace osgTessLOD::bake
