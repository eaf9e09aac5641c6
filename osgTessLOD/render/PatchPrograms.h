// SPDX-License-Identifier: MIT
#pragma once

#include <osg/Referenced>
#include <osg/StateSet>
#include <osg/ref_ptr>

#include <map>
#include <mutex>
#include <string>

namespace osgTessLOD {

/// The programs that draw and capture patches, each in a StateSet with what else drawing with it needs. They depend on no
/// asset: all share those of shared().
class PatchPrograms : public osg::Referenced {
public:
    /// The ones that are alive, or new ones: so that scenes of many assets compile and switch shaders once. Any thread.
    static osg::ref_ptr<PatchPrograms> shared();

    osg::StateSet* draw() const { return _draw.get(); }
    /// Gives a vec3 that the vertex stages put out to transform feedback. Any thread.
    osg::ref_ptr<osg::StateSet> capture(const std::string& varying) const;

    void compileGLObjects(osg::State& state) const;
    void releaseGLObjects(osg::State* state) const;
    void resizeGLObjectBuffers(unsigned maxSize);

protected:
    ~PatchPrograms() override = default;

private:
    PatchPrograms();

    osg::ref_ptr<osg::StateSet> _draw;
    mutable std::mutex _mutex;
    mutable std::map<std::string, osg::ref_ptr<osg::StateSet>> _captures; ///< by varying
};

} // namespace osgTessLOD
