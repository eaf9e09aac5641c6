// SPDX-License-Identifier: MIT
// Compiled once for each instruction set, by the files that include it, which give `KERNEL_NAME`. For that reason nothing here is
// from the standard library: its inline functions would be shared with files that must run everywhere.
#include <osgTessLOD/render/LevelNeedKernel.h>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace osgTessLOD::kernel {

namespace {

using Floats = float __attribute__((vector_size(32), may_alias));
using Ints = int __attribute__((vector_size(32), may_alias));

// More than rounding to single precision adds up to on the way to a tolerance or an error, relative to what it is added up of.
constexpr float kRounding = 2e-6F;

inline Floats load(const float* from)
{
    return *reinterpret_cast<const Floats*>(from);
}
inline void store(const Floats& from, float* to)
{
    *reinterpret_cast<Floats*>(to) = from;
}

inline void squareRoot(Floats& x)
{
#if defined(__AVX__)
    x = _mm256_sqrt_ps(x);
#elif defined(__SSE2__)
    auto* halves = reinterpret_cast<__m128*>(&x);
    halves[0] = _mm_sqrt_ps(halves[0]);
    halves[1] = _mm_sqrt_ps(halves[1]);
#else
    for (unsigned k = 0; k < kLanes; ++k) { x[k] = __builtin_sqrtf(x[k]); }
#endif
}

inline unsigned bits(const Ints& mask)
{
#if defined(__AVX__)
    return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<const __m256&>(mask)));
#elif defined(__SSE2__)
    const auto* halves = reinterpret_cast<const __m128*>(&mask);
    return static_cast<unsigned>(_mm_movemask_ps(halves[0]) | _mm_movemask_ps(halves[1]) << 4);
#else
    unsigned result = 0;
    for (unsigned k = 0; k < kLanes; ++k) { result |= mask[k] != 0 ? 1U << k : 0U; }
    return result;
#endif
}

/// Of lanes where `mask` is set those of `a`, else of `b`.
#define CHOOSE(mask, a, b)                                                                                             \
    reinterpret_cast<Floats>(((mask) & reinterpret_cast<Ints>(Floats(a))) |                                            \
                             (~(mask) & reinterpret_cast<Ints>(Floats(b))))
// Of NaN and b it is b.
#define LEAST(a, b) CHOOSE((a) < (b), (a), (b))
#define LARGEST(a, b) CHOOSE((a) > (b), (a), (b))

constexpr Floats kZero{0, 0, 0, 0, 0, 0, 0, 0};
constexpr Floats kOne{1, 1, 1, 1, 1, 1, 1, 1};

/// How eight spheres are seen.
struct Sight {
    Floats x, y, z;      ///< unit direction of the centres
    Floats sine, cosine; ///< of half the angle that the sphere takes up
    Floats tolerance;    ///< error that is allowed
    Floats loss;         ///< part of the isotropic error that comes on top of the error as seen
};

/// As far as cones need it: directions, sines, cosines.
inline void look(const View& view, const Spheres& spheres, Sight& sight, Floats& distance, Ints& inside)
{
    const Floats radius = load(spheres.radius);
    sight.x = load(spheres.x);
    sight.y = load(spheres.y);
    sight.z = load(spheres.z);
    sight.x = (sight.x - view.eyeHigh[0]) - view.eyeLow[0];
    sight.y = (sight.y - view.eyeHigh[1]) - view.eyeLow[1];
    sight.z = (sight.z - view.eyeHigh[2]) - view.eyeLow[2];
    distance = sight.x * sight.x + sight.y * sight.y + sight.z * sight.z;
    squareRoot(distance);
    inside = distance <= radius;
    const Floats inverse = 1.0F / LARGEST(distance, kZero + 1e-30F);
    sight.x = sight.x * inverse;
    sight.y = sight.y * inverse;
    sight.z = sight.z * inverse;
    sight.sine = CHOOSE(inside, kOne, radius * inverse);
    sight.cosine = 1.0F - sight.sine * sight.sine;
    sight.cosine = LARGEST(sight.cosine, kZero);
    squareRoot(sight.cosine);
}

