// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace osgTessLOD::stress {

/// Random numbers by seed.
class Random {
public:
    explicit Random(std::uint64_t seed)
        : _generator(seed)
    {
    }
    double between(double from, double to) { return std::uniform_real_distribution<double>(from, to)(_generator); }
    /// All magnitudes alike.
    double magnitude(double from, double to) { return std::exp(between(std::log(from), std::log(to))); }
    bool chance(double probability) { return between(0.0, 1.0) < probability; }
    std::uint32_t below(std::uint32_t count)
    {
        return std::uniform_int_distribution<std::uint32_t>(0, count - 1)(_generator);
    }

protected:
    std::mt19937_64& generator() { return _generator; }

private:
    std::mt19937_64 _generator;
};

} // namespace osgTessLOD::stress
