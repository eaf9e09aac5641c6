// SPDX-License-Identifier: MIT
// osgtesslodbake: makes a .tlod file of a surface, and tells what is in one.
#include "AssetInfo.h"
#include "ConsoleProgress.h"

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/AssetImages.h>
#include <osgTessLOD/asset/AtomicFile.h>
#include <osgTessLOD/asset/SurfaceMesh.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/BuiltinSurface.h>
#include <osgTessLOD/bake/DisplacementFiles.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <new>
#include <optional>
#include <stdexcept>

namespace {

using namespace osgTessLOD;

constexpr double kDegree = 3.14159265358979323846 / 180.0;

/// What the command line asks for.
struct Arguments {
    std::string source;
    std::string output;
    std::string report;
    std::string info;
    std::string check;
    std::string exported;
    std::string colorImage;
    std::string writeDisplacement;
    bake::DisplacementSampling sampling = bake::DisplacementSampling::Intersection;
    unsigned factor = 64;
    double creaseAngleDegrees = bake::ControlMeshOptions().creaseAngleRadians / kDegree;
    std::vector<double> spacing;
    std::vector<std::uint32_t> tile;
    bool noNormals = false;
    bool noUvs = false;
    bool embedTextures = false;
    bool quiet = false;
    bake::BakeOptions bake;
};

void declareDisplacement(CLI::App& app, Arguments& arguments)
{
    using Kind = bake::DisplacementOptions::Kind;
    bake::DisplacementOptions& map = arguments.bake.displaced;
    auto* image = app.add_option("--displacement", arguments.bake.displacement,
                                 "image by which the source, a base mesh with texture coordinates, is displaced");
    app.add_option("--scale", map.scale, "displacement per unit of the image; of terrain: z per unit of height")
        ->capture_default_str();
    app.add_option("--midlevel", map.midlevel, "value of the image that displaces nothing")
        ->capture_default_str()
        ->needs(image);
    app.add_option("--vector", map.kind,
                   "the image's channels are a vector: along tangent, bitangent and normal, or along the object's axes")
        ->transform(CLI::CheckedTransformer(
            std::map<std::string, Kind>{{"tangent", Kind::TangentVector}, {"object", Kind::ObjectVector}}))
        ->needs(image);
    app.add_option("--smooth", arguments.bake.smoothingSteps, "Catmull-Clark steps of a mesh, before anything else")
        ->capture_default_str()
        ->check(CLI::Range(0, 8));
}

void declareWrittenDisplacement(CLI::App& app, Arguments& arguments)
{
    using Sampling = bake::DisplacementSampling;
    app.add_flag("--elevation", arguments.bake.controlMesh.elevation,
                 "make patches of a mesh that are elevations of their triangles, as scalar displacement needs: usually more of them");
    auto* written = app.add_option("--write-displacement", arguments.writeDisplacement,
                                   "write the displacement of the patches' triangles, a scalar with --elevation and else a vector, as "
                                   "an image (.exr, .png, .tif), and the triangles beside it as .obj; -o may be left out");
    app.add_option("--sampling", arguments.sampling, "of a displacement map to write: where rays meet the surface, means around there, or the least mean square error")
        ->transform(CLI::CheckedTransformer(std::map<std::string, Sampling>{
            {"intersection", Sampling::Intersection}, {"interpolation", Sampling::Interpolation}, {"fit", Sampling::Fit}}))
        ->needs(written);
}

void declareTerrain(CLI::App& app, Arguments& arguments)
{
    bake::HeightOptions& heights = arguments.bake.heights;
    app.add_option("--spacing", arguments.spacing, "of terrain: distance between columns and, if different, between rows")
        ->expected(1, 2)
        ->check(CLI::PositiveNumber);
    app.add_option("--void", heights.voidValue, "of terrain: height that means no data");
    app.add_option(
           "--tile", arguments.tile,
           "of terrain: bake only tile i,j of n x n, column and row from 0 in the north-west; tiles of one image meet "
           "without cracks")
        ->delimiter(',')
        ->expected(3);
    app.add_option("--fill-voids", heights.largestFilledVoid, "of terrain: fill voids of up to so many samples")
        ->capture_default_str();
}

void declareArguments(CLI::App& app, Arguments& arguments)
{
    app.add_option("source", arguments.source,
                   "mesh (PLY, OBJ, OFF, STL), terrain (PNG, TIFF, GeoTIFF, EXR, HGT), or builtin:NAME with NAME one of " +
                       fmt::format("{}", fmt::join(bake::builtinSurfaceNames(), ", ")));
    app.add_option("-o,--output", arguments.output, "file to write: .tlod of a bake, .ply of --export");
    app.add_option("--report", arguments.report, "write seconds, peak memory and error per stage and level as JSON");
    app.add_option("--max-factor", arguments.bake.maxFactor, "tessellation factor of the finest level: 1, 2, 4 ... 64")
        ->capture_default_str();
    app.add_option("--patches", arguments.bake.controlMesh.patches, "patches to make of a mesh; 0: by its size")
        ->capture_default_str();
    app.add_option("--color-image", arguments.colorImage,
                   "image file of the surface's colour by its texture coordinates, which the asset will name");
    app.add_flag("--embed-textures", arguments.embedTextures, "put the images of the materials into the file");
    app.add_option("--base", arguments.bake.base,
                   "coarse mesh file with the same texture coordinates, whose triangles become the patches");
    app.add_option("--uv-tolerance", arguments.bake.uvTolerance,
                   "with --base: how far its texture coordinates may be from all of the source's")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    declareDisplacement(app, arguments);
    declareWrittenDisplacement(app, arguments);
    declareTerrain(app, arguments);
    app.add_option("--patch-tolerance", arguments.bake.patchTolerance,
                   "bisect patches of a mesh until their finest level is about this near, as a part of the diagonal")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    app.add_option("--crease-angle", arguments.creaseAngleDegrees, "edges sharper than this many degrees are creases")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 180.0));
    app.add_option("--triangles", arguments.bake.builtinTriangles, "scale a builtin source to about so many triangles");
    app.add_option("--technique", arguments.bake.technique, "how levels are made")
        ->capture_default_str()
        ->check(CLI::IsMember(bake::techniqueNames()));
    app.add_option("--ladder", arguments.bake.ladder,
                   "factors of the levels, such as 1,2,4,6,8,12,16: rising, 1 and even ones, the last --max-factor; without: "
                   "powers of two. Technique strips only")
        ->delimiter(',');
    app.add_option(
           "--tolerance", arguments.bake.tolerance,
           "store no finer levels of a patch than it takes to be this near, as a part of the diagonal; 0: store all")
        ->capture_default_str();
    app.add_option("--threads", arguments.bake.threads, "threads to use; 0: all processors")->capture_default_str();
    app.add_flag("--no-normals", arguments.noNormals, "store no normal texture");
    app.add_option("--normal-resolution", arguments.bake.normalResolution,
                   "normals along a side of each patch, a power of two; 0: twice the finest factor, the most");
    app.add_option("--normal-map", arguments.bake.normalMap,
                   "bake a mesh's normals into an image per material of so many texels a side, 64, 128 ... 8192, over its texture "
                   "coordinates, which must not overlap; without: into textures per patch")
        ->excludes("--no-normals")
        ->excludes("--normal-resolution");
    app.add_flag("--no-uvs", arguments.noUvs, "leave texture coordinates out, and do without their seams");
    app.add_flag("--strict", arguments.bake.strict,
                 "refuse sources that have to be repaired or refer to files that are not there");
    app.add_flag("-q,--quiet", arguments.quiet, "show no progress");
    auto* info = app.add_option("--info", arguments.info, "print what is in this .tlod file as JSON");
    auto* check = app.add_option("--check", arguments.check, "tell whether this .tlod file is sound");
    auto* exported = app.add_option("--export", arguments.exported, "write the surface of this .tlod file as PLY");
    app.add_option("--factor", arguments.factor, "level to export")->capture_default_str()->needs(exported);
    info->excludes(check)->excludes(exported);
    check->excludes(exported);
}

