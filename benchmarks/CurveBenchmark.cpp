// SPDX-License-Identifier: MIT
#include "BakedScene.h"
#include "Benchmark.h"
#include "ChildProcess.h"
#include "CurveSummary.h"
#include "HeadlessStage.h"
#include "LodScene.h"
#include "PictureDifference.h"
#include "ScreenRuler.h"

#include <osgTessLOD/asset/TlodFile.h>
#include <support/TemporaryDirectory.h>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <memory>
#include <random>
#include <utility>

namespace osgTessLOD::benchmarks {

namespace {

using Eigen::Vector3d;
using Json = nlohmann::ordered_json;

constexpr char kFull[] = "full mesh";
const std::vector<std::string> kOurs{"tessellation", "instanced", "first order"};
constexpr std::size_t kMeasuredPlacements = 4; ///< of those in view, from the nearest to the farthest

/// Moves the middle of the box to the origin; returns where it was.
Vector3d centerAtOrigin(Triangles& surface)
{
    Eigen::AlignedBox3d box;
    for (const Vector3d& p : surface.positions) { box.extend(p); }
    for (Vector3d& p : surface.positions) { p -= box.center(); }
    return box.center();
}

/// What the contestants of a scene are made of, in files.
struct Inputs {
    std::string strips;
    std::string uniform;
    std::string simplified;
};

/// Each made in a process of its own; the calling one gets no threads by it.
Inputs makeInputs(const Scene& scene, const CurveBenchmarkOptions& options, const TemporaryDirectory& folder)
{
    Inputs inputs{folder.file("strips.tlod"), folder.file("uniform.tlod"), folder.file("simplified")};
    bake::BakeOptions bakeOptions;
    bakeOptions.maxFactor = options.maxFactor;
    bakedFile(scene, bakeOptions, inputs.strips);
    bakeOptions.technique = "uniform";
    bakedFile(scene, bakeOptions, inputs.uniform);
    fmt::print(stderr, "{}: osgUtil::Simplifier\n", scene.name);
    try {
        runInChild([&] {
            Triangles surface = sourceTriangles(scene, options.maxFactor);
            centerAtOrigin(surface);
            limitChild(options.simplifierSeconds);
            writeSimplifierLevels(inputs.simplified, shadedMesh(surface));
            return Json();
        });
    } catch (const TimeLimitReached&) { // what it got done counts
    }
    return inputs;
}

struct Contestant {
    std::string name;
    std::unique_ptr<LodScene> scene;
    bool hasLevels = true; ///< that depend on the error asked
};

std::vector<Contestant> makeContestants(const Inputs& inputs, const ShadedMesh& surface, const Vector3d& center)
{
    std::vector<Contestant> contestants;
    contestants.push_back({kFull, makeMeshScene({{{surface, 0.0}}}), false});
    const MeshLevels simplified = readSimplifierLevels(inputs.simplified, surface);
    if (simplified.size() > 1) { contestants.push_back({"osgUtil::Simplifier", makeMeshScene({simplified})}); }
    contestants.push_back({"meshoptimizer", makeMeshScene({meshoptimizerLevels(surface)})});
    contestants.push_back({"meshoptimizer, clusters", makeMeshScene(meshoptimizerClusters(surface))});
    const auto tessellated = [&](const char* name, const std::shared_ptr<const LodAsset>& asset,
                                 const SelectionOptions& options) {
        contestants.push_back({name, makeTessLodScene(asset, options, center)});
    };
    SelectionOptions options;
    options.backend = Backend::Tessellation;
    options.metric = SelectionOptions::Metric::Isotropic;
    tessellated("uniform, isotropic", std::make_shared<const LodAsset>(readTlod(inputs.uniform)), options);
    const auto strips = std::make_shared<const LodAsset>(readTlod(inputs.strips));
    options.metric = SelectionOptions::Metric::View;
    tessellated("tessellation", strips, options);
    options.backend = Backend::Instanced;
    tessellated("instanced", strips, options);
    options.backend = Backend::Tessellation;
    options.bound = SelectionOptions::Bound::FirstOrder;
    tessellated("first order", strips, options);
    return contestants;
}

/// A point of a triangle surface.
struct Sample {
    Vector3d point;
    std::uint32_t triangle;
};

/// Corners, middles of the sides and centroids of triangles, as far as in view: evenly spread `most` of them. `cornerOf(t, k)`: corner k of
/// triangle t.
template <typename CornerOf>
std::vector<Sample> samplesInView(std::size_t triangles, const CornerOf& cornerOf, const ScreenRuler& ruler,
                                  std::size_t most)
{
    const auto forEach = [&](const auto& visit) {
        for (std::size_t t = 0; t < triangles; ++t) {
            const Vector3d a = cornerOf(t, 0);
            const Vector3d b = cornerOf(t, 1);
            const Vector3d c = cornerOf(t, 2);
            for (const Vector3d& p : {a, b, c, Vector3d(0.5 * (a + b)), Vector3d(0.5 * (b + c)),
                                      Vector3d(0.5 * (c + a)), Vector3d((a + b + c) / 3.0)}) {
                if (ruler.isInView(p)) { visit(Sample{p, static_cast<std::uint32_t>(t)}); }
            }
        }
    };
    std::size_t count = 0;
    forEach([&](const Sample&) { ++count; });
    const std::size_t stride = std::max<std::size_t>(1, (count + most - 1) / most);
    std::vector<Sample> samples;
    std::size_t number = 0;
    forEach([&](const Sample& sample) {
        if (number++ % stride == 0) { samples.push_back(sample); }
    });
    return samples;
}

/// The largest of the samples' least distances on screen, of those that `counts` of.
template <typename Counts>
double largestOf(const std::vector<Sample>& samples, const std::vector<ScreenRuler::Deviation>& first,
                 const ScreenRuler& ruler, const bake::SurfaceDistance& surface, const Counts& counts)
{
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < samples.size(); ++k) {
        if (counts(k)) { order.push_back(k); }
    }
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return first[a].pixels > first[b].pixels; });
    double largest = 0.0;
    for (const std::size_t k : order) {
        if (first[k].pixels <= largest) { break; } // all others are no farther
        largest = std::max(largest, ruler.leastPixels(samples[k].point, first[k], surface, largest));
    }
    return largest;
}

