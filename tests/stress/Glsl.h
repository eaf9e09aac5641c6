// SPDX-License-Identifier: MIT
// As much of GLSL as it takes to compile the shared texts of shaders/ as C++, with Twin for float. Swizzles are macros, see
// ShaderTwins.h.
#pragma once

#include <stress/TwinNumber.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace osgTessLOD::stress::glsl {

using std::size_t;
using uint = std::uint32_t;

template <typename T, size_t N> struct Vec;

/// What some components of a vector are, and may be set to.
template <typename T, size_t N> struct Swizzle : Vec<T, N> {
    std::array<T*, N> targets;
    void operator=(const Vec<T, N>& v)
    {
        for (size_t k = 0; k < N; ++k) { *targets[k] = v[k]; }
    }
};

template <typename T, size_t N> struct Components {
    T x, y;
};
template <typename T> struct Components<T, 1> {
    T x;
};
template <typename T> struct Components<T, 3> {
    T x, y, z;
};
template <typename T> struct Components<T, 4> {
    union {
        T x, r;
    };
    T y, z;
    union {
        T w, a;
    };
};

template <typename T, size_t N> struct Vec : Components<T, N> {
    Vec() = default;
    /// Of numbers and vectors, one after the other; or all of them one number.
    template <typename... Parts> explicit Vec(const Parts&... parts)
    {
        size_t at = 0;
        (append(at, parts), ...);
        for (; at < N; ++at) { (*this)[at] = (*this)[0]; }
    }

    T& operator[](size_t k) { return reinterpret_cast<T*>(this)[k]; }
    const T& operator[](size_t k) const { return reinterpret_cast<const T*>(this)[k]; }
    T& operator[](int k) { return (*this)[static_cast<size_t>(k)]; }
    const T& operator[](int k) const { return (*this)[static_cast<size_t>(k)]; }

    template <size_t... I> Vec<T, sizeof...(I)> swizzle() const
    {
        Vec<T, sizeof...(I)> v;
        size_t at = 0;
        ((v[at++] = (*this)[I]), ...);
        return v;
    }
    template <size_t... I> Swizzle<T, sizeof...(I)> swizzle()
    {
        Swizzle<T, sizeof...(I)> v;
        static_cast<Vec<T, sizeof...(I)>&>(v) = static_cast<const Vec&>(*this).template swizzle<I...>();
        v.targets = {&(*this)[I]...};
        return v;
    }

private:
    template <typename U> void append(size_t& at, const U& number)
    {
        if (at < N) { (*this)[at++] = static_cast<T>(number); }
    }
    template <typename U, size_t M> void append(size_t& at, const Vec<U, M>& v)
    {
        for (size_t k = 0; k < M; ++k) { append(at, v[k]); }
    }
    template <typename U, size_t M> void append(size_t& at, const Swizzle<U, M>& v)
    {
        append(at, static_cast<const Vec<U, M>&>(v));
    }
};

/// T, but not a place to deduce it from.
template <typename T> struct Same {
    using Type = T;
};
template <typename T> using Scalar = typename Same<T>::Type;

#define GLSL_OPERATOR(op)                                                                                              \
    template <typename T, size_t N> Vec<T, N> operator op(const Vec<T, N>& a, const Vec<T, N>& b)                      \
    {                                                                                                                  \
        Vec<T, N> v;                                                                                                   \
        for (size_t k = 0; k < N; ++k) { v[k] = a[k] op b[k]; }                                                        \
        return v;                                                                                                      \
    }                                                                                                                  \
    template <typename T, size_t N> Vec<T, N> operator op(const Vec<T, N>& a, const Scalar<T>& b)                      \
    {                                                                                                                  \
        return a op Vec<T, N>(b);                                                                                      \
    }                                                                                                                  \
    template <typename T, size_t N> Vec<T, N> operator op(const Scalar<T>& a, const Vec<T, N>& b)                      \
    {                                                                                                                  \
        return Vec<T, N>(a) op b;                                                                                      \
    }                                                                                                                  \
    template <typename T, size_t N, typename B> Vec<T, N>& operator op##=(Vec<T, N>& a, const B& b)                    \
    {                                                                                                                  \
        return a = a op b;                                                                                             \
    }