void placeImages(const Arguments& arguments, LodAsset& asset)
{
    try {
        if (!arguments.colorImage.empty()) { setColorImage(asset, arguments.colorImage); }
        if (arguments.embedTextures) { embedImages(asset); }
        moveReferences(asset, "", std::filesystem::path(arguments.output).parent_path().string());
    } catch (const AssetError& error) {
        throw AssetError(arguments.source + ": " + error.what());
    }
}

void printFindings(const bake::BakeReport& report)
{
    if (!report.repairs.empty()) { fmt::print(stderr, "{}: repaired: {}\n", report.source, fmt::join(report.repairs, "; ")); }
    for (const std::string& warning : report.warnings) { fmt::print(stderr, "{}: warning: {}\n", report.source, warning); }
}

void writeDisplacement(const bake::DisplacementFiles& files, const bake::BakeReport& report)
{
    files.write();
    fmt::print("{}: {} x {} pixels, {}: {} patches; scale {:.17g}, midlevel {:.17g}\n{}\n", files.imagePath, files.width,
               files.height, files.meshPath, report.patches, files.options.scale, files.options.midlevel, files.command());
}

void bakeToFile(Arguments& arguments)
{
    if (arguments.output.empty() && arguments.writeDisplacement.empty()) {
        throw AssetError("where to write is not said: -o FILE.tlod");
    }
    arguments.bake.controlMesh.creaseAngleRadians = arguments.creaseAngleDegrees * kDegree;
    arguments.bake.normals = !arguments.noNormals;
    arguments.bake.heights.scale = arguments.bake.displaced.scale;
    if (!arguments.spacing.empty()) {
        arguments.bake.heights.spacing = {{arguments.spacing.front(), arguments.spacing.back()}};
    }
    if (!arguments.tile.empty()) { arguments.bake.tile = {arguments.tile[0], arguments.tile[1], arguments.tile[2]}; }
    arguments.bake.uvs = !arguments.noUvs;
    ConsoleProgress progress(arguments.quiet);
    bake::BakeReport report;
    std::optional<bake::DisplacementFiles> displacement;
    if (!arguments.writeDisplacement.empty()) {
        bake::checkDisplacementPath(arguments.writeDisplacement, arguments.source);
        arguments.bake.useMap = [&](const bake::PatchMap& map, unsigned finestFactor) {
            displacement = bake::makeDisplacementFiles(map, arguments.writeDisplacement, finestFactor, arguments.sampling, progress);
        };
    }
    if (arguments.output.empty()) {
        bake::makeMap(arguments.source, arguments.bake, progress, report);
    } else {
        LodAsset asset = bake::bakeSource(arguments.source, arguments.bake, progress, report);
        placeImages(arguments, asset);
        writeTlod(arguments.output, asset);
    }
    if (displacement) { writeDisplacement(*displacement, report); }
    if (!arguments.report.empty()) {
        AtomicFile file(arguments.report);
        file.stream() << report.toJson() << "\n";
        file.commit();
    }
    if (!arguments.quiet) { printFindings(report); }
    if (!arguments.quiet && !arguments.output.empty()) {
        const double error = report.stored.largestFinestError;
        fmt::print(stderr,
                   "{}: {} triangles in {} patches, {} at the finest levels, error {:.3g} ({:.4f} % of the diagonal), "
                   "{:.1f} s\n",
                   arguments.output, report.sourceTriangles, report.patches, report.stored.finestTriangles, error,
                   100.0 * error / report.diagonal, report.seconds);
    }
}