/// Of samples in view. `isPromised(sample, nearest triangle)`: is something said of how far that may be?
template <typename IsPromised>
Deviations measureAll(const std::vector<Sample>& samples, const ScreenRuler& ruler,
                      const bake::SurfaceDistance& surface, const IsPromised& isPromised)
{
    std::vector<ScreenRuler::Deviation> first(samples.size());
    tbb::parallel_for(std::size_t{0}, samples.size(),
                      [&](std::size_t k) { first[k] = *ruler.measure(samples[k].point, surface); });
    const auto promised = [&](std::size_t k) { return isPromised(samples[k], first[k].nearest.triangle); };
    Deviations result;
    for (std::size_t k = 0; k < samples.size(); ++k) {
        result.largestInSpace = std::max(result.largestInSpace, first[k].pixelsInSpace);
        result.sumOfSquares += std::pow(first[k].pixels, 2.0);
        result.promised += promised(k) ? 1 : 0;
    }
    result.points = samples.size();
    result.largest = largestOf(samples, first, ruler, surface, [](std::size_t) { return true; });
    result.largestPromised =
        result.promised == result.points ? result.largest : largestOf(samples, first, ruler, surface, promised);
    return result;
}

/// A surface that what is drawn of it is compared with.
class Reference {
public:
    explicit Reference(Triangles surface)
        : _surface(std::move(surface))
        , _distance(_surface.positions, _surface.triangles)
    {
    }
    const Triangles& surface() const { return _surface; }

    /// What of it a camera, in its own space, has in view.
    std::vector<Sample> samplesIn(const ScreenRuler& ruler, std::size_t most) const
    {
        return samplesInView(
            _surface.triangles.size(),
            [&](std::size_t t, std::size_t k) { return _surface.positions[_surface.triangles[t][k]]; }, ruler, most);
    }
    /// From what is drawn to the surface, and from these samples of the surface to what is drawn.
    Deviations compare(const DrawnModel& drawn, const std::vector<Sample>& samples, const ScreenRuler& ruler,
                       std::size_t most) const
    {
        const std::size_t count = drawn.isPromised.size();
        std::vector<std::array<std::uint32_t, 3>> triangles(count);
        for (std::uint32_t t = 0; t < count; ++t) { triangles[t] = {3 * t, 3 * t + 1, 3 * t + 2}; }
        const bake::SurfaceDistance drawnDistance(drawn.corners, triangles);
        const auto cornerOf = [&](std::size_t t, std::size_t k) { return drawn.corners[3 * t + k]; };
        Deviations deviations =
            measureAll(samplesInView(count, cornerOf, ruler, most), ruler, _distance,
                       [&](const Sample& sample, std::uint32_t) { return drawn.isPromised[sample.triangle]; });
        deviations.add(measureAll(samples, ruler, drawnDistance, [&](const Sample&, std::uint32_t nearest) {
            return count > 0 && drawn.isPromised[nearest];
        }));
        return deviations;
    }

private:
    Triangles _surface;
    bake::SurfaceDistance _distance;
};

