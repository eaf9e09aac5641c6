// SPDX-License-Identifier: MIT
#pragma once

#include <support/ScreenCamera.h>

#include <osg/Image>
#include <osg/RenderInfo>
#include <osg/Switch>
#include <osgViewer/Viewer>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace osgTessLOD::benchmarks {

/// Draws nodes without a window, one at a time, by one thread, with a head light, and measures what that takes.
class HeadlessStage {
public:
    /// Throws std::runtime_error where there is no OpenGL without a window.
    HeadlessStage(int width, int height);
    ~HeadlessStage();

    /// Has `node` to be shown from now on, too; returns its number.
    unsigned add(osg::Node* node);
    /// Shown nodes' GL objects are given up.
    void clear();
    void look(const ScreenCamera& camera);

    /// What a frame took and had the GPU do.
    struct Frame {
        double cullMilliseconds = 0.0;
        double drawMilliseconds = 0.0;         ///< until the GPU has finished
        std::optional<double> gpuMilliseconds; ///< from clearing to the last triangle; nothing without timer queries
        std::optional<std::uint64_t>
            triangles;                   ///< that went to the rasterizer, as the GPU counts; nothing where it does not
        std::uint64_t streamedBytes = 0; ///< that patches to draw were sent in (StreamBuffers)
    };
    /// Draws the node of this number alone. `atEnd`, if any, is called with the context current when all is drawn, and not timed by
    /// the GPU, but by `drawMilliseconds`.
    Frame draw(unsigned number, const std::function<void(osg::RenderInfo&)>& atEnd = nullptr);

    /// To be called at the end of a frame: its picture, GL_RGBA, alpha 0 where nothing was drawn.
    osg::ref_ptr<osg::Image> picture() const;
    const std::string& renderer() const { return _renderer; }

private:
    class Begin;
    class End;

    osg::ref_ptr<osg::Switch> _shown = new osg::Switch;
    osg::ref_ptr<Begin> _begin;
    osg::ref_ptr<End> _end;
    osgViewer::Viewer _viewer;
    int _width;
    int _height;
    std::string _renderer;
};

} // namespace osgTessLOD::benchmarks
