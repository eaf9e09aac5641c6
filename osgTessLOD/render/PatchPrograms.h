// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/SelectionOptions.h>

#include <osg/Referenced>
#include <osg/StateSet>
#include <osg/ref_ptr>

#include <map>
#include <mutex>
#include <string>
#include <utility>

namespace osgTessLOD {

/// The programs that draw and capture patches, each in a StateSet with what else drawing with it needs. They depend on no
/// asset: all share those of shared().
class PatchPrograms : public osg::Referenced {
public:
    /// The ones that are alive, or new ones: so that scenes of many assets compile and switch shaders once. Any thread.
    static osg::ref_ptr<PatchPrograms> shared();

    /// `backend` is not Auto here nor below.
    osg::StateSet* draw(Backend backend) const { return _draw.at(backend).get(); }
    /// Gives a vec3 that the vertex stages put out to transform feedback. Any thread.
    osg::ref_ptr<osg::StateSet> capture(Backend backend, const std::string& varying) const;

    void compileGLObjects(osg::State& state, Backend backend) const;
    void releaseGLObjects(osg::State* state) const;
    void resizeGLObjectBuffers(unsigned maxSize);

protected:
    ~PatchPrograms() override = default;

private:
    PatchPrograms();

    std::map<Backend, osg::ref_ptr<osg::StateSet>> _draw;
    mutable std::mutex _mutex;
    mutable std::map<std::pair<Backend, std::string>, osg::ref_ptr<osg::StateSet>> _captures; ///< by varying
};

} // namespace osgTessLOD
