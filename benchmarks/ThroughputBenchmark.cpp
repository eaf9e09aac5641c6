// SPDX-License-Identifier: MIT
#include "BakedScene.h"
#include "Benchmark.h"
#include "ChildProcess.h"

#include <osgTessLOD/asset/AssetSummary.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgtesslodviewer/CapturedMesh.h>
#include <osgtesslodviewer/SelectionTotals.h>
#include <osgtesslodviewer/headless/HeadlessContext.h>
#include <support/TemporaryDirectory.h>

#include <fmt/format.h>
#include <osg/Geometry>
#include <osg/Material>
#include <osg/MatrixTransform>
#include <osg/Switch>
#include <osgViewer/Viewer>

#include <array>
#include <cmath>
#include <exception>
#include <memory>
#include <stdexcept>
#include <utility>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

/// Pixels enough for most triangles to be drawn, and few enough to cost little.
constexpr int kSize = 512;
constexpr unsigned kWarmUpFrames = 2;
constexpr std::array<Backend, 2> kBackends{Backend::Tessellation, Backend::Instanced};

/// At the end of each frame waits for the GPU; captures what was selected, if asked to.
class FrameEnd : public osg::Camera::DrawCallback {
public:
    explicit FrameEnd(const SelectionTotals& totals)
        : _totals(totals)
    {
    }
    using osg::Camera::DrawCallback::operator();
    void operator()(osg::RenderInfo& renderInfo) const override
    {
        glFinish();
        if (_isReading) { const_cast<FrameEnd*>(this)->read(renderInfo); }
    }
    void setReading(bool isReading) { _isReading = isReading; }
    /// What the frame that was read showed, as one mesh.
    const SurfaceMesh& mesh() const { return _mesh; }
    const std::string& renderer() const { return _renderer; }
    Backend backend() const { return _backend; }

private:
    void read(osg::RenderInfo& renderInfo)
    {
        _renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
        const std::vector<FrameSelection> selections = _totals.thisFrame(nullptr);
        if (selections.empty()) { return; }
        const PatchSelection& first = *selections.front().selection; // all copies select alike
        _backend = first.backend(renderInfo).value_or(Backend::Auto);
        const std::vector<osg::Vec3f> corners = first.capture(renderInfo);
        CapturedMesh mesh;
        for (const FrameSelection& selection : selections) { mesh.add(corners, selection.localToWorld); }
        _mesh = mesh.surface();
    }

    const SelectionTotals& _totals;
    bool _isReading = false;
    SurfaceMesh _mesh;
    std::string _renderer;
    Backend _backend = Backend::Auto;
};

/// Copies of the drawable in a square, one diagonal of its box apart.
osg::ref_ptr<osg::Group> copiesOf(TessLODDrawable& drawable, unsigned count)
{
    const auto side = static_cast<unsigned>(std::ceil(std::sqrt(count)));
    const double step = 2.0 * double{drawable.getBoundingBox().radius()};
    osg::ref_ptr<osg::Group> copies = new osg::Group;
    for (unsigned k = 0; k < count; ++k) {
        const osg::ref_ptr<osg::MatrixTransform> copy =
            new osg::MatrixTransform(osg::Matrixd::translate(step * (k % side), 0.0, step * (k / side)));
        copy->addChild(&drawable);
        copies->addChild(copy.get());
    }
    return copies;
}

/// The mesh in one vertex and one index buffer.
osg::ref_ptr<osg::Geometry> staticGeometry(const SurfaceMesh& mesh)
{
    const osg::ref_ptr<osg::Vec3Array> vertices = new osg::Vec3Array;
    for (const auto& p : mesh.positions) { vertices->push_back(osg::Vec3(osg::Vec3d(p[0], p[1], p[2]))); }
    const osg::ref_ptr<osg::DrawElementsUInt> faces = new osg::DrawElementsUInt(GL_TRIANGLES);
    for (const auto& triangle : mesh.triangles) { faces->insert(faces->end(), triangle.begin(), triangle.end()); }
    osg::ref_ptr<osg::Geometry> geometry = new osg::Geometry;
    geometry->setUseDisplayList(false);
    geometry->setUseVertexBufferObjects(true);
    geometry->setVertexArray(vertices.get());
    geometry->addPrimitiveSet(faces.get());
    return geometry;
}

