// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/BuiltinShape.h>

#include <osgTessLOD/bake/GradientNoise.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

// ----------------------------------------------------------------------------------------------------- asteroid ---

/// Craters of one range of sizes, spread evenly over the unit sphere, and a hash grid to find those near a point.
class CraterLayer {
public:
    /// Radii between half of `largestRadius` and it; they cover about a third of the sphere.
    CraterLayer(double largestRadius, std::uint32_t seed) : _cellSize(2.0 * kReach * largestRadius)
    {
        const auto count = static_cast<std::int32_t>(1.6 / (largestRadius * largestRadius));
        std::vector<std::pair<std::uint64_t, std::uint32_t>> entries; // cell, crater
        for (std::int32_t i = 0; i < count; ++i) {
            _craters.push_back(makeCrater(largestRadius, i, seed));
            addToCells(entries, static_cast<std::uint32_t>(i));
        }
        std::sort(entries.begin(), entries.end());
        buildTable(entries);
    }

    /// `irregular` multiplies distances; at least kApron / kReach, lest a crater reach beyond the cells it is filed under.
    double height(const Vector3d& direction, double irregular) const
    {
        const std::uint64_t key = cellKey(cellOf(direction.x()), cellOf(direction.y()), cellOf(direction.z()));
        double sum = 0.0;
        const std::size_t mask = _table.size() - 1;
        for (std::size_t slot = mixed(key) & mask; _table[slot].end != 0; slot = (slot + 1) & mask) {
            if (_table[slot].key != key) { continue; }
            for (std::uint32_t i = _table[slot].begin; i < _table[slot].end; ++i) {
                const Crater& crater = _craters[_members[i]];
                const double squared = (direction - crater.center).squaredNorm() * irregular * irregular;
                if (squared >= kApron * kApron * crater.radius * crater.radius) { continue; }
                sum += crater.freshness * crater.radius * profile(std::sqrt(squared) / crater.radius);
            }
            break;
        }
        return sum;
    }

private:
    static constexpr double kApron = 1.9;  ///< radius of the apron, in crater radii
    static constexpr double kReach = 2.4;  ///< the same, where irregularity stretches it most

    struct Crater { Vector3d center; double radius, freshness; };
    struct Cell { std::uint64_t key = 0; std::uint32_t begin = 0, end = 0; };

    static Crater makeCrater(double largestRadius, std::int32_t number, std::uint32_t seed)
    {
        const auto uniform = [&](std::int32_t which) {
            return (static_cast<double>(cellHash(number, which, 0, seed)) + 0.5) / 4294967296.0;
        };
        const double z = 2.0 * uniform(0) - 1.0, ring = std::sqrt(1.0 - z * z), angle = 2.0 * kPi * uniform(1);
        const double size = uniform(2);
        return {Vector3d(ring * std::cos(angle), ring * std::sin(angle), z), largestRadius * (0.5 + 0.5 * size * size),
                0.30 + 0.70 * uniform(3)};
    }

    std::int32_t cellOf(double coordinate) const { return floorToInt(coordinate / _cellSize) + (1 << 20); }
    static std::uint64_t cellKey(std::int32_t x, std::int32_t y, std::int32_t z)
    {
        return static_cast<std::uint64_t>(x) << 42 | static_cast<std::uint64_t>(y) << 21 | static_cast<std::uint64_t>(z);
    }
    static std::uint64_t mixed(std::uint64_t key)
    {
        key *= 0x9E3779B97F4A7C15U;
        return key ^ (key >> 29);
    }

    /// A crater goes into every cell that the box around its reach touches.
    void addToCells(std::vector<std::pair<std::uint64_t, std::uint32_t>>& entries, std::uint32_t number) const
    {
        const Crater& crater = _craters[number];
        const Vector3d low = crater.center.array() - kReach * crater.radius;
        const Vector3d high = crater.center.array() + kReach * crater.radius;
        for (std::int32_t x = cellOf(low.x()); x <= cellOf(high.x()); ++x) {
            for (std::int32_t y = cellOf(low.y()); y <= cellOf(high.y()); ++y) {
                for (std::int32_t z = cellOf(low.z()); z <= cellOf(high.z()); ++z) {
                    entries.emplace_back(cellKey(x, y, z), number);
                }
            }
        }
    }

