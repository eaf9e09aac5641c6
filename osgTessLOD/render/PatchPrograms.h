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

    /// What to draw with under `state`, as it is applied: the program of its SurfaceShading, if there is one. `backend` is not
    /// Auto here nor below. Any thread.
    osg::ref_ptr<osg::StateSet> draw(Backend backend, const osg::State& state) const;
    /// Gives a vec3 that the vertex stages put out to transform feedback. Any thread.
    osg::ref_ptr<osg::StateSet> capture(Backend backend, const std::string& varying) const;

    void compileGLObjects(osg::State& state, Backend backend) const;
    void releaseGLObjects(osg::State* state) const;
    void resizeGLObjectBuffers(unsigned maxSize);

protected:
    ~PatchPrograms() override = default;

private:
    PatchPrograms();

    /// A program twice: for filled triangles, and for their outlines and corners.
    struct Draw {
        osg::ref_ptr<osg::StateSet> filled;
        osg::ref_ptr<osg::StateSet> unfilled;
    };
    static Draw makeDraw(Backend backend, const std::string& shading);
    /// Calls what(state set) for all that there are.
    template <typename What> void forEach(const What& what) const;

    mutable std::mutex _mutex;
    mutable std::map<std::pair<Backend, std::string>, Draw> _draws; ///< by the source of the shading; empty: the usual one
    mutable std::map<std::pair<Backend, std::string>, osg::ref_ptr<osg::StateSet>> _captures; ///< by varying
};

} // namespace osgTessLOD