/// What is compared, one at a time, in one window-less view.
class Stage {
public:
    Stage(std::shared_ptr<const LodAsset> asset, unsigned copies)
        : _drawables(drawablesOf(std::move(asset)))
        , _totals(_drawables)
        , _frameEnd(new FrameEnd(_totals))
    {
        std::string error;
        const osg::ref_ptr<osg::GraphicsContext> context = createHeadlessContext(kSize, kSize, error);
        if (!context) { throw std::runtime_error("no OpenGL without a window: " + error); }
        for (const auto& drawable : _drawables) { _shown->addChild(copiesOf(*drawable, copies).get()); }
        osg::StateSet* state = _shown->getOrCreateStateSet();
        state->setMode(GL_LIGHTING, osg::StateAttribute::OFF | osg::StateAttribute::OVERRIDE);
        state->setAttribute(new osg::Material);
        _viewer.setThreadingModel(osgViewer::ViewerBase::SingleThreaded);
        osg::Camera& camera = *_viewer.getCamera();
        camera.setGraphicsContext(context.get());
        camera.setViewport(0, 0, kSize, kSize);
        camera.setFinalDrawCallback(_frameEnd.get());
        camera.getStats()->collectStats("rendering", true);
        const osg::BoundingSphere& sphere = _shown->getBound();
        const osg::Vec3d center(sphere.center());
        const double radius = double{sphere.radius()};
        camera.setProjectionMatrixAsPerspective(30.0, 1.0, 0.01 * radius, 10.0 * radius);
        camera.setViewMatrixAsLookAt(center - osg::Vec3d(0.0, 4.0 * radius, 0.0), center, osg::Vec3d(0.0, 0.0, 1.0));
        _viewer.setSceneData(_shown.get());
        _viewer.realize();
        if (!_viewer.isRealized()) { throw std::runtime_error("the OpenGL context could not be made"); }
    }

    /// Adds a static mesh of what the backends draw, behind them.
    void addStatic()
    {
        _frameEnd->setReading(true);
        draw(0);
        _frameEnd->setReading(false);
        if (_frameEnd->backend() != kBackends[0]) { throw std::runtime_error("OpenGL here does not tessellate"); }
        _shown->addChild(staticGeometry(_frameEnd->mesh()).get());
    }
    std::size_t staticTriangles() const { return _frameEnd->mesh().triangles.size(); }
    const std::string& renderer() const { return _frameEnd->renderer(); }
    std::uint64_t triangles() const { return SelectionTotals::sum(_totals.thisFrame(nullptr)).triangles; }

    /// What drawing child `which` takes, until the GPU has finished.
    double drawSeconds(unsigned which)
    {
        draw(which);
        double seconds = 0.0;
        _viewer.getCamera()->getStats()->getAttribute(_viewer.getFrameStamp()->getFrameNumber(),
                                                      "Draw traversal time taken", seconds);
        return seconds;
    }

private:
    static DrawableList drawablesOf(std::shared_ptr<const LodAsset> asset)
    {
        DrawableList drawables;
        for (const Backend backend : kBackends) {
            const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable;
            if (drawables.empty()) {
                drawable->setAsset(asset);
            } else {
                drawable->shareAsset(*drawables.front());
            }
            SelectionOptions options;
            options.errorPixels = 1e-9; // the finest levels
            options.backend = backend;
            drawable->setOptions(options);
            drawables.push_back(drawable);
        }
        return drawables;
    }
    void draw(unsigned which)
    {
        _shown->setSingleChildOn(which);
        _totals.beginFrame();
        _viewer.frame();
    }

    DrawableList _drawables;
    SelectionTotals _totals;
    osg::ref_ptr<FrameEnd> _frameEnd;
    osg::ref_ptr<osg::Switch> _shown = new osg::Switch;
    osgViewer::Viewer _viewer;
};