    void buildTable(const std::vector<std::pair<std::uint64_t, std::uint32_t>>& entries)
    {
        std::size_t capacity = 16;
        while (capacity < 2 * entries.size()) { capacity *= 2; }
        _table.resize(capacity);
        _members.reserve(entries.size());
        for (std::size_t i = 0; i < entries.size();) {
            Cell cell;
            cell.key = entries[i].first;
            cell.begin = static_cast<std::uint32_t>(i);
            for (; i < entries.size() && entries[i].first == cell.key; ++i) { _members.push_back(entries[i].second); }
            cell.end = static_cast<std::uint32_t>(i);
            std::size_t slot = mixed(cell.key) & (capacity - 1);
            while (_table[slot].end != 0) { slot = (slot + 1) & (capacity - 1); }
            _table[slot] = cell;
        }
    }

    /// Height over the distance from the centre, both in crater radii: a bowl with a flat floor, a sharp rim at 1, and an
    /// apron.
    static double profile(double t)
    {
        constexpr double kRim = 0.10, kDepth = 0.30;
        if (t < 1.0) { return std::max(-kDepth + 0.04 * t, kRim - 1.3 * (kRim + kDepth) * (1.0 - t * t)); }
        const double s = (kApron - t) / (kApron - 1.0);
        return kRim * s * s * s;
    }

    double _cellSize;
    std::vector<Crater> _craters;
    std::vector<std::uint32_t> _members;
    std::vector<Cell> _table;              ///< open addressing; end = 0 marks a free slot
};

class AsteroidShape final : public BuiltinShape {
public:
    explicit AsteroidShape(unsigned extraOctaves) : _extraOctaves(extraOctaves)
    {
        // Each layer has four times the craters of the one before: what is finer still is left to the noise.
        double radius = 0.46;
        for (unsigned octave = 0; octave < 6 + std::min(extraOctaves, 2U); ++octave, radius *= 0.5) {
            _craters.emplace_back(radius, 61 + octave);
        }
    }

    Vector3d position(const Vector3d& direction) const override
    {
        const Vector3d warped = direction + 0.10 * gradientNoise(2.1 * direction, 11) * Vector3d(1.0, -0.7, 0.4);
        double radius = 1.0 + 0.17 * fractalNoise(1.15 * warped, 3, 0.45, 21);
        const double irregular = 1.0 + 0.10 * gradientNoise(5.0 * direction, 51) + 0.05 * gradientNoise(17.0 * direction, 52);
        for (const CraterLayer& layer : _craters) { radius += layer.height(direction, irregular); }
        radius += 0.006 * (ridgedNoise(5.0 * warped, 4 + _extraOctaves, 0.5, 31) - 0.9);
        radius += 0.0025 * fractalNoise(23.0 * direction, 2 + _extraOctaves, 0.55, 41);
        return radius * Vector3d(1.22 * direction.x(), 0.93 * direction.y(), 0.86 * direction.z());
    }

private:
    unsigned _extraOctaves;
    std::vector<CraterLayer> _craters;     ///< largest first
};

// ------------------------------------------------------------------------------------------------------- bricks ---

class BricksShape final : public BuiltinShape {
public:
    explicit BricksShape(unsigned extraOctaves) : _extraOctaves(extraOctaves) {}

