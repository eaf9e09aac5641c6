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
    COMPARE_StateAttribute_Types(SurfaceShading, other);
    return _source.compare(rhs._source);
}

} // namespace osgTessLOD