inline void lookAlongAxis(const View& view, Sight& sight)
{
    sight.x = kZero + view.axis[0];
    sight.y = kZero + view.axis[1];
    sight.z = kZero + view.axis[2];
    sight.sine = kZero;
    sight.cosine = kOne;
}

inline void see(const View& view, const Spheres& spheres, Sight& sight)
{
    if (view.orthographic) {
        lookAlongAxis(view, sight);
        sight.tolerance = kZero + view.slope;
        sight.loss = kZero;
        return;
    }
    Floats distance;
    Ints inside;
    look(view, spheres, sight, distance, inside);
    if (!view.conservative) {
        sight.tolerance = view.slope * distance;
        sight.loss = kZero;
        return;
    }
    const Floats radius = load(spheres.radius);
    Floats axial = sight.x * view.axis[0] + sight.y * view.axis[1] + sight.z * view.axis[2];
    axial = LARGEST(axial, -kOne);
    axial = LEAST(axial, kOne);
    Floats across = 1.0F - axial * axial;
    squareRoot(across);
    Floats leastCosine = axial * sight.cosine - across * sight.sine;
    leastCosine = LARGEST(leastCosine, kZero + view.leastCosine);
    const Floats byDepth = distance * axial - radius;
    const Floats byDistance = (distance - radius) * leastCosine;
    Floats leastDepth = LARGEST(byDepth, byDistance) - kRounding * (distance + radius);
    leastDepth = CHOOSE(leastDepth < kZero, kZero, leastDepth); // NaN stays
    sight.loss = view.slope * leastCosine;
    sight.tolerance = CHOOSE(inside, kZero, sight.loss * leastDepth * (1.0F - kRounding));
}

inline void errorOf(const View& view, const Sight& sight, const Errors& errors, Floats& error)
{
    const Floats most = load(errors.isotropic);
    if (view.isotropic) {
        error = most + most * sight.loss;
        return;
    }
    const auto q = [&](unsigned k) { return load(errors.q[k]); };
    const Floats& x = sight.x;
    const Floats& y = sight.y;
    const Floats& z = sight.z;
    const Floats form =
        (q(0) * x * x + q(1) * y * y + q(2) * z * z) + 2.0F * (q(3) * x * y + q(4) * x * z + q(5) * y * z);
    const Floats square = most * most;
    const Floats seenFromSomewhere = square * (sight.cosine * sight.cosine);
    Floats squared = LARGEST(form, kZero);
    if (view.conservative) { squared = squared + kRounding * square; }
    squared = LEAST(squared, seenFromSomewhere);
    Floats rest = square - squared;
    rest = LARGEST(rest, kZero);
    squareRoot(squared);
    squareRoot(rest);
    const Floats widened = squared * sight.cosine + rest * sight.sine;
    error = LEAST(widened, most) + most * sight.loss;
}

/// Of eight patches.
struct Search {
    const View& view;
    const Sight& sight;
    const Errors* errors;

    /// How much of the way from a level to the next finer one is to be gone: 0, where the level does, to 1.
    void progressAt(int level, Floats& part) const
    {
        Floats error;
        errorOf(view, sight, errors[level], error);
        Floats enough;
        Floats width;
        if (view.conservative) {
            enough = error * 1.1F;
            width = error * 0.1F;
        } else {
            Floats finer = kZero;
            if (level + 1 < view.levelCount) { errorOf(view, sight, errors[level + 1], finer); }
            enough = error;
            width = error - finer;
        }
        part = (enough - sight.tolerance) / width;
        part = LEAST(part, kOne);
        part = CHOOSE(enough > sight.tolerance, part, kZero); // NaN gives 0
    }
};

