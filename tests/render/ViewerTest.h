// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/PatchSelection.h>
#include <osgtesslodviewer/headless/HeadlessContext.h>

#include <osg/Camera>
#include <osg/Image>
#include <osg/Texture2D>
#include <osgViewer/Viewer>

#include <gtest/gtest.h>

#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace osgTessLOD {

/// Keeps every selection, with the numbers it had when it was made.
class RecordingObserver : public SelectionObserver {
public:
    struct Entry {
        std::string camera;
        osg::Matrixd localToWorld;
        osg::ref_ptr<const PatchSelection> selection;
        std::vector<PatchRecord> records;
    };

    void selected(const osg::Camera* camera, const osg::Matrixd& localToWorld, const PatchSelection& selection) override
    {
        const std::lock_guard<std::mutex> lock(_mutex);
        _entries.push_back({camera != nullptr ? camera->getName() : "", localToWorld, &selection, selection.records().vector()});
    }
    /// Everything since the last call.
    std::vector<Entry> take()
    {
        const std::lock_guard<std::mutex> lock(_mutex);
        return std::move(_entries);
    }

private:
    std::mutex _mutex;
    std::vector<Entry> _entries;
};

/// Keeps the last picture that its camera drew.
class Snapshot : public osg::Camera::DrawCallback {
public:
    void operator()(osg::RenderInfo& renderInfo) const override
    {
        const osg::Viewport* v = renderInfo.getState()->getCurrentViewport();
        _image->readPixels(0, 0, static_cast<int>(v->width()), static_cast<int>(v->height()), GL_RGB, GL_UNSIGNED_BYTE);
    }
    const osg::Image& image() const { return *_image; }

private:
    osg::ref_ptr<osg::Image> _image = new osg::Image;
};

/// Makes `camera` draw into a headless context of its own.
inline void setUpHeadless(osg::Camera& camera, int width, int height)
{
    std::string error;
    const osg::ref_ptr<osg::GraphicsContext> context = createHeadlessContext(width, height, error);
    ASSERT_TRUE(context.valid()) << error;
    context->getState()->setCheckForGLErrors(osg::State::ONCE_PER_ATTRIBUTE);
    camera.setGraphicsContext(context.get());
    camera.setViewport(0, 0, width, height);
    camera.setProjectionMatrixAsPerspective(30.0, static_cast<double>(width) / height, 0.1, 100.0);
    camera.setDrawBuffer(GL_BACK);
    camera.setReadBuffer(GL_BACK);
}

/// A camera that renders the scene into a square texture; its view and projection are the caller's to set.
inline osg::ref_ptr<osg::Camera> makeTextureCamera(osg::Node* scene, int sizePixels)
{
    const osg::ref_ptr<osg::Texture2D> texture = new osg::Texture2D;
    texture->setTextureSize(sizePixels, sizePixels);
    texture->setInternalFormat(GL_RGBA);
    osg::ref_ptr<osg::Camera> camera = new osg::Camera;
    camera->setName("texture");
    camera->setRenderOrder(osg::Camera::PRE_RENDER);
    camera->setRenderTargetImplementation(osg::Camera::FRAME_BUFFER_OBJECT);
    camera->attach(osg::Camera::COLOR_BUFFER, texture.get());
    camera->setViewport(0, 0, sizePixels, sizePixels);
    camera->addChild(scene);
    return camera;
}

} // namespace osgTessLOD
