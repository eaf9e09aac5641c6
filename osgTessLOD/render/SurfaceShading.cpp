// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/SurfaceShading.h>

#include <utility>

namespace osgTessLOD {

SurfaceShading::SurfaceShading(std::string source)
    : _source(std::move(source))
{
}

SurfaceShading::SurfaceShading(const SurfaceShading& other, const osg::CopyOp& copyop)
    : osg::StateAttribute(other, copyop)
    , _source(other._source)
{
}

int SurfaceShading::compare(const osg::StateAttribute& other) const
{
    const auto* shading = dynamic_cast<const SurfaceShading*>(&other);
    return shading != nullptr ? _source.compare(shading->_source) : getType() < other.getType() ? -1 : 1;
}

} // namespace osgTessLOD
