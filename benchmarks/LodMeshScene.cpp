// SPDX-License-Identifier: MIT
#include "LodScene.h"

#include <osg/Geometry>
#include <osg/LOD>
#include <osg/MatrixTransform>

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>

namespace osgTessLOD::benchmarks {

namespace {

/// Draws, and keeps what was drawn where in eye space.
class Recorder : public osg::Drawable::DrawCallback {
public:
    struct Entry {
        const osg::Geometry* geometry;
        osg::Matrixd localToEye;
    };
    void drawImplementation(osg::RenderInfo& renderInfo, const osg::Drawable* drawable) const override
    {
        entries.push_back({drawable->asGeometry(), osg::Matrixd(renderInfo.getState()->getModelViewMatrix())});
        drawable->drawImplementation(renderInfo);
    }
    mutable std::vector<Entry> entries;
};

osg::ref_ptr<osg::Geometry> geometryOf(const ShadedMesh& mesh)
{
    const auto array = [](const std::vector<Eigen::Vector3f>& vectors) {
        osg::ref_ptr<osg::Vec3Array> result = new osg::Vec3Array(osg::Array::BIND_PER_VERTEX);
        for (const Eigen::Vector3f& v : vectors) { result->push_back(osg::Vec3(v.x(), v.y(), v.z())); }
        return result;
    };
    osg::ref_ptr<osg::Geometry> geometry = new osg::Geometry;
    geometry->setUseDisplayList(false);
    geometry->setUseVertexBufferObjects(true);
    geometry->setVertexArray(array(mesh.positions));
    geometry->setNormalArray(array(mesh.normals));
    geometry->addPrimitiveSet(new osg::DrawElementsUInt(GL_TRIANGLES, mesh.indices.begin(), mesh.indices.end()));
    return geometry;
}

const osg::DrawElementsUInt& facesOf(const osg::Geometry& geometry)
{
    return static_cast<const osg::DrawElementsUInt&>(*geometry.getPrimitiveSet(0));
}

/// Number of the placement whose origin is there, of those that differ in it.
std::size_t placementAt(const std::vector<osg::Matrixd>& placements, const osg::Matrixd& localToWorld)
{
    const auto distance = [&](const osg::Matrixd& m) { return (m.getTrans() - localToWorld.getTrans()).length2(); };
    const auto nearest = std::min_element(placements.begin(), placements.end(),
                                          [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    return static_cast<std::size_t>(nearest - placements.begin());
}

class MeshScene : public LodScene {
public:
    explicit MeshScene(const std::vector<MeshLevels>& parts)
    {
        for (const MeshLevels& levels : parts) { addPart(levels); }
    }

    void place(const std::vector<osg::Matrixd>& placements) override
    {
        _placements = placements;
        _root->removeChildren(0, _root->getNumChildren());
        for (const osg::Matrixd& placement : placements) {
            const osg::ref_ptr<osg::MatrixTransform> transform = new osg::MatrixTransform(placement);
            for (const Part& part : _parts) { transform->addChild(part.lod.get()); }
            _root->addChild(transform.get());
        }
    }
    void ask(double errorPixels, double pixelScale) override
    {
        for (const Part& part : _parts) {
            for (unsigned l = 0; l < part.errors.size(); ++l) {
                const double from = l == 0 ? 0.0 : part.rangeFor(l, errorPixels, pixelScale);
                const double to = l + 1 < part.errors.size() ? part.rangeFor(l + 1, errorPixels, pixelScale)
                                                             : double{std::numeric_limits<float>::max()};
                part.lod->setRange(l, static_cast<float>(from), static_cast<float>(to));
            }
        }
    }
    void beginFrame() override { _recorder->entries.clear(); }
    std::uint64_t submitted() const override
    {
        std::uint64_t triangles = 0;
        for (const Recorder::Entry& entry : _recorder->entries) { triangles += facesOf(*entry.geometry).size() / 3; }
        return triangles;
    }
    std::vector<DrawnModel> drawn(osg::RenderInfo&, const ScreenCamera& camera,
                                  const std::vector<std::size_t>& placements) const override
    {
        std::vector<DrawnModel> models(placements.size());
        const osg::Matrixd eyeToWorld = osg::Matrixd::inverse(camera.localToEye);
        for (const Recorder::Entry& entry : _recorder->entries) {
            const std::size_t placement = placementAt(_placements, entry.localToEye * eyeToWorld);
            for (std::size_t k = 0; k < placements.size(); ++k) {
                if (placements[k] == placement) { append(*entry.geometry, models[k]); }
            }
        }
        return models;
    }
    std::uint64_t gpuBytes() const override { return _gpuBytes; }

private:
    struct Part {
        osg::ref_ptr<osg::LOD> lod = new osg::LOD;
        std::vector<double> errors; ///< of the levels
        double radius = 0.0;        ///< of a sphere about it

        /// Distance of the sphere's middle from which on the level does.
        double rangeFor(std::size_t level, double errorPixels, double pixelScale) const
        {
            return radius + errors[level] * pixelScale / errorPixels;
        }
    };

    void addPart(const MeshLevels& levels)
    {
        Part part;
        const std::vector<Eigen::Vector3f>& positions = levels.front().mesh.positions;
        Eigen::AlignedBox3f box;
        for (const Eigen::Vector3f& p : positions) { box.extend(p); }
        const Eigen::Vector3f center = box.center();
        for (const Eigen::Vector3f& p : positions) {
            part.radius = std::max(part.radius, static_cast<double>((p - center).norm()));
        }
        part.lod->setCenterMode(osg::LOD::USER_DEFINED_CENTER);
        part.lod->setCenter(osg::Vec3(center.x(), center.y(), center.z()));
        part.lod->setRadius(part.radius);
        for (const MeshLevel& level : levels) {
            const osg::ref_ptr<osg::Geometry> geometry = geometryOf(level.mesh);
            geometry->setDrawCallback(_recorder.get());
            part.lod->addChild(geometry.get());
            part.errors.push_back(level.error);
            _gpuBytes += 2 * sizeof(osg::Vec3) * level.mesh.positions.size() + 4 * level.mesh.indices.size();
        }
        _parts.push_back(part);
    }
    static void append(const osg::Geometry& geometry, DrawnModel& model)
    {
        const auto& vertices = static_cast<const osg::Vec3Array&>(*geometry.getVertexArray());
        for (const unsigned index : facesOf(geometry)) {
            const osg::Vec3d p(vertices[index]);
            model.corners.emplace_back(p.x(), p.y(), p.z());
        }
        model.isPromised.resize(model.corners.size() / 3, true);
    }

    osg::ref_ptr<Recorder> _recorder = new Recorder;
    std::vector<Part> _parts;
    std::vector<osg::Matrixd> _placements;
    std::uint64_t _gpuBytes = 0;
};

} // namespace

std::unique_ptr<LodScene> makeMeshScene(const std::vector<MeshLevels>& parts)
{
    return std::make_unique<MeshScene>(parts);
}

} // namespace osgTessLOD::benchmarks