    Vector3d position(const Vector3d& point) const override
    {
        const Brick brick = brickAt(point);
        const Profile profile = profileAt(brick.edge, brick.arris);
        const Vector3d inBrick(point.x(), point.y(), 7.3 * hashFraction(brick.hash, 2));
        const double chips = smoothStep(0.15, 0.75, gradientNoise(9.0 * inBrick, 71));
        const double wear = 1.0 - 0.55 * chips;

        Vector3d result = point;
        result.x() += wear * profile.outward * brick.outward[0];
        result.y() += wear * profile.outward * brick.outward[1];
        result.z() += kHeight * profile.height;

        const double face = smoothStep(kMortar, kPlateau, brick.edge);
        const double tilt = 0.10 * (hashFraction(brick.hash, 0) - 0.5) * brick.fromCenter[0] +
                            0.16 * (hashFraction(brick.hash, 1) - 0.5) * brick.fromCenter[1];
        const double pits = smoothStep(0.35, 0.7, gradientNoise(19.0 * inBrick, 72));
        const double rough = 0.012 * fractalNoise(7.0 * inBrick, 4 + _extraOctaves, 0.55, 81);
        result.z() += face * (tilt + 0.05 * (hashFraction(brick.hash, 1) - 0.5) - 0.025 * pits - 0.035 * chips + rough);
        result.z() += (1.0 - face) * 0.012 * fractalNoise(13.0 * point, 3 + _extraOctaves, 0.6, 91);
        return result;
    }

private:
    static constexpr double kHalfWidth = 0.5, kHalfHeight = 0.25, kHeight = 0.13;
    static constexpr double kMortar = 0.045, kPlateau = 0.15; ///< distances from the middle of the joint

    struct Brick {
        std::uint32_t hash;
        double edge;                        ///< 0 in the middle of the joint, rising into the brick
        std::array<double, 2> fromCenter;
        std::array<double, 2> outward;      ///< −gradient of edge
        double arris;                       ///< 0 rounded … 1 sharp
    };

    /// Running bond of bricks 1 × 0.5. `edge` is the smooth minimum (a⁻⁸ + b⁻⁸)^(−1/8) of the distances a, b from the
    /// joints' middles, which is exactly 0 on both and rounds the corners.
    static Brick brickAt(const Vector3d& point)
    {
        const std::int32_t row = floorToInt(point.y() / (2.0 * kHalfHeight));
        const double shifted = point.x() + (row & 1 ? kHalfWidth : 0.0);
        const std::int32_t column = floorToInt(shifted / (2.0 * kHalfWidth));
        Brick brick;
        brick.hash = cellHash(column, row, 0, 101);
        brick.fromCenter = {shifted - (2.0 * column + 1.0) * kHalfWidth, point.y() - (2.0 * row + 1.0) * kHalfHeight};
        const double a = std::max(kHalfWidth - std::abs(brick.fromCenter[0]), 0.0);
        const double b = std::max(kHalfHeight - std::abs(brick.fromCenter[1]), 0.0);
        const auto eighth = [](double x) { return x * x * x * x * (x * x * x * x); };
        const double a8 = eighth(a), b8 = eighth(b), sum8 = a8 + b8;
        const auto root8 = [](double x) { return std::sqrt(std::sqrt(std::sqrt(x))); };
        // edge⁸ = a⁸b⁸ / (a⁸ + b⁸), and ∂edge/∂a = (edge/a)⁹ = (b⁸/(a⁸ + b⁸))^(9/8)
        const auto slope = [&](double ratio) { return ratio * root8(ratio); };
        brick.edge = sum8 > 0.0 ? a * b / root8(sum8) : 0.0;
        brick.outward = {sum8 > 0.0 ? std::copysign(slope(b8 / sum8), brick.fromCenter[0]) : 0.0,
                         sum8 > 0.0 ? std::copysign(slope(a8 / sum8), brick.fromCenter[1]) : 0.0};
        brick.arris = hashFraction(cellHash(column, row, 1, 101), 0);
        return brick;
    }

    struct Profile {
        double outward; ///< sideways, towards the joint's middle
        double height;  ///< 0 floor of the joint … 1 face of the brick
    };