/// Numbers of placements whose origins are in view, from the nearest to the farthest.
std::vector<std::size_t> placementsToMeasure(const CameraPath& path, const ScreenCamera& camera)
{
    std::vector<std::pair<double, std::size_t>> inView;
    const ScreenRuler ruler(camera);
    for (std::size_t k = 0; k < path.placements.size(); ++k) {
        const osg::Vec3d place = path.placements[k].getTrans();
        if (path.placements.size() == 1 || ruler.isInView({place.x(), place.y(), place.z()})) {
            inView.emplace_back((place * camera.localToEye).length(), k);
        }
    }
    std::sort(inView.begin(), inView.end());
    std::vector<std::size_t> chosen;
    const std::size_t count = std::min(inView.size(), kMeasuredPlacements);
    for (std::size_t k = 0; k < count; ++k) {
        chosen.push_back(inView[count == 1 ? 0 : k * (inView.size() - 1) / (count - 1)].second);
    }
    return chosen;
}

/// Quartiles of a few measurements.
struct Spread {
    double median = 0.0;
    double interquartile = 0.0;
};

Spread spreadOf(std::vector<double> values)
{
    if (values.empty()) { return {}; }
    std::sort(values.begin(), values.end());
    const auto at = [&](double share) { return values[static_cast<std::size_t>(share * (values.size() - 1) + 0.5)]; };
    return {median(values), at(0.75) - at(0.25)};
}

/// What is measured of one contestant in one frame.
class FrameRecord {
public:
    void setDrawn(const HeadlessStage::Frame& frame, const LodScene& scene, const Deviations& deviations)
    {
        _json["triangles"] = frame.triangles.value_or(scene.submitted());
        _json["submitted"] = scene.submitted();
        _json["saturated"] = scene.saturated();
        _json["streamedBytes"] = frame.streamedBytes;
        _json["largestPixels"] = deviations.largest;
        _json["rmsPixels"] = deviations.rms();
        _json["largestInSpace"] = deviations.largestInSpace;
        _json["largestPromised"] = deviations.largestPromised;
        _json["points"] = deviations.points;
        _json["promisedPoints"] = deviations.promised;
    }
    void setDifference(const PictureDifference& difference)
    {
        _json["psnr"] = difference.psnr;
        _json["ssim"] = difference.ssim;
        _json["coveragePixels"] = difference.onlyOne;
        _json["silhouettePixels"] = difference.silhouettePixels();
    }
    void addTimes(const HeadlessStage::Frame& frame)
    {
        _cull.push_back(frame.cullMilliseconds);
        _draw.push_back(frame.drawMilliseconds);
        if (frame.gpuMilliseconds) { _gpu.push_back(*frame.gpuMilliseconds); }
    }
    Json json() const
    {
        Json json = _json;
        addSpread(json, "cull", _cull);
        addSpread(json, "draw", _draw);
        addSpread(json, "gpu", _gpu);
        return json;
    }

private:
    static void addSpread(Json& json, const std::string& name, const std::vector<double>& values)
    {
        const Spread spread = spreadOf(values);
        json[name + "Milliseconds"] = values.empty() ? Json() : Json(spread.median);
        json[name + "Interquartile"] = values.empty() ? Json() : Json(spread.interquartile);
    }

    Json _json{{"triangles", 0},
               {"submitted", 0},
               {"saturated", 0},
               {"streamedBytes", 0},
               {"largestPixels", 0.0},
               {"rmsPixels", 0.0},
               {"largestInSpace", 0.0},
               {"largestPromised", 0.0},
               {"points", 0},
               {"promisedPoints", 0},
               {"psnr", nullptr},
               {"ssim", nullptr},
               {"coveragePixels", nullptr},
               {"silhouettePixels", nullptr}};
    std::vector<double> _cull;
    std::vector<double> _draw;
    std::vector<double> _gpu;
};

/// Draws the contestants of a scene along paths.
class Contest {
public:
    Contest(const Scene& scene, const Inputs& inputs, const CurveBenchmarkOptions& options)
        : _options(options)
        , _center()
        , _reference(surfaceOf(scene, options, _center))
        , _contestants(makeContestants(inputs, shadedMesh(_reference.surface()), _center))
        , _stage(options.path.width, options.path.height)
        , _random(options.seed)
    {
    }

