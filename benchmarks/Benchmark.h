// SPDX-License-Identifier: MIT
#pragma once

#include "CameraPaths.h"
#include "ResultTable.h"
#include "Scenes.h"

#include <osgTessLOD/bake/Baker.h>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace osgTessLOD::benchmarks {

/// What a benchmark found.
struct BenchmarkResult {
    nlohmann::ordered_json summary = nlohmann::ordered_json::object();
    nlohmann::ordered_json rows = nlohmann::ordered_json::array(); ///< one object per row of the first table, and more in it
    std::vector<ResultTable> tables;
    std::string glRenderer;            ///< empty: nothing was drawn
    std::vector<std::string> failures; ///< "scene: why", for each scene that could not be measured
};

struct BakeBenchmarkOptions {
    unsigned runs = 3;               ///< of each measurement; times are medians
    std::string technique = bake::BakeOptions().technique;
    std::string keepFolder;          ///< where .tlod files are kept, named after their scenes; empty: nowhere
    unsigned yardstickSeconds = 120; ///< that another library may take for its chain of levels
};

/// Bakes every scene, each time in a process of its own, and has meshoptimizer and osgUtil::Simplifier simplify what it
/// was baked from, as yardsticks.
BenchmarkResult benchmarkBakes(const std::vector<Scene>& scenes, const BakeBenchmarkOptions& options);

/// Draws every scene, baked first unless it is a .tlod file, from several distances and at several errors without a
/// window. Times are medians over `frames` frames.
BenchmarkResult benchmarkFrames(const std::vector<Scene>& scenes, unsigned frames);

/// Simplifies every scene by each of `methods` (simplifyMethods(), all if empty) and compares their errors with those of
/// uniform levels (Lambert fig. 4.10): the mean over all directions and patches of E(d).
BenchmarkResult benchmarkSimplification(const std::vector<Scene>& scenes, const std::vector<std::string>& methods);
/// "voluv+refit+cost" and so on: placement, then whether refit, then whether chosen by C_edge.
std::vector<std::string> simplifyMethods();

/// Bakes every scene by strips and with uniform levels, the finest of factor `maxFactor`, and compares how far the levels
/// of each factor lie from the source and how many bytes they take.
BenchmarkResult benchmarkLevels(const std::vector<Scene>& scenes, unsigned maxFactor);

/// Bakes every scene with levels at powers of two and at more factors in between, both up to `maxFactor`, and compares the
/// triangles drawn at equal errors and the files' sizes.
BenchmarkResult benchmarkLadders(const std::vector<Scene>& scenes, unsigned maxFactor);

/// How far the approximations of E(d), the error as a function of the view direction, are above it, per scene and factor
/// (Lambert fig. 2.4), over `directions` random directions for every patch and level.
BenchmarkResult benchmarkMetric(const std::vector<Scene>& scenes, std::size_t directions);

/// The largest deviation on screen of what is drawn, in terms of the one asked for, over `views` random views of every scene
/// and errors of 0.5, 1 and 4 pixels, with either bound; a scene of which Conservative is above 1 has failed. `points`: random ones
/// of the drawn triangles that are compared in each view and error, besides vertices and crossings.
BenchmarkResult benchmarkBound(const std::vector<Scene>& scenes, unsigned views, std::size_t points);

/// Triangles drawn along an orbit of every scene by the error as seen and by the isotropic one (Lambert fig. 2.6).
BenchmarkResult benchmarkViews(const std::vector<Scene>& scenes);

/// What selecting levels and patches takes: of every scene from several places, and of a thousand to a million patches, as
/// many as ten thousand if `quick`. Times are medians over `runs`.
BenchmarkResult benchmarkSelection(const std::vector<Scene>& scenes, unsigned runs, bool quick);

/// Bytes on the GPU and in the file for each vertex of all patches at their finest levels.
BenchmarkResult benchmarkMemory(const std::vector<Scene>& scenes);

/// Bakes every scene, a height image without large voids, and compares how far what is drawn at some errors is above or below its
/// samples with a uniform grid and with what meshoptimizer makes of them, of the same number of triangles; and how many triangles
/// these need to be as near.
BenchmarkResult benchmarkTerrain(const std::vector<Scene>& scenes);

struct SceneBenchmarkOptions {
    unsigned frames = 5;     ///< to take the median of
    unsigned maxFactor = 64; ///< of the finest levels
};

/// Draws every scene 400 times, on a grid and turned at random, in 1920 × 1140 pixels at an error of one: with uniform levels by
/// the isotropic error and by the one seen, with strips straight and freely chosen (Lambert fig. 4.11), and these by a
/// TessLODInstances and by MatrixTransforms.
BenchmarkResult benchmarkScenes(const std::vector<Scene>& scenes, const SceneBenchmarkOptions& options);

/// Triangles per second of each backend relative to those of the same triangles in one static vertex and index buffer: of as many
/// copies of every scene at its finest levels as make each of these numbers of triangles. Medians over `frames` frames.
BenchmarkResult benchmarkThroughput(const std::vector<Scene>& scenes, const std::vector<std::uint64_t>& leastTriangles,
                                    unsigned frames);

struct LookBenchmarkOptions {
    std::string colorImage; ///< of all scenes; empty: as their materials say
    std::string keepFolder; ///< where pictures are kept; empty: nowhere
};

/// Draws every scene, a mesh file, at an error of one pixel and all triangles of its source, under the same light from four distances,
/// and compares the pictures.
BenchmarkResult benchmarkLook(const std::vector<Scene>& scenes, const LookBenchmarkOptions& options);

/// Makes patches of every scene with and without elevations, meets these with `rays` random rays, and compares how far tiles of each of these
/// factors are from the scene by the ways to sample displacement (Livny et al. 2012, table 5). A ray that meets its patch other
/// than once fails the scene.
BenchmarkResult benchmarkDisplacement(const std::vector<Scene>& scenes, const std::vector<unsigned>& factors, std::size_t rays);

struct CurveBenchmarkOptions {
    std::vector<std::string> paths = pathNames();
    PathOptions path;
    std::vector<double> errorsPixels{0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0}; ///< asked for
    unsigned runs = 3;                        ///< of each frame, to take the median of
    std::size_t points = 100'000;             ///< of either surface that are measured in a frame
    unsigned maxFactor = 64;                  ///< of the finest levels
    unsigned simplifierSeconds = 60;          ///< that osgUtil::Simplifier may take for its levels
    std::uint64_t mostTriangles = 20'000'000; ///< of a frame of full meshes; where there would be more, they are left out
    unsigned seed = 1;                        ///< of the order in which contestants are drawn
};

/// Draws every scene along paths with our techniques and with what else is used, each for these errors, and compares what
/// is drawn with the source: error on screen, triangles, times, memory, pictures.
BenchmarkResult benchmarkCurves(const std::vector<Scene>& scenes, const CurveBenchmarkOptions& options);

struct ScaleBenchmarkOptions {
    std::vector<std::uint64_t> triangles{1'000'000, 4'000'000, 28'311'552}; ///< about so many of each scene
    std::string technique = bake::BakeOptions().technique;
    unsigned frames = 5; ///< to take the median of
};

/// Bakes every scene, a built-in surface, in these sizes, and reads and shows what was baked: what grows with the source.
BenchmarkResult benchmarkScale(const std::vector<Scene>& scenes, const ScaleBenchmarkOptions& options);

/// 0 without values.
double median(std::vector<double> values);
double mean(const std::vector<double>& values);

} // namespace osgTessLOD::benchmarks