    /// Cross-section of half a joint, as a polygon whose corners the reference samples about four times each way:
    ///
    ///     face ─────────────╮ arris
    ///                       │            ρ: distance from the middle of the joint
    ///            undercut ╭─╯ lip
    ///     mortar      ────╯───────
    ///
    /// outward = edge − ρ, so that it vanishes in the middle of the joint and on the face.
    static Profile profileAt(double edge, double arris)
    {
        struct Knot { double edge, rho, height; };
        const std::array<Knot, 8> knots{{{0.0, 0.0, 0.0},
                                         {0.045, 0.075, -0.06},                          // floor, under the brick
                                         {0.060, 0.085, 0.20},                           // back of the undercut
                                         {0.080, 0.040, 0.42},                           // lip
                                         {0.098, 0.030, 0.66},
                                         {0.115, 0.036 - 0.004 * arris, 0.84 + 0.10 * arris},
                                         {0.130, 0.058 - 0.014 * arris, 0.96 + 0.04 * arris}, // arris
                                         {kPlateau, 0.105, 1.0}}};
        if (edge >= kPlateau) {
            // The face takes up again what the edge left behind, until outward vanishes well inside the brick.
            const double left = (kPlateau - 0.105) * (1.0 - smoothStep(kPlateau, 0.25, edge));
            return {left, 1.0};
        }
        std::size_t k = 0;
        while (edge > knots[k + 1].edge) { ++k; }
        const double t = (edge - knots[k].edge) / (knots[k + 1].edge - knots[k].edge);
        const double rho = knots[k].rho + t * (knots[k + 1].rho - knots[k].rho);
        return {edge - rho, knots[k].height + t * (knots[k + 1].height - knots[k].height)};
    }

    unsigned _extraOctaves;
};

// ----------------------------------------------------------------------------------------------------- seashell ---

/// A tube around a conical spiral that grows by the same factor every turn (Fowler, Meinhardt, Prusinkiewicz: "Modeling
/// seashells", 1992), with ornaments that grow along. Lengths are relative to the tube's local scale.
class SeashellShape final : public BuiltinShape {
public:
    explicit SeashellShape(unsigned extraOctaves) : _extraOctaves(extraOctaves) {}

    Vector3d position(const Vector3d& direction) const override
    {
        const Section s = sectionAt(direction);
        const Vector3d radial(std::cos(s.turn), std::sin(s.turn), 0.0), along(-radial.y(), radial.x(), 0.0);
        const Vector3d center(kCenterRadius * radial.x(), kCenterRadius * radial.y(), -kDescent);

        double radius = kTubeRadius * (1.0 - s.wall);
        radius *= 1.0 + 0.45 * flare(s.turn) * (0.5 + 0.5 * s.cosine);
        radius += canal(s);
        radius += s.ornament * relief(s);
        // No thorns on the lip itself: the wall is too thin there to hold both their sides.
        const double spine = s.ornament * (1.0 - smoothStep(kLastTurn - 0.5, kLastTurn - 0.1, s.turn)) * spines(s);
        const double outwards = keptOffAxis((radius + spine) * s.cosine, s.wall);
        const Vector3d offset = outwards * radial + (radius + spine) * s.sine * Vector3d::UnitZ() - kCurl * spine * spine * along;
        return std::exp(kGrowth * (s.turn - kLastTurn)) * (center + s.taper * offset);
    }

private:
    static constexpr double kTurns = 4.5, kLastTurn = 2.0 * kPi * kTurns;
    static constexpr double kGrowth = 0.64185388617239477 / (2.0 * kPi);   ///< ln 1.9 per turn
    static constexpr double kCenterRadius = 0.47, kDescent = 1.36, kTubeRadius = 0.5;
    static constexpr double kLip = 9.0 / 11.0, kTipCap = 0.4 / 11.0, kInsideAngle = 3.4, kCurl = 2.4;

    struct Section {
        double turn;         ///< angle around the axis
        double angle;        ///< around the tube: 0 outwards, π/2 towards the tip
        double cosine, sine; ///< of angle
        double taper;        ///< 1 along the tube, 0 at its two ends
        double wall;         ///< thickness of the shell, 0 outside
        double ornament;     ///< 1 outside, 0 inside
    };