    /// A row for each contestant and error asked.
    Json along(const std::string& pathName)
    {
        const CameraPath path = makePath(pathName, _reference.surface(), _options.path);
        _stage.clear();
        std::map<std::string, unsigned> numbers;
        for (const Contestant& contestant : _contestants) {
            if (isTooLarge(contestant, path)) { continue; }
            contestant.scene->place(path.placements);
            numbers[contestant.name] = _stage.add(contestant.scene->node());
        }
        std::vector<Json> rows;
        std::map<std::pair<std::string, double>, std::size_t> rowOf;
        for (std::size_t f = 0; f < path.cameras.size(); ++f) {
            fmt::print(stderr, "  {}, frame {} of {}\n", pathName, f + 1, path.cameras.size());
            drawFrame(path, path.cameras[f], numbers,
                      [&](const Contestant& contestant, double asked, const Json& frame) {
                          const auto [entry, isNew] = rowOf.try_emplace({contestant.name, asked}, rows.size());
                          if (isNew) { rows.push_back(newRow(pathName, contestant, asked)); }
                          rows[entry->second]["frames"].push_back(frame);
                      });
        }
        return rows;
    }
    const std::string& renderer() const { return _stage.renderer(); }

private:
    /// Contestants that are drawn one after the other, again and again, in an order of chance.
    struct Heat {
        std::vector<const Contestant*> contestants;
        std::vector<FrameRecord> records;
    };

    static Triangles surfaceOf(const Scene& scene, const CurveBenchmarkOptions& options, Vector3d& center)
    {
        Triangles surface = sourceTriangles(scene, options.maxFactor);
        center = centerAtOrigin(surface);
        return surface;
    }
    bool isTooLarge(const Contestant& contestant, const CameraPath& path) const
    {
        return !contestant.hasLevels &&
               path.placements.size() * _reference.surface().triangles.size() > _options.mostTriangles;
    }
    Json newRow(const std::string& path, const Contestant& contestant, double asked) const
    {
        return {{"path", path},
                {"contestant", contestant.name},
                {"errorPixels", contestant.hasLevels ? Json(asked) : Json()},
                {"sourceTriangles", _reference.surface().triangles.size()},
                {"gpuBytes", contestant.scene->gpuBytes()},
                {"frames", Json::array()}};
    }

    /// Calls found(contestant, error asked, what was measured).
    template <typename Found>
    void drawFrame(const CameraPath& path, const ScreenCamera& camera, const std::map<std::string, unsigned>& numbers,
                   const Found& found)
    {
        _stage.look(camera);
        const std::vector<std::size_t> placements = placementsToMeasure(path, camera);
        std::vector<ScreenRuler> rulers;
        std::vector<std::vector<Sample>> samples;
        for (const std::size_t placement : placements) {
            ScreenCamera fromModel = camera;
            fromModel.localToEye = path.placements[placement] * camera.localToEye;
            rulers.emplace_back(fromModel);
            samples.push_back(_reference.samplesIn(rulers.back(), _options.points));
        }
        osg::ref_ptr<osg::Image> full;
        const auto measure = [&](const Contestant& contestant, FrameRecord& record) {
            osg::ref_ptr<osg::Image> picture;
            std::vector<DrawnModel> models;
            contestant.scene->beginFrame();
            const HeadlessStage::Frame frame =
                _stage.draw(numbers.at(contestant.name), [&](osg::RenderInfo& renderInfo) {
                    picture = _stage.picture();
                    models = contestant.scene->drawn(renderInfo, camera, placements);
                });
            Deviations deviations;
            for (std::size_t k = 0; k < placements.size(); ++k) {
                deviations.add(_reference.compare(models[k], samples[k], rulers[k], _options.points));
            }
            record.setDrawn(frame, *contestant.scene, deviations);
            if (contestant.name == kFull) { full = picture; }
            if (full) { record.setDifference(comparePictures(*picture, *full)); }
        };
        double last = 0.0;
        for (const double asked : _options.errorsPixels) {
            Heat heat;
            for (const Contestant& contestant : _contestants) {
                if (numbers.count(contestant.name) == 0 || (!contestant.hasLevels && last > 0.0)) { continue; }
                contestant.scene->ask(asked, 0.5 * camera.height * camera.projection(1, 1));
                heat.contestants.push_back(&contestant);
                heat.records.emplace_back();
                measure(contestant, heat.records.back()); // and warms up
            }
            takeTimes(heat, numbers);
            for (std::size_t k = 0; k < heat.records.size(); ++k) {
                found(*heat.contestants[k], asked, heat.records[k].json());
            }
            last = asked;
        }
    }
    void takeTimes(Heat& heat, const std::map<std::string, unsigned>& numbers)
    {
        std::vector<std::size_t> order(heat.contestants.size());
        for (std::size_t k = 0; k < order.size(); ++k) { order[k] = k; }
        for (unsigned run = 0; run < _options.runs; ++run) {
            std::shuffle(order.begin(), order.end(), _random);
            for (const std::size_t k : order) {
                heat.contestants[k]->scene->beginFrame();
                heat.records[k].addTimes(_stage.draw(numbers.at(heat.contestants[k]->name)));
            }
        }
    }