GLSL_OPERATOR(+)
GLSL_OPERATOR(-)
GLSL_OPERATOR(*)
GLSL_OPERATOR(/)
#undef GLSL_OPERATOR

template <typename T, size_t N> Vec<T, N> operator-(const Vec<T, N>& a)
{
    Vec<T, N> v;
    for (size_t k = 0; k < N; ++k) { v[k] = -a[k]; }
    return v;
}

using vec2 = Vec<Twin, 2>;
using vec3 = Vec<Twin, 3>;
using vec4 = Vec<Twin, 4>;
using ivec2 = Vec<int, 2>;
using ivec3 = Vec<int, 3>;
using ivec4 = Vec<int, 4>;
using uvec2 = Vec<uint, 2>;
using uvec4 = Vec<uint, 4>;

/// Of columns.
struct mat3 {
    std::array<vec3, 3> columns;
    explicit mat3(double diagonal)
    {
        for (size_t k = 0; k < 3; ++k) {
            columns[k] = vec3(0.0);
            columns[k][k] = diagonal;
        }
    }
    mat3(const vec3& a, const vec3& b, const vec3& c)
        : columns{a, b, c}
    {
    }
    vec3& operator[](int k) { return columns[static_cast<size_t>(k)]; }
    const vec3& operator[](int k) const { return columns[static_cast<size_t>(k)]; }
};

inline Twin dot(const vec3& a, const vec3& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Twin dot(const vec4& a, const vec4& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
}
inline vec3 operator*(const vec3& v, const mat3& m)
{
    return vec3(dot(v, m[0]), dot(v, m[1]), dot(v, m[2]));
}
inline vec3 cross(const vec3& a, const vec3& b)
{
    return vec3(a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y);
}
inline Twin length(const vec3& v)
{
    return sqrt(dot(v, v));
}
inline vec3 normalize(const vec3& v)
{
    return v * inversesqrt(dot(v, v));
}
template <size_t N> Vec<Twin, N> abs(const Vec<Twin, N>& a)
{
    Vec<Twin, N> v;
    for (size_t k = 0; k < N; ++k) { v[k] = abs(a[k]); }
    return v;
}
template <size_t N> Vec<Twin, N> max(const Vec<Twin, N>& a, const Vec<Twin, N>& b)
{
    Vec<Twin, N> v;
    for (size_t k = 0; k < N; ++k) { v[k] = max(a[k], b[k]); }
    return v;
}
template <size_t N> Vec<Twin, N> clamp(const Vec<Twin, N>& a, const Twin& low, const Twin& high)
{
    Vec<Twin, N> v;
    for (size_t k = 0; k < N; ++k) { v[k] = clamp(a[k], low, high); }
    return v;
}
template <size_t N> Vec<Twin, N> mix(const Vec<Twin, N>& a, const Vec<Twin, N>& b, const Twin& t)
{
    return a * (Twin(1.0) - t) + b * t;
}
inline int min(int a, int b)
{
    return a < b ? a : b;
}
inline int clamp(int a, int low, int high)
{
    return a < low ? low : a > high ? high : a;
}

inline Twin uintBitsToFloat(uint bits)
{
    float value = 0.0F;
    std::memcpy(&value, &bits, sizeof value);
    return Twin::given(value);
}
template <size_t N> Vec<Twin, N> uintBitsToFloat(const Vec<uint, N>& bits)
{
    Vec<Twin, N> v;
    for (size_t k = 0; k < N; ++k) { v[k] = uintBitsToFloat(bits[k]); }
    return v;
}

template <typename Texel> struct TexelArray {
    std::vector<Texel> texels;
};
using samplerBuffer = TexelArray<vec4>;
using isamplerBuffer = TexelArray<ivec4>;
using usamplerBuffer = TexelArray<uvec4>;
template <typename Texel> const Texel& texelFetch(const TexelArray<Texel>& buffer, int index)
{
    return buffer.texels.at(static_cast<size_t>(index));
}

} // namespace osgTessLOD::stress::glsl