    static Section sectionAt(const Vector3d& direction)
    {
        Section s{};
        const double rho = std::sqrt(direction.x() * direction.x() + direction.y() * direction.y());
        const double u = std::atan2(rho, direction.z()) / kPi;
        s.cosine = rho > 0.0 ? direction.x() / rho : 1.0;
        s.sine = rho > 0.0 ? direction.y() / rho : 0.0;
        s.angle = std::atan2(s.sine, s.cosine);
        if (u <= kLip) {
            s.turn = kLastTurn * u / kLip;
            s.taper = u < kTipCap ? std::sin(0.5 * kPi * u / kTipCap) : 1.0;
            s.ornament = smoothStep(0.04, 0.25, u);
        } else {
            const double t = (u - kLip) / (1.0 - kLip);
            s.turn = kLastTurn - kInsideAngle * t;
            s.taper = t > 0.75 ? std::cos(2.0 * kPi * (std::min(t, 1.0) - 0.75)) : 1.0;
            s.wall = 0.14 * smoothStep(-0.12, 0.25, t) - 0.14 * smoothStep(-0.12, 0.25, 0.0);
            s.ornament = 1.0 - smoothStep(0.0, 0.12, t);
        }
        return s;
    }

    /// Distance outwards from the tube's middle, kept from crossing the axis: a smooth maximum with the pillar's surface.
    static double keptOffAxis(double outwards, double wall)
    {
        const double pillar = -kCenterRadius + 0.06 + 0.4 * wall, difference = outwards - pillar;
        return pillar + 0.5 * (difference + std::sqrt(difference * difference + 0.002));
    }

    /// The last part of the tube opens.
    static double flare(double turn)
    {
        const double t = std::max(0.0, (turn - (kLastTurn - 0.9)) / 0.9);
        return t * t;
    }

    /// Spout at the lower end of the mouth.
    static double canal(const Section& s)
    {
        double away = s.angle + 0.56 * kPi;
        away -= away > kPi ? 2.0 * kPi : 0.0;
        const double t = away / 0.42;
        return 1.15 * smoothStep(kLastTurn - 2.6, kLastTurn, s.turn) * (1.0 - 0.5 * s.wall) * std::exp(-t * t);
    }

    /// Ribs across the whorl, cords along it, growth lines, and roughness.
    double relief(const Section& s) const
    {
        const double ribPhase = s.turn * kRibsPerTurn / (2.0 * kPi) + 0.25 * s.sine;
        const double inRib = ribPhase - std::floor(ribPhase);
        const double rib = inRib < 0.7 ? inRib / 0.7 : (1.0 - inRib) / 0.3;
        const double cords = std::abs(std::cos(9.0 * s.angle));
        const Vector3d p(s.turn * 2.2, 1.4 * s.cosine, 1.4 * s.sine);
        const double lines = gradientNoise(Vector3d(s.turn * 26.0, 1.1 * s.cosine, 1.1 * s.sine), 111);
        return (0.5 + 0.5 * s.cosine) * 0.075 * rib * rib + 0.028 * cords * cords + 0.007 * lines +
               0.012 * fractalNoise(2.5 * p, 4 + _extraOctaves, 0.55, 121);
    }

    /// Height of the thorns: three rows, one thorn on every second rib.
    static double spines(const Section& s)
    {
        struct Row { double angle, height, shift; };
        constexpr std::array<Row, 3> kRows{{{0.72, 0.50, 0.0}, {0.02, 0.34, 0.0}, {-0.62, 0.26, 0.0}}};
        double height = 0.0;
        for (const Row& row : kRows) {
            const double phase = s.turn * (0.5 * kRibsPerTurn) / (2.0 * kPi) + 0.125 * s.sine + row.shift;
            const double inCell = phase - std::floor(phase) - 0.5;
            const double across = (s.angle - row.angle) / 0.30, alongTube = inCell / 0.26;
            const double squared = across * across + alongTube * alongTube;
            if (squared >= 1.0) { continue; }
            const double t = 1.0 - std::sqrt(squared);
            height += row.height * t * std::sqrt(t);
        }
        return height;
    }

