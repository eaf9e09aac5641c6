// SPDX-License-Identifier: MIT
#pragma once

#include <render/ViewerTest.h>

#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/Geometry>
#include <osg/Image>
#include <osg/MatrixTransform>

#include <algorithm>
#include <cstdlib>
#include <vector>

namespace osgTessLOD {

/// Captures what was selected last of a drawable, at the end of a camera's frame.
class LastCapture : public osg::Camera::DrawCallback {
public:
    explicit LastCapture(RecordingObserver& observer)
        : _observer(observer)
    {
    }
    void operator()(osg::RenderInfo& renderInfo) const override
    {
        const auto entries = _observer.take();
        if (!entries.empty()) { corners = entries.back().selection->capture(renderInfo); }
    }
    mutable std::vector<osg::Vec3f> corners;

private:
    RecordingObserver& _observer;
};

/// Ordinary OSG geometry of these triangles, each with its own normal.
inline osg::ref_ptr<osg::Geometry> plainGeometry(const std::vector<osg::Vec3f>& corners)
{
    const osg::ref_ptr<osg::Vec3Array> vertices = new osg::Vec3Array(corners.begin(), corners.end());
    const osg::ref_ptr<osg::Vec3Array> normals = new osg::Vec3Array;
    for (std::size_t k = 0; k < corners.size(); k += 3) {
        osg::Vec3f normal = (corners[k + 1] - corners[k]) ^ (corners[k + 2] - corners[k]);
        normal.normalize();
        normals->insert(normals->end(), 3, normal);
    }
    const osg::ref_ptr<osg::Vec4Array> white = new osg::Vec4Array(1);
    white->front().set(1.0F, 1.0F, 1.0F, 1.0F);
    osg::ref_ptr<osg::Geometry> geometry = new osg::Geometry;
    geometry->setVertexArray(vertices.get());
    geometry->setNormalArray(normals.get(), osg::Array::BIND_PER_VERTEX);
    geometry->setColorArray(white.get(), osg::Array::BIND_OVERALL);
    geometry->addPrimitiveSet(new osg::DrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(corners.size())));
    return geometry;
}

/// Pixels of which a channel differs by more than `tolerance`.
inline std::size_t differingPixels(const osg::Image& a, const osg::Image& b, int tolerance)
{
    std::size_t count = 0;
    for (int y = 0; y < a.t(); ++y) {
        for (int x = 0; x < a.s(); ++x) {
            const unsigned char* p = a.data(static_cast<unsigned>(x), static_cast<unsigned>(y));
            const unsigned char* q = b.data(static_cast<unsigned>(x), static_cast<unsigned>(y));
            int most = 0;
            for (int k = 0; k < 3; ++k) { most = std::max(most, std::abs(p[k] - q[k])); }
            count += most > tolerance ? 1 : 0;
        }
    }
    return count;
}

} // namespace osgTessLOD
