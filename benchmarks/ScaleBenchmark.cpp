// SPDX-License-Identifier: MIT
#include "BakedScene.h"
#include "Benchmark.h"
#include "ChildProcess.h"
#include "HeadlessStage.h"

#include <osgTessLOD/asset/StreamedAsset.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <osgTessLOD/render/VideoMemory.h>
#include <support/ScreenCamera.h>
#include <support/TemporaryDirectory.h>

#include <fmt/format.h>
#include <osg/Timer>

#include <algorithm>
#include <array>
#include <cstdint>
#include <exception>
#include <memory>
#include <utility>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr double kMebibyte = 1024.0 * 1024.0;
constexpr int kWidth = 1280;
constexpr int kHeight = 800;
constexpr std::array<double, 2> kDistances{50.0, 1.5}; // of the eye, in diagonals

Json bake(const Scene& scene, std::uint64_t triangles, const std::string& technique, const std::string& path)
{
    bake::BakeOptions options;
    options.technique = technique;
    options.builtinTriangles = triangles;
    const BakedScene baked = bakeToFile(scene, options, path);
    return {{"scene", scene.name},
            {"sourceTriangles", baked.report.sourceTriangles},
            {"patches", baked.report.patches},
            {"bakeSeconds", baked.report.seconds},
            {"bakePeakMebibytes", static_cast<double>(baked.report.peakBytes) / kMebibyte},
            {"fileBytes", baked.fileBytes}};
}

/// From the south, 30° high.
ScreenCamera cameraAt(const TessLODDrawable& model, double diagonals)
{
    const osg::BoundingBox& box = model.getBoundingBox();
    const osg::Vec3d center(box.center());
    const double diagonal = 2.0 * static_cast<double>(box.radius());
    const double distance = diagonals * diagonal;
    ScreenCamera camera;
    camera.localToEye.makeLookAt(center + osg::Vec3d(0.0, -0.866, 0.5) * distance, center, osg::Vec3d(0.0, 0.0, 1.0));
    camera.projection.makePerspective(30.0, static_cast<double>(kWidth) / kHeight, 0.01 * distance,
                                      distance + diagonal);
    camera.width = kWidth;
    camera.height = kHeight;
    return camera;
}

/// As an application does that has a window open: reads the file and shows it.
Json show(const std::string& path, double diagonals, unsigned frames)
{
    HeadlessStage stage(kWidth, kHeight);
    const osg::Timer& timer = *osg::Timer::instance();
    const osg::Timer_t start = timer.tick();
    const auto asset = std::make_shared<const StreamedAsset>(path);
    const osg::ref_ptr<TessLODDrawable> model = new TessLODDrawable;
    model->setStreamedAsset(asset);
    const double load = timer.delta_s(start, timer.tick());
    const unsigned number = stage.add(model.get());
    stage.look(cameraAt(*model, diagonals));
    HeadlessStage::Frame frame = stage.draw(number);
    const double firstPicture = timer.delta_s(start, timer.tick());
    std::vector<double> milliseconds;
    for (unsigned k = 0; k < frames; ++k) {
        frame = stage.draw(number);
        milliseconds.push_back(frame.cullMilliseconds + frame.drawMilliseconds);
    }
    const VideoMemory::Statistics memory = VideoMemory::shared().statistics();
    return {{"diagonals", diagonals},
            {"loadSeconds", load},
            {"firstPictureSeconds", firstPicture},
            {"frameMilliseconds", median(milliseconds)},
            {"triangles", frame.triangles.value_or(0)},
            {"levelsRead", asset->levelsRead()},
            {"levels", asset->levelCount()},
            {"gpuMebibytes", static_cast<double>(memory.bytes) / kMebibyte},
            {"gpuWholeMebibytes", static_cast<double>(memory.wholeBytes) / kMebibyte},
            {"renderer", stage.renderer()}};
}

std::vector<std::string> tableRow(const Json& row)
{
    const auto number = [&](const char* key, int digits) { return fmt::format("{:.{}f}", row[key].get<double>(), digits); };
    const auto count = [&](const char* key) { return grouped(row[key].get<std::uint64_t>()); };
    return {row["scene"].get<std::string>(),  count("sourceTriangles"),
            count("patches"),                 number("bakeSeconds", 1),
            number("bakePeakMebibytes", 0),   count("fileBytes"),
            fmt::format("{:g}", row["diagonals"].get<double>()),
            number("loadSeconds", 3),         count("levelsRead") + " of " + count("levels"),
            number("firstPictureSeconds", 3),
            count("triangles"),               number("frameMilliseconds", 2),
            number("gpuMebibytes", 1),        number("gpuWholeMebibytes", 1)};
}

/// Of the last of the scene's sizes to its first one, per view the time of a frame.
void summarize(const Json& rows, Json& summary)
{
    Json ratios = Json::object();
    double firstPicture = 0.0;
    for (const Json& last : rows) {
        for (const Json& first : rows) {
            if (first["scene"] != last["scene"] || first["diagonals"] != last["diagonals"]) { continue; }
            const std::string key = fmt::format("{} {:g}", last["scene"].get<std::string>(), last["diagonals"].get<double>());
            ratios[key] = last["frameMilliseconds"].get<double>() / first["frameMilliseconds"].get<double>();
            break;
        }
        firstPicture = std::max(firstPicture, last["firstPictureSeconds"].get<double>());
    }
    summary = {{"frame_over_smallest", ratios}, {"longest_first_picture_seconds", firstPicture}};
}

} // namespace

BenchmarkResult benchmarkScale(const std::vector<Scene>& scenes, const ScaleBenchmarkOptions& options)
{
    const TemporaryDirectory folder;
    BenchmarkResult result;
    result.tables.emplace_back().headers = {"scene",     "triangles",       "patches",   "bake s",   "peak MiB",
                                            "file bytes", "diagonals",      "load s",    "levels read", "first picture s",
                                            "drawn",     "frame ms",        "GPU MiB",   "of"};
    for (const Scene& scene : scenes) {
        for (const std::uint64_t triangles : options.triangles) {
            try {
                fmt::print(stderr, "{}: {} triangles\n", scene.name, grouped(triangles));
                const std::string path = folder.file("scene.tlod");
                const Json baked = runInChild([&] { return bake(scene, triangles, options.technique, path); });
                for (const double diagonals : kDistances) {
                    Json row = baked;
                    row.update(runInChild([&] { return show(path, diagonals, options.frames); }));
                    result.glRenderer = row["renderer"].get<std::string>();
                    row.erase("renderer");
                    result.tables.front().rows.push_back(tableRow(row));
                    result.rows.push_back(std::move(row));
                }
            } catch (const std::exception& error) {
                result.failures.push_back(scene.name + ": " + error.what());
            }
        }
    }
    summarize(result.rows, result.summary);
    return result;
}

} // namespace osgTessLOD::benchmarks