    static constexpr double kRibsPerTurn = 14.0;
    unsigned _extraOctaves;
};

// ------------------------------------------------------------------------------------------------------ glacier ---

class GlacierShape final : public BuiltinShape {
public:
    explicit GlacierShape(unsigned extraOctaves) : _extraOctaves(extraOctaves) {}

    Vector3d position(const Vector3d& point) const override
    {
        const double valley = centerLine(point.y());
        const double away = std::abs(point.x() - valley + 0.12 * gradientNoise(1.6 * point, 131));
        const double rock = mountains(point, away);
        const double ice = iceLevel(point, point.x() - valley, away);
        return Vector3d(point.x(), point.y(), std::max(rock, ice));
    }

private:
    static double centerLine(double y) { return 2.0 + 0.55 * std::sin(1.15 * y + 0.4) + 0.12 * std::sin(3.1 * y); }
    static double descent(double y) { return 0.14 * (y - 2.0); } ///< the valley falls towards −y

    /// Ridged crests, lowered to a U-shaped trough along the valley.
    double mountains(const Vector3d& point, double away) const
    {
        const Vector3d warp(gradientNoise(0.9 * point, 141), gradientNoise(0.9 * point, 142), 0.0);
        const Vector3d p = point + 0.28 * warp;
        double height = 0.62 * ridgedNoise(0.62 * p, 8 + _extraOctaves, 0.46, 151) - 0.15;
        height += 0.06 * fractalNoise(2.3 * p, 3, 0.5, 171);
        const double trough = away / 0.62;
        const double carved = 0.05 + 0.55 * std::pow(trough, 3.2) + 0.20 * height;
        // smooth minimum of the crests and the trough's wall
        const double blend = std::clamp(0.5 + 0.5 * (carved - height) / 0.16, 0.0, 1.0);
        return descent(point.y()) + carved + blend * (height - carved) - 0.16 * blend * (1.0 - blend) * 0.5;
    }

    /// The ice: bulging a little, striped by moraines along the flow, broken by crevasses across it.
    double iceLevel(const Vector3d& point, double sideways, double away) const
    {
        double level = descent(point.y()) + 0.24 - 0.16 * away * away;
        const double across = 9.0 * sideways + 0.3 * std::sin(2.0 * point.y());
        const double stripes = gradientNoise(Vector3d(across, 0.5 * point.y(), 0.5), 181);
        level += 0.016 * smoothStep(0.25, 0.6, stripes);
        const double bow = point.y() + 0.45 * away * away; // crevasses bend, the middle flows faster
        const double phase = 11.0 * bow + 0.8 * gradientNoise(3.0 * point, 191);
        const double inCell = std::abs(phase - std::floor(phase) - 0.5);
        const double broken = smoothStep(-0.1, 0.35, gradientNoise(1.3 * point, 192));
        level -= 0.035 * broken * (1.0 - smoothStep(0.0, 0.16, inCell));
        return level + 0.004 * fractalNoise(12.0 * point, 3 + _extraOctaves, 0.55, 201);
    }

    unsigned _extraOctaves;
};

} // namespace

std::unique_ptr<BuiltinShape> makeAsteroidShape(unsigned extraOctaves)
{
    return std::make_unique<AsteroidShape>(extraOctaves);
}

std::unique_ptr<BuiltinShape> makeBricksShape(unsigned extraOctaves)
{
    return std::make_unique<BricksShape>(extraOctaves);
}

std::unique_ptr<BuiltinShape> makeSeashellShape(unsigned extraOctaves)
{
    return std::make_unique<SeashellShape>(extraOctaves);
}

std::unique_ptr<BuiltinShape> makeGlacierShape(unsigned extraOctaves)
{
    return std::make_unique<GlacierShape>(extraOctaves);
}

} // namespace osgTessLOD::bake