void needs(const View& view, const Spheres& spheres, const Errors* errors, int& hint, float* result)
{
    Sight sight;
    see(view, spheres, sight);
    const Search search{view, sight, errors};
    const int start = hint > view.top ? view.top : hint;
    Floats part;
    search.progressAt(start, part);
    Ints asks = part > kZero;
    Floats need = CHOOSE(asks, part + static_cast<float>(start), kZero);
    // What asks for more than half of a level asks for all of those below, and may ask for some of the next.
    Floats last = part;
    for (int level = start; level < view.top && bits(last > 0.5F) != 0;) {
        ++level;
        search.progressAt(level, last);
        const Ints more = last > kZero;
        need = CHOOSE(more, last + static_cast<float>(level), need);
        asks = asks | more;
    }
    for (int level = start; level > 0 && bits(asks) != (1U << kLanes) - 1;) {
        --level;
        search.progressAt(level, part);
        const Ints taken = (part > kZero) & ~asks;
        need = CHOOSE(taken, part + static_cast<float>(level), need);
        asks = asks | taken;
    }
    need = LEAST(need, kZero + view.most);
    store(need, result);
    hint = static_cast<int>(need[0]);
}

unsigned behind(const float* plane, const Spheres& spheres)
{
    const Floats x = load(spheres.x);
    const Floats y = load(spheres.y);
    const Floats z = load(spheres.z);
    const Floats radius = load(spheres.radius);
    const Floats distance = x * plane[0] + y * plane[1] + z * plane[2] + plane[3];
    const Floats size = LARGEST(x, -x) + LARGEST(y, -y) + LARGEST(z, -z);
    return bits(distance + radius + kRounding * size < -kRounding * (plane[3] < 0.0F ? -plane[3] : plane[3]));
}

unsigned hidden(const View& view, const Spheres& spheres, const ConeAxes& axes, const Lanes& cosines, float sign)
{
    Sight sight;
    if (view.orthographic) {
        lookAlongAxis(view, sight);
    } else {
        Floats distance;
        Ints inside;
        look(view, spheres, sight, distance, inside);
    }
    const Floats x = load(axes.x);
    const Floats y = load(axes.y);
    const Floats z = load(axes.z);
    const Floats cosine = load(cosines.at);
    Floats sine = 1.0F - cosine * cosine;
    sine = LARGEST(sine, kZero);
    squareRoot(sine);
    constexpr float kSlack = 1e-5F;
    const Floats along = (x * sight.x + y * sight.y + z * sight.z) * sign;
    const Floats sineOfBoth = sine * sight.cosine + cosine * sight.sine;
    const Floats cosineOfBoth = cosine * sight.cosine - sine * sight.sine;
    return bits((along > sineOfBoth + kSlack) & (cosineOfBoth > kSlack));
}

unsigned levels(const View& view, const Borders& borders, const float* needs, std::uint32_t stride, std::uint32_t first,
                float cap, Levels& result)
{
    Floats most = kZero;
    Floats drawn = kZero;
    for (std::uint32_t side = 0; side < 3; ++side) {
        alignas(32) float opposite[kLanes];
        for (unsigned k = 0; k < kLanes; ++k) {
            opposite[k] = needs[borders.twinSides[side][k] * stride + borders.twins[side][k]];
        }
        const Floats own = load(needs + side * stride + first);
        const Floats other = load(opposite);
        const Floats finest = load(borders.finest[side]);
        most = LARGEST(most, own);
        Floats level = LARGEST(own, other);
        level = LEAST(level, finest);
        level = LEAST(level, kZero + cap);
        const Floats coarsest = load(borders.coarsest[side]);
        level = LARGEST(level, coarsest);
        store(level, result.edges[side]);
        drawn = LARGEST(drawn, level);
    }
    const Ints whole = __builtin_convertvector(drawn, Ints);
    const Ints ceiling = whole - (drawn > __builtin_convertvector(whole, Floats)); // true is −1
    *reinterpret_cast<Ints*>(result.drawn) = ceiling;
    Floats reach = load(borders.reach);
    reach = LEAST(reach, kZero + cap);
    return view.conservative ? bits(most >= reach + 1.0F) : bits(most > reach);
}

#undef CHOOSE
#undef LEAST
#undef LARGEST

} // namespace

extern const Kernel KERNEL_NAME;
const Kernel KERNEL_NAME{needs, behind, hidden, levels};

} // namespace osgTessLOD::kernel
