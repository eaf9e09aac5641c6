// SPDX-License-Identifier: MIT
// K. Perlin, "Improving noise", 2002: gradient noise with a quintic fade, over an integer hash instead of a permutation
// table, so that it needs no state, never repeats within 2^32 cells, and gives the same values everywhere.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <cstdint>

namespace osgTessLOD::bake {

/// A well mixed 32-bit hash of a lattice cell.
inline std::uint32_t cellHash(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t seed)
{
    std::uint32_t h = static_cast<std::uint32_t>(x) * 0x8DA6B343U ^ static_cast<std::uint32_t>(y) * 0xD8163841U ^
                      static_cast<std::uint32_t>(z) * 0xCB1AB31FU ^ seed * 0x9E3779B9U;
    h = (h ^ (h >> 15)) * 0x2C1B3C6DU;
    h = (h ^ (h >> 12)) * 0x297A2D39U;
    return h ^ (h >> 15);
}

/// Ten bits of a hash as a number in [0, 1); which = 0, 1 or 2.
inline double hashFraction(std::uint32_t hash, unsigned which)
{
    return static_cast<double>(hash >> (10 * which) & 1023U) / 1024.0;
}

inline std::int32_t floorToInt(double x)
{
    const auto truncated = static_cast<std::int32_t>(x);
    return truncated - (x < static_cast<double>(truncated) ? 1 : 0);
}

/// 0 below `low`, 1 above `high`, smooth between.
inline double smoothStep(double low, double high, double x)
{
    const double t = x <= low ? 0.0 : x >= high ? 1.0 : (x - low) / (high - low);
    return t * t * (3.0 - 2.0 * t);
}

/// Noise of wavelength about 1, in about [−1, 1], 0 on average. C² smooth.
inline double gradientNoise(const Eigen::Vector3d& p, std::uint32_t seed)
{
    const std::int32_t i = floorToInt(p.x()), j = floorToInt(p.y()), k = floorToInt(p.z());
    const double x = p.x() - i, y = p.y() - j, z = p.z() - k;
    const auto fade = [](double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); };
    const auto corner = [&](int a, int b, int c) { // slope along one of the twelve edge directions of a cube
        const std::uint32_t h = cellHash(i + a, j + b, k + c, seed) & 15U;
        const double dx = x - a, dy = y - b, dz = z - c;
        const double s = h < 8 ? dx : dy, t = h < 4 ? dy : h == 12 || h == 14 ? dx : dz;
        return (h & 1U ? -s : s) + (h & 2U ? -t : t);
    };
    const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
    const double u = fade(x), v = fade(y), w = fade(z);
    return mix(mix(mix(corner(0, 0, 0), corner(1, 0, 0), u), mix(corner(0, 1, 0), corner(1, 1, 0), u), v),
               mix(mix(corner(0, 0, 1), corner(1, 0, 1), u), mix(corner(0, 1, 1), corner(1, 1, 1), u), v), w);
}

/// Fractal sum: `octaves` of noise, each twice as fine as the one before and `gain` times as high; the first is of height 1.
inline double fractalNoise(Eigen::Vector3d p, unsigned octaves, double gain, std::uint32_t seed)
{
    double sum = 0.0, amplitude = 1.0;
    for (unsigned octave = 0; octave < octaves; ++octave, amplitude *= gain) {
        sum += amplitude * gradientNoise(p, seed + octave);
        p = 2.0 * p + Eigen::Vector3d::Constant(0.37); // lattice planes of the octaves must not coincide
    }
    return sum;
}

/// Ridged multifractal (Musgrave, in "Texturing and modeling", 1994): sharp crests, with detail where it is already high.
/// About [0, 2].
inline double ridgedNoise(Eigen::Vector3d p, unsigned octaves, double gain, std::uint32_t seed)
{
    double sum = 0.0, amplitude = 1.0, weight = 1.0;
    for (unsigned octave = 0; octave < octaves; ++octave, amplitude *= gain) {
        double ridge = 1.0 - std::abs(gradientNoise(p, seed + octave));
        ridge *= ridge * weight;
        sum += amplitude * ridge;
        weight = ridge * 1.8 < 1.0 ? ridge * 1.8 : 1.0;
        p = 2.0 * p + Eigen::Vector3d::Constant(0.37);
    }
    return sum;
}

} // namespace osgTessLOD::bake
