// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/SeamLevels.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace osgTessLOD::bake {

SeamLevels::SeamLevels(const SeamLine& line, const SeamOptions& options)
    : _options(options)
    , _mostSegments(std::max(1U, options.factor / 2))
    , _samplesPerUnit(static_cast<double>(line.heights.size() - 1) / line.roots / static_cast<double>(options.rootUnits))
{
    for (unsigned root = 0; root < line.roots; ++root) {
        divide(line, root * options.rootUnits, (root + 1) * options.rootUnits);
    }
}

void SeamLevels::divide(const SeamLine& line, std::int64_t first, std::int64_t last)
{
    const std::int64_t length = last - first;
    const auto isEnough = [&](unsigned segments, double tolerance) {
        return length <= _options.shortestPart * segments && deviation(line, first, last, segments) <= tolerance;
    };
    if (length > _options.shortestPart && !isEnough(_mostSegments, _options.patchTolerance)) {
        const std::int64_t middle = first + length / 2;
        divide(line, first, middle);
        divide(line, middle, last);
        return;
    }
    unsigned segments = 1;
    while (segments < _mostSegments && !isEnough(segments, _options.tolerance)) { segments *= 2; }
    _parts.push_back({first, last, segments});
}

/// The largest difference in height at the samples: segments end on the samples' polyline.
double SeamLevels::deviation(const SeamLine& line, std::int64_t first, std::int64_t last, unsigned segments) const
{
    const double from = static_cast<double>(first) * _samplesPerUnit;
    const double length = static_cast<double>(last - first) * _samplesPerUnit / segments;
    double largest = 0.0;
    for (unsigned s = 0; s < segments; ++s) {
        const double begin = from + s * length;
        const double low = heightOnSeam(line.heights, begin);
        const double rise = heightOnSeam(line.heights, begin + length) - low;
        for (double at = std::ceil(begin); at <= begin + length; at += 1.0) {
            const double height = low + rise * ((at - begin) / length);
            largest = std::max(largest, std::fabs(height - heightOnSeam(line.heights, at)));
        }
    }
    return largest;
}

const SeamLevels::Part& SeamLevels::partAt(std::int64_t from) const
{
    const auto after = std::upper_bound(_parts.begin(), _parts.end(), from,
                                        [](std::int64_t place, const Part& part) { return place < part.first; });
    assert(after != _parts.begin());
    return *(after - 1);
}

bool SeamLevels::isDivided(std::int64_t from, std::int64_t to) const
{
    return partAt(from).last < to;
}

unsigned SeamLevels::segments(std::int64_t from, std::int64_t to) const
{
    const Part& part = partAt(from);
    assert(to <= part.last);
    return static_cast<unsigned>(part.segments * (to - from) / (part.last - part.first));
}

double heightOnSeam(const std::vector<float>& heights, double at)
{
    const double most = static_cast<double>(heights.size() - 1);
    const double whole = std::floor(std::clamp(at, 0.0, most));
    const auto i = static_cast<std::size_t>(whole);
    const double low = static_cast<double>(heights[i]);
    const double part = std::min(at, most) - whole;
    return part > 0.0 ? low + part * (static_cast<double>(heights[i + 1]) - low) : low;
}

} // namespace osgTessLOD::bake