    CurveBenchmarkOptions _options;
    Vector3d _center;
    Reference _reference;
    std::vector<Contestant> _contestants;
    HeadlessStage _stage;
    std::mt19937 _random;
};

/// Adds to the row what its frames have in common.
void addTotals(Json& row)
{
    const auto values = [&](const char* key) {
        std::vector<double> found;
        for (const Json& frame : row["frames"]) {
            if (!frame[key].is_null()) { found.push_back(frame[key].get<double>()); }
        }
        return found;
    };
    const auto set = [&](const char* key, const std::vector<double>& found, const auto& total) {
        row[key] = found.empty() ? Json() : Json(total(found));
    };
    const auto largest = [](const std::vector<double>& v) { return *std::max_element(v.begin(), v.end()); };
    for (const char* key :
         {"triangles", "submitted", "saturated", "streamedBytes", "rmsPixels", "psnr", "ssim", "silhouettePixels",
          "cullMilliseconds", "drawMilliseconds", "gpuMilliseconds", "drawInterquartile"}) {
        set(key, values(key), mean);
    }
    for (const char* key : {"largestPixels", "largestInSpace", "largestPromised"}) { set(key, values(key), largest); }
}

std::vector<std::string> tableRow(const Json& row)
{
    const auto number = [&](const char* key, const char* format) {
        return row[key].is_null() ? std::string("–") : fmt::format(fmt::runtime(format), row[key].get<double>());
    };
    const auto count = [&](const char* key) {
        return grouped(static_cast<unsigned long long>(std::llround(row[key].get<double>())));
    };
    return {row["scene"].get<std::string>(),
            row["path"].get<std::string>(),
            row["contestant"].get<std::string>(),
            number("errorPixels", "{:g}"),
            number("largestPixels", "{:.3f}"),
            number("largestPromised", "{:.3f}"),
            number("rmsPixels", "{:.3f}"),
            number("largestInSpace", "{:.3f}"),
            count("triangles"),
            count("submitted"),
            count("saturated"),
            count("streamedBytes"),
            fmt::format("{:.2f}", row["gpuBytes"].get<double>() / (1024.0 * 1024.0)),
            number("cullMilliseconds", "{:.2f}"),
            number("drawMilliseconds", "{:.2f}"),
            number("drawInterquartile", "{:.2f}"),
            number("gpuMilliseconds", "{:.2f}"),
            number("psnr", "{:.1f}"),
            number("ssim", "{:.4f}"),
            number("silhouettePixels", "{:.3f}")};
}

void measure(const Scene& scene, const CurveBenchmarkOptions& options, BenchmarkResult& result)
{
    const TemporaryDirectory folder;
    const Inputs inputs = makeInputs(scene, options, folder);
    const Json measured = runInChild([&] {
        fmt::print(stderr, "{}: contestants\n", scene.name);
        Contest contest(scene, inputs, options);
        Json rows = Json::array();
        for (const std::string& path : options.paths) {
            for (Json& row : contest.along(path)) { rows.push_back(std::move(row)); }
        }
        return Json{{"rows", rows}, {"renderer", contest.renderer()}};
    });
    result.glRenderer = measured["renderer"].get<std::string>();
    for (const Json& found : measured["rows"]) {
        Json row{{"scene", scene.name}};
        row.update(found);
        addTotals(row);
        result.tables.front().rows.push_back(tableRow(row));
        result.rows.push_back(std::move(row));
    }
}

} // namespace

BenchmarkResult benchmarkCurves(const std::vector<Scene>& scenes, const CurveBenchmarkOptions& options)
{
    BenchmarkResult result;
    result.tables.emplace_back().headers = {"scene",       "path",       "contestant", "asked px",  "largest px",
                                            "promised px", "rms px",     "in space",   "triangles", "submitted",
                                            "saturated",   "bytes sent", "GPU MiB",    "cull ms",   "draw ms",
                                            "±",           "GPU ms",     "PSNR dB",    "SSIM",      "silhouette px"};
    for (const Scene& scene : scenes) {
        try {
            measure(scene, options, result);
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = summarizeCurves(result.rows, kOurs);
    result.tables.push_back(equalErrorTable(result.summary));
    return result;
}

} // namespace osgTessLOD::benchmarks