/// Median seconds of drawing each backend's triangles and the same ones as a static mesh, in turn.
Json measure(const std::string& path, std::uint64_t leastTriangles, unsigned frames)
{
    LodAsset asset = readTlod(path);
    asset.normals = NormalTexture(); // nothing that a fragment would look up
    for (LodLevel& level : asset.levels) { level.parameters.clear(); }
    const std::uint64_t triangles = summarize(asset).finestTriangles;
    const auto copies = static_cast<unsigned>((leastTriangles + triangles - 1) / triangles);
    Stage stage(std::make_shared<const LodAsset>(std::move(asset)), copies);
    stage.addStatic();
    std::array<std::vector<double>, kBackends.size() + 1> seconds; ///< the static mesh's last
    std::uint64_t drawn = 0;
    for (unsigned frame = 0; frame < kWarmUpFrames + frames; ++frame) {
        for (unsigned k = 0; k < seconds.size(); ++k) {
            const double time = stage.drawSeconds(k);
            if (k < kBackends.size()) { drawn = stage.triangles(); }
            if (frame >= kWarmUpFrames) { seconds[k].push_back(time); }
        }
    }
    const double staticRate = static_cast<double>(stage.staticTriangles()) / median(seconds.back());
    Json row{{"copies", copies},
             {"triangles", drawn},
             {"staticTriangles", stage.staticTriangles()},
             {"staticTrianglesPerSecond", staticRate},
             {"renderer", stage.renderer()}};
    for (std::size_t k = 0; k < kBackends.size(); ++k) {
        const double rate = static_cast<double>(drawn) / median(seconds[k]);
        row[nameOf(kBackends[k])] = {{"trianglesPerSecond", rate}, {"rateOverStatic", rate / staticRate}};
    }
    return row;
}

std::vector<std::string> tableRow(const Json& row)
{
    const auto millions = [](const Json& rate) { return fmt::format("{:.2f}", 1e-6 * rate.get<double>()); };
    std::vector<std::string> cells{row["scene"].get<std::string>(), grouped(row["copies"].get<std::uint64_t>()),
                                   grouped(row["triangles"].get<std::uint64_t>()),
                                   millions(row["staticTrianglesPerSecond"])};
    for (const Backend backend : kBackends) {
        const Json& measured = row[nameOf(backend)];
        cells.push_back(millions(measured["trianglesPerSecond"]));
        cells.push_back(fmt::format("{:.3f}", measured["rateOverStatic"].get<double>()));
    }
    return cells;
}

} // namespace

BenchmarkResult benchmarkThroughput(const std::vector<Scene>& scenes, const std::vector<std::uint64_t>& leastTriangles,
                                    unsigned frames)
{
    const TemporaryDirectory folder;
    BenchmarkResult result;
    result.tables.emplace_back().headers = {"scene",           "copies",   "triangles",     "static M/s",
                                            "tessellated M/s", ": static", "instanced M/s", ": static"};
    std::array<std::vector<double>, kBackends.size()> ratios;
    for (const Scene& scene : scenes) {
        fmt::print(stderr, "{}: throughput\n", scene.name);
        try {
            bake::BakeOptions options;
            options.normals = false;
            const std::string path = bakedFile(scene, options, folder.file("scene.tlod"));
            for (const std::uint64_t least : leastTriangles) {
                Json row{{"scene", scene.name}};
                row.update(runInChild([&] { return measure(path, least, frames); }));
                result.glRenderer = row["renderer"].get<std::string>();
                row.erase("renderer");
                for (std::size_t k = 0; k < kBackends.size(); ++k) {
                    ratios[k].push_back(row[nameOf(kBackends[k])]["rateOverStatic"]);
                }
                result.tables.front().rows.push_back(tableRow(row));
                result.rows.push_back(std::move(row));
            }
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary["rate_over_static"] = Json::object();
    for (std::size_t k = 0; k < kBackends.size(); ++k) {
        result.summary["rate_over_static"][nameOf(kBackends[k])] = mean(ratios[k]);
    }
    result.summary["frames"] = frames;
    return result;
}

} // namespace osgTessLOD::benchmarks