void run(Arguments& arguments)
{
    if (!arguments.info.empty()) {
        fmt::print("{}\n", describeTlod(arguments.info));
    } else if (!arguments.check.empty()) {
        readTlod(arguments.check);
        fmt::print("{}: sound\n", arguments.check);
    } else if (!arguments.exported.empty()) {
        if (arguments.output.empty()) { throw AssetError("where to write is not said: -o FILE.ply"); }
        writePly(arguments.output, extractSurface(readTlod(arguments.exported), arguments.factor));
    } else if (!arguments.source.empty()) {
        bakeToFile(arguments);
    } else {
        throw AssetError("nothing to do: name a source, or --info, --check or --export a file (--help tells more)");
    }
}

/// The file that the program was to work on, for messages.
const std::string& subjectOf(const Arguments& arguments)
{
    for (const std::string* file : {&arguments.info, &arguments.check, &arguments.exported}) {
        if (!file->empty()) { return *file; }
    }
    return arguments.source;
}

} // namespace

int main(int argc, char** argv)
{
    Arguments arguments;
    CLI::App app("Bakes a surface into a .tlod file for osgTessLOD, and tells what is in one.", "osgtesslodbake");
    declareArguments(app, arguments);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 1;
    }
    try {
        run(arguments);
        if (std::fflush(stdout) != 0) { throw AssetError("the standard output cannot be written"); }
        return 0;
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "osgtesslodbake: {}: not enough memory\n", subjectOf(arguments));
    } catch (const std::exception& error) {
        fmt::print(stderr, "osgtesslodbake: {}\n", error.what());
    }
    return 1;
}
