// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/Placements.h>

#include <osgTessLOD/render/DrawContext.h>

#include <osg/Notify>
#include <osg/State>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace osgTessLOD {

namespace {

constexpr float kRounding = 1e-6F; ///< relative to the sizes of numbers: some units in the last place

bool canBeDrawn(const osg::Matrixd& m)
{
    constexpr double kMost = std::numeric_limits<float>::max();
    const bool isFinite = std::all_of(m.ptr(), m.ptr() + 16, [](double v) { return std::fabs(v) <= kMost; });
    return isFinite && m(0, 3) == 0.0 && m(1, 3) == 0.0 && m(2, 3) == 0.0 && m(3, 3) == 1.0;
}

std::vector<std::uint32_t> numbersOfDrawn(const std::vector<osg::Matrixd>& matrices, const osg::BoundingBox& bounds)
{
    std::vector<std::uint32_t> numbers;
    for (std::uint32_t k = 0; k < matrices.size() && bounds.valid(); ++k) {
        if (canBeDrawn(matrices[k])) { numbers.push_back(k); }
    }
    return numbers;
}

/// Around the placed box.
BoundSphere sphereOf(const osg::Matrixd& matrix, const osg::BoundingBox& bounds)
{
    const osg::Vec3d center = osg::Vec3d(bounds.center()) * matrix;
    double radius = 0.0;
    for (unsigned corner = 0; corner < 8; ++corner) {
        radius = std::max(radius, (osg::Vec3d(bounds.corner(corner)) * matrix - center).length());
    }
    const auto rounded = static_cast<float>(radius);
    return {osg::Vec3f(center), rounded + kRounding * (rounded + static_cast<float>(center.length()))};
}

std::vector<BoundSphere> spheresOf(const std::vector<osg::Matrixd>& matrices, const std::vector<std::uint32_t>& drawn,
                                   const osg::BoundingBox& bounds)
{
    std::vector<BoundSphere> spheres;
    spheres.reserve(drawn.size());
    for (const std::uint32_t number : drawn) { spheres.push_back(sphereOf(matrices[number], bounds)); }
    return spheres;
}

/// How coordinate `k` of what the matrix makes of a point grows with the point's coordinates.
osg::Vec3d gradient(const osg::Matrixd& m, int k)
{
    return {m(0, k), m(1, k), m(2, k)};
}

void addTexels(const osg::Matrixd& m, osg::Vec4Array& texels)
{
    const std::array<osg::Vec3d, 3> rows{gradient(m, 0), gradient(m, 1), gradient(m, 2)};
    for (int k = 0; k < 3; ++k) { texels.push_back(osg::Vec4(osg::Vec3(rows[k]), static_cast<float>(m(3, k)))); }
    // Normals go by the inverse transpose, which is the matrix of cofactors but for the determinant; their length is of no use.
    const std::array<osg::Vec3d, 3> cofactors{rows[1] ^ rows[2], rows[2] ^ rows[0], rows[0] ^ rows[1]};
    double largest = 0.0;
    for (const osg::Vec3d& row : cofactors) {
        largest = std::max({largest, std::fabs(row.x()), std::fabs(row.y()), std::fabs(row.z())});
    }
    const double sign = rows[0] * cofactors[0] < 0.0 ? -1.0 : 1.0;
    const double scale = largest > 0.0 ? sign / largest : 0.0;
    for (const osg::Vec3d& row : cofactors) {
        texels.push_back(osg::Vec4(osg::Vec3(row * scale), static_cast<float>(sign)));
    }
}

} // namespace

Placements::Placements(std::vector<osg::Matrixd> matrices, const osg::BoundingBox& bounds)
    : _matrices(std::move(matrices))
    , _drawn(numbersOfDrawn(_matrices, bounds))
    , _spheres(spheresOf(_matrices, _drawn, bounds))
    , _tree(_spheres)
    , _state(new osg::StateSet)
{
    const osg::ref_ptr<osg::Vec4Array> texels = new osg::Vec4Array;
    texels->reserve(std::max<std::size_t>(1, kTexels * _matrices.size()));
    for (const osg::Matrixd& matrix : _matrices) { addTexels(matrix, *texels); }
    if (texels->empty()) { texels->push_back(osg::Vec4()); }
    _buffer = TexelBuffer::make(*_state, texels.get(), GL_RGBA32F_ARB, 1, kUnit, "tessLodPlacements");
    _state->setDefine("TESSLOD_PLACEMENTS");
    for (const std::uint32_t number : _drawn) {
        for (unsigned corner = 0; corner < 8; ++corner) {
            _bounds.expandBy(osg::Vec3d(bounds.corner(corner)) * _matrices[number]);
        }
    }
}

Placements::~Placements() = default;

osg::Vec3f Placements::tessLodPlaced(const osg::Vec3f& position, std::uint32_t number) const
{
    osg::Vec3f placed;
    for (unsigned k = 0; k < 3; ++k) {
        const osg::Vec4f& row = texels()[kTexels * number + k];
        placed[static_cast<int>(k)] =
            ((row.x() * position.x() + row.y() * position.y()) + row.z() * position.z()) + row.w();
    }
    return placed;
}

bool Placements::mirrors(std::uint32_t number) const
{
    return texels()[kTexels * number + 3].w() < 0.0F;
}

bool Placements::fits(osg::State& state) const
{
    const std::int64_t most = DrawContext::of(state).maxTextureBufferTexels();
    const bool fits = static_cast<std::int64_t>(kTexels * _matrices.size()) <= most;
    if (!fits && !_warned.exchange(true)) {
        OSG_WARN << "osgTessLOD: cannot draw " << _matrices.size() << " placements at once: this context has room for "
                 << most / static_cast<std::int64_t>(kTexels) << std::endl;
    }
    return fits;
}

void Placements::releaseGLObjects(osg::State* state) const
{
    _state->releaseGLObjects(state);
    _buffer.releaseGLObjects(state);
}

void Placements::resizeGLObjectBuffers(unsigned maxSize) const
{
    _state->resizeGLObjectBuffers(maxSize);
    _buffer.resizeGLObjectBuffers(maxSize);
}

} // namespace osgTessLOD
