// SPDX-License-Identifier: MIT
#include "CapturedMesh.h"

#include <cstring>
#include <limits>
#include <stdexcept>

namespace osgTessLOD {

namespace {

/// Bits that are equal where the numbers are: −0 gives those of 0.
std::uint64_t bitsOf(double value)
{
    const double positiveZero = value + 0.0;
    std::uint64_t bits = 0;
    std::memcpy(&bits, &positiveZero, sizeof(bits));
    return bits;
}

} // namespace

std::size_t CapturedMesh::KeyHash::operator()(const Key& key) const
{
    std::uint64_t hash = 0;
    for (const std::uint64_t part : key) {
        hash = (hash ^ part) * 0x9E3779B97F4A7C15ULL;
        hash ^= hash >> 32;
    }
    return hash;
}

std::uint32_t CapturedMesh::vertexAt(const osg::Vec3d& position)
{
    if (_surface.positions.size() >= static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
        throw std::runtime_error("the capture has more vertices than a PLY file can index");
    }
    const Key key{bitsOf(position.x()), bitsOf(position.y()), bitsOf(position.z())};
    const auto [entry, isNew] = _vertexOf.emplace(key, static_cast<std::uint32_t>(_surface.positions.size()));
    if (isNew) { _surface.positions.push_back({position.x(), position.y(), position.z()}); }
    return entry->second;
}

void CapturedMesh::add(const std::vector<osg::Vec3f>& corners, const osg::Matrixd& localToWorld)
{
    for (std::size_t first = 0; first + 2 < corners.size(); first += 3) {
        std::array<std::uint32_t, 3> face{};
        for (std::size_t corner = 0; corner < 3; ++corner) {
            face[corner] = vertexAt(osg::Vec3d(corners[first + corner]) * localToWorld);
        }
        if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) {
            ++_degenerateTriangles;
        } else {
            _surface.triangles.push_back(face);
        }
    }
}

CapturedMesh::Counts CapturedMesh::counts() const
{
    const std::uint64_t faces = _surface.triangles.size();
    return {faces + _degenerateTriangles, _degenerateTriangles, faces, _surface.positions.size()};
}

} // namespace osgTessLOD
