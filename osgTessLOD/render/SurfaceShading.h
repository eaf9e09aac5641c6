// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <osg/StateAttribute>

#include <string>

namespace osgTessLOD {

/// Colours surfaces by a GLSL function of one's own instead of OpenGL's fixed function (docs/shading.md). As any state attribute
/// it holds for what is below its StateSet in the scene, and may be overridden and protected; other geometry is not affected.
/// Textures and uniforms that the function uses come from StateSets, too.
///
/// Not to be changed after it is in a scene: programs are kept by their source.
class OSGTESSLOD_EXPORT SurfaceShading : public osg::StateAttribute {
public:
    /// None of OSG's own.
    static constexpr Type kType = static_cast<Type>(120);

    SurfaceShading() = default; ///< as OpenGL's fixed function
    /// `source`: GLSL without #version that defines `vec4 tessLodShade(TessLodFragment fragment)`, and what else that needs.
    explicit SurfaceShading(std::string source);
    SurfaceShading(const SurfaceShading& other, const osg::CopyOp& copyop = osg::CopyOp::SHALLOW_COPY);

    const std::string& getSource() const { return _source; }
    void setSource(const std::string& source) { _source = source; }

    osg::Object* cloneType() const override { return new SurfaceShading; }
    osg::Object* clone(const osg::CopyOp& copyop) const override { return new SurfaceShading(*this, copyop); }
    bool isSameKindAs(const osg::Object* o) const override { return dynamic_cast<const SurfaceShading*>(o) != nullptr; }
    const char* libraryName() const override { return "osgTessLOD"; }
    const char* className() const override { return "SurfaceShading"; }
    Type getType() const override { return kType; }
    int compare(const osg::StateAttribute& other) const override;

protected:
    ~SurfaceShading() override = default;

private:
    std::string _source;
};

} // namespace osgTessLOD
