// SPDX-License-Identifier: MIT
// The viewer as a program: what it writes and how it ends, with no display.
#include <asset/SyntheticAsset.h>
#include <viewer/ViewerProgram.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <osg/Image>
#include <osg/Matrixd>
#include <osgDB/ReadFile>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

namespace osgTessLOD {
namespace {

std::size_t colorCount(const osg::Image& image)
{
    std::map<std::array<float, 3>, int> colors;
    for (int y = 0; y < image.t(); ++y) {
        for (int x = 0; x < image.s(); ++x) {
            const osg::Vec4 color = image.getColor(static_cast<unsigned>(x), static_cast<unsigned>(y));
            ++colors[{color.r(), color.g(), color.b()}];
        }
    }
    return colors.size();
}

class Viewer : public testing::Test {
protected:
    Viewer() { writeTlod(model(), makeSyntheticAsset(16, true)); }

    std::string model() const { return folder.file("x.tlod"); }
    Outcome run(const std::string& arguments) const { return runViewer(folder, arguments); }

    TemporaryDirectory folder;
};

TEST_F(Viewer, HeadlessWritesAPicture)
{
    const Outcome outcome = run("--headless --size 160x120 --screenshot " + folder.file("p.png") + " " + model());
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    EXPECT_NE(outcome.output.find("triangles"), std::string::npos) << outcome.output;
    const osg::ref_ptr<osg::Image> image = osgDB::readRefImageFile(folder.file("p.png"));
    ASSERT_TRUE(image);
    EXPECT_EQ(image->s(), 160);
    EXPECT_EQ(image->t(), 120);
    EXPECT_EQ(image->getColor(80U, 60U).a(), 1.0F);
    EXPECT_GT(colorCount(*image), 16U);
    EXPECT_NE(image->getColor(80U, 60U), image->getColor(0U, 0U)) << "the model is not in the middle";
    EXPECT_EQ(folder.entryCount(), 2U) << "something else was left behind";
}

TEST_F(Viewer, HeadlessCapturesAClosedSurface)
{
    for (const char* error : {"0.5", "3.7", "40"}) {
        const Outcome outcome =
            run("--headless --no-cull --size 400x300 --error-pixels " + std::string(error) + " --capture " +
                folder.file("c.ply") + " --stats " + folder.file("s.json") + " " + model());
        ASSERT_EQ(outcome.status, 0) << outcome.output;
        const Ply ply = readPly(folder.file("c.ply"));
        EXPECT_GE(ply.faces.size(), 8U);
        EXPECT_EQ(openEdges(ply.faces), 0U) << "error " << error;
        for (const auto& face : ply.faces) {
            for (const std::uint32_t vertex : face) { ASSERT_LT(vertex, ply.vertices); }
        }

        const nlohmann::json stats = readJson(folder.file("s.json"));
        EXPECT_EQ(stats["capture"]["triangles"], stats["triangles"]) << "announced, and captured from the GPU";
        EXPECT_EQ(stats["capture"]["faces"], ply.faces.size());
        EXPECT_EQ(stats["capture"]["vertices"], ply.vertices);
        EXPECT_EQ(stats["capture"]["faces"].get<std::size_t>() +
                      stats["capture"]["degenerateTriangles"].get<std::size_t>(),
                  stats["triangles"].get<std::size_t>());
    }
}

TEST_F(Viewer, HeadlessStatisticsAgreeWithThemselves)
{
    const Outcome outcome = run("--headless --no-cull --size 320x200 --fov 40 --frames 3 --error-pixels 2.5"
                                " --camera 0,-5,0,0,0,0,0,0,1 --stats " +
                                folder.file("s.json") + " " + model());
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    const nlohmann::json stats = readJson(folder.file("s.json"));

    EXPECT_EQ(stats["viewport"]["width"], 320);
    EXPECT_EQ(stats["viewport"]["height"], 200);
    EXPECT_EQ(stats["errorPixels"], 2.5);
    EXPECT_EQ(stats["patchesDrawn"], 8);
    EXPECT_EQ(stats["patchesCulled"], 0);
    EXPECT_LE(stats["patchesSaturated"], 8);
    std::size_t patches = 0;
    std::size_t triangles = 0;
    for (const auto& [factor, count] : stats["patchesByFactor"].items()) {
        patches += count.get<std::size_t>();
        triangles +=
            count.get<std::size_t>() * TessellationPattern::triangleCount(static_cast<unsigned>(std::stoul(factor)));
    }
    EXPECT_EQ(stats["patchesDrawn"], patches);
    EXPECT_EQ(stats["triangles"], triangles);

    const auto view = stats["view"].get<std::vector<double>>();
    ASSERT_EQ(view.size(), 16U);
    const osg::Matrixd expected = osg::Matrixd::lookAt(osg::Vec3d(0, -5, 0), osg::Vec3d(), osg::Vec3d(0, 0, 1));
    for (std::size_t k = 0; k < 16; ++k) { EXPECT_NEAR(view[k], expected.ptr()[k], 1e-12); }
    const auto projection = stats["projection"].get<std::vector<double>>();
    ASSERT_EQ(projection.size(), 16U);
    EXPECT_NEAR(projection[5], 1.0 / std::tan(osg::DegreesToRadians(20.0)), 1e-9);
    EXPECT_NEAR(projection[0], projection[5] * 200.0 / 320.0, 1e-9);

    EXPECT_EQ(stats["times"]["frames"], 3);
    EXPECT_GT(stats["times"]["cullMilliseconds"], 0.0);
    EXPECT_GT(stats["times"]["drawMilliseconds"], 0.0);
    EXPECT_GE(stats["times"]["frameMilliseconds"].get<double>(), stats["times"]["drawMilliseconds"].get<double>());
    EXPECT_FALSE(stats["gl"]["renderer"].get<std::string>().empty());
    EXPECT_FALSE(stats["gl"]["version"].get<std::string>().empty());
}

TEST_F(Viewer, AsksForTheErrorOfOptionOrPlugin)
{
    const std::string stats = folder.file("s.json");
    const std::string common = "--headless --size 100x100 --stats " + stats + " " + model();
    ASSERT_EQ(run(common).status, 0);
    EXPECT_EQ(readJson(stats)["errorPixels"], 1.0);
    ASSERT_EQ(run("-O errorPixels=3 " + common).status, 0);
    EXPECT_EQ(readJson(stats)["errorPixels"], 3.0);
    ASSERT_EQ(run("-O errorPixels=3 --error-pixels 7 " + common).status, 0);
    EXPECT_EQ(readJson(stats)["errorPixels"], 7.0);
}

TEST_F(Viewer, SelectsByTheMetricAndBoundAskedFor)
{
    const auto triangles = [&](const std::string& options) {
        const std::string stats = folder.file("s.json");
        const Outcome outcome = run("--headless --size 400x400 --error-pixels 4 --frames 1 " + options + " --stats " +
                                    stats + " " + model());
        EXPECT_EQ(outcome.status, 0) << outcome.output;
        return readJson(stats)["triangles"].get<unsigned>();
    };
    EXPECT_EQ(triangles("--metric view --bound conservative"), triangles("")) << "the defaults";
    EXPECT_LT(triangles("--bound first-order"), triangles("")) << "of which the bound costs something";
    EXPECT_EQ(triangles("--bound first-order --metric isotropic"),
              triangles("-O \"bound=first-order metric=isotropic\""));
}

TEST_F(Viewer, DrawsWithTheBackendAskedFor)
{
    const auto backends = [&](const std::string& options) {
        const std::string stats = folder.file("s.json");
        const Outcome outcome = run("--headless --size 100x100 --frames 1 " + options + " --stats " + stats + " --capture " +
                                    folder.file("c.ply") + " " + model());
        EXPECT_EQ(outcome.status, 0) << outcome.output;
        const nlohmann::json json = readJson(stats);
        EXPECT_EQ(json["capture"]["triangles"], json["triangles"]);
        return json["backends"];
    };
    using Names = nlohmann::json::array_t;
    EXPECT_EQ(backends("--backend tessellation"), Names{"tessellation"});
    EXPECT_EQ(backends("--backend instanced"), Names{"instanced"});
    EXPECT_EQ(backends("-O backend=instanced"), Names{"instanced"});
    EXPECT_EQ(backends("-O backend=instanced --backend auto").size(), 1U);
}

TEST_F(Viewer, SelectsInTheControlShader)
{
    const auto statistics = [&](const std::string& options) {
        const std::string stats = folder.file("s.json");
        const Outcome outcome = run("--headless --size 100x100 --frames 1 --no-cull --backend tessellation " + options +
                                    " --stats " + stats + " --capture " + folder.file("c.ply") + " " + model());
        EXPECT_EQ(outcome.status, 0) << outcome.output;
        EXPECT_EQ(outcome.output.find("at most ") != std::string::npos, options != "") << outcome.output;
        return readJson(stats);
    };
    const nlohmann::json cpu = statistics("");
    EXPECT_EQ(cpu["upperBound"], false);
    for (const char* options : {"--selection gpu", "-O selection=gpu"}) {
        const nlohmann::json gpu = statistics(options);
        EXPECT_EQ(gpu["upperBound"], true);
        EXPECT_EQ(gpu["patchesDrawn"], cpu["patchesDrawn"]);
        EXPECT_GT(gpu["triangles"], cpu["triangles"]);
        // Rounding may make a level another, and a level a patch's triangles; not many.
        EXPECT_NEAR(gpu["capture"]["triangles"].get<double>(), cpu["triangles"].get<double>(),
                    0.01 * cpu["triangles"].get<double>());
    }
}

TEST_F(Viewer, DrawsWithoutTessellationHardware)
{
    // Mesa's own means to make a driver offer less; others do not know them, and then there is nothing to test here.
    setenv("MESA_GL_VERSION_OVERRIDE", "3.3COMPAT", 1);
    setenv("MESA_GLSL_VERSION_OVERRIDE", "330", 1);
    const std::string stats = folder.file("s.json");
    const auto runWith = [&](const std::string& options) {
        return run("--headless --size 100x100 --stats " + stats + " --capture " + folder.file("c.ply") + " " + options +
                   model());
    };
    const Outcome whenDrawn = runWith("--selection gpu ");
    const nlohmann::json selectedWhenDrawn = whenDrawn.status == 0 ? readJson(stats) : nlohmann::json();
    const Outcome outcome = runWith("");
    unsetenv("MESA_GL_VERSION_OVERRIDE");
    unsetenv("MESA_GLSL_VERSION_OVERRIDE");
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    const nlohmann::json json = readJson(stats);
    if (json["gl"]["version"].get<std::string>().rfind("3.3", 0) != 0) { GTEST_SKIP() << json["gl"]; }
    EXPECT_EQ(json["backends"], nlohmann::json::array_t{"instanced"});
    EXPECT_GT(json["triangles"], 0U);
    EXPECT_EQ(json["capture"]["triangles"], json["triangles"]);
    EXPECT_EQ(selectedWhenDrawn["capture"], json["capture"]) << whenDrawn.output;
    EXPECT_EQ(selectedWhenDrawn["backends"], json["backends"]);
}

TEST_F(Viewer, TracesSelectionsAlongAPath)
{
    // Towards the model and past it, by the path format of osgviewer: time, place, rotation; looking along −z, y up.
    std::string path;
    for (int k = 0; k <= 4; ++k) { path += std::to_string(k) + " 0 0 " + std::to_string(12 - 2.5 * k) + " 0 0 0 1\n"; }
    writeBytes(folder.file("p.path"), path);
    const std::string common = "--headless --size 200x200 --error-pixels 2 -p " + folder.file("p.path") + " --trace " +
                               folder.file("t.jsonl") + " --stats " + folder.file("s.json") + " " + model();
    const auto linesOf = [&](const std::string& options) {
        const Outcome outcome = run(options + common);
        EXPECT_EQ(outcome.status, 0) << outcome.output;
        std::vector<nlohmann::json> lines;
        std::istringstream text(readBytes(folder.file("t.jsonl")));
        for (std::string line; std::getline(text, line);) { lines.push_back(nlohmann::json::parse(line)); }
        return lines;
    };
    const std::vector<nlohmann::json> lines = linesOf("--frames 9 ");
    ASSERT_EQ(lines.size(), 9U);
    double finest = 0.0; // level of any patch
    for (std::size_t k = 0; k < lines.size(); ++k) {
        EXPECT_EQ(lines[k]["frame"], k);
        ASSERT_EQ(lines[k]["selections"].size(), 1U);
        const nlohmann::json& selection = lines[k]["selections"][0];
        EXPECT_NEAR(selection["eye"][2].get<double>(), 12.0 - 1.25 * static_cast<double>(k), 1e-4);
        EXPECT_EQ(selection["errorPixels"], 2.0);
        ASSERT_EQ(selection["patches"].size(), selection["patchesDrawn"].get<std::size_t>());
        const double before = finest;
        finest = 0.0;
        for (const nlohmann::json& patch : selection["patches"]) {
            finest = std::max({finest, patch[1].get<double>(), patch[2].get<double>(), patch[3].get<double>()});
        }
        EXPECT_GE(finest, before) << "finer as it comes nearer";
    }
    EXPECT_GT(finest, 1.0) << "levels rose";
    // The statistics are those of the path's end, where the last frame was drawn.
    EXPECT_EQ(readJson(folder.file("s.json"))["triangles"], lines.back()["selections"][0]["triangles"]);
    EXPECT_EQ(linesOf("--frames 9 "), lines) << "the same every time";
    EXPECT_EQ(linesOf("").size(), 5U);
    EXPECT_EQ(run("--camera 0,-5,0,0,0,0,0,0,1 " + common).status, 1) << "one or the other";
}

TEST_F(Viewer, CapsTheFactor)
{
    const Outcome outcome = run("--headless --size 400x400 --error-pixels 0.01 --max-factor 4 --stats " +
                                folder.file("s.json") + " " + model());
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    const nlohmann::json stats = readJson(folder.file("s.json"));
    unsigned long largest = 0;
    for (const auto& [factor, count] : stats["patchesByFactor"].items()) {
        largest = std::max(largest, std::stoul(factor));
    }
    EXPECT_EQ(largest, 4U) << "and so near to the surface no less";
}

TEST_F(Viewer, CullsPatchesOutsideTheView)
{
    // A narrow view past the side x > 0.5: the four patches at x < 0 are out, the other four in.
    const std::string view =
        "--headless --size 100x100 --fov 10 --camera 0,-5,0,1,0,0,0,0,1 --stats " + folder.file("s.json");
    ASSERT_EQ(run(view + " " + model()).status, 0);
    const nlohmann::json culled = readJson(folder.file("s.json"));
    EXPECT_EQ(culled["patchesCulled"], 4);
    EXPECT_EQ(culled["patchesDrawn"], 4);
    ASSERT_EQ(run(view + " --no-cull " + model()).status, 0);
    EXPECT_EQ(readJson(folder.file("s.json"))["patchesDrawn"], 8);
}

TEST_F(Viewer, DrawsWireframeAndLevelsDifferently)
{
    const auto picture = [&](const std::string& options) {
        const std::string path = folder.file("p.png");
        EXPECT_EQ(run("--headless --size 120x120 --error-pixels 4 " + options + " --screenshot " + path + " " + model())
                      .status,
                  0);
        return readBytes(path);
    };
    const std::string plain = picture("");
    EXPECT_EQ(picture(""), plain);
    EXPECT_NE(picture("--wireframe"), plain);
    EXPECT_NE(picture("--color-by-level"), plain);
}

TEST_F(Viewer, KeepsLimitsOfVideoMemory)
{
    const std::string path = folder.file("large.tlod");
    writeTlod(path, makeSyntheticAsset(64, true));
    const auto memory = [&](const std::string& options) {
        const std::string stats = folder.file("s.json");
        EXPECT_EQ(run("--headless --size 100x100 --error-pixels 0.01 " + options + " --stats " + stats + " " + path).status, 0);
        return readJson(stats)["videoMemory"];
    };
    const nlohmann::json all = memory("");
    EXPECT_EQ(all["bytes"], all["wholeBytes"]) << "so small an error needs all";
    EXPECT_EQ(all["waitingPages"], 0);
    const nlohmann::json few = memory("--video-memory 0.1");
    EXPECT_LE(few["bytes"], 0.1 * 1024 * 1024);
    EXPECT_GT(few["waitingPages"], 0);
    EXPECT_EQ(memory("--upload 0.2 --frames 20")["bytes"], all["bytes"]) << "it comes in the end";
    EXPECT_EQ(run("--upload 0 " + path).status, 1);
}

TEST_F(Viewer, CapturesInWorldSpace)
{
    LodAsset asset = makeSyntheticAsset(4, false);
    asset.lattice.origin = {1e7, 0.0, 0.0};
    writeTlod(folder.file("far.tlod"), asset);
    const Outcome outcome =
        run("--headless --size 100x100 --capture " + folder.file("c.ply") + " " + folder.file("far.tlod"));
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    for (const auto& position : readPly(folder.file("c.ply")).positions) { ASSERT_NEAR(position[0], 1e7, 1.1); }
}

TEST_F(Viewer, EndsWithAMessageWhereThereIsNothingToShow)
{
    const std::string outputs = "--headless --screenshot " + folder.file("p.png") + " --capture " +
                                folder.file("c.ply") + " --stats " + folder.file("s.json");
    const auto expectFailure = [&](const std::string& arguments, const std::string& message) {
        const Outcome outcome = run(arguments);
        EXPECT_EQ(outcome.status, 1) << arguments;
        EXPECT_NE(outcome.output.find(message), std::string::npos) << arguments << "\n" << outcome.output;
    };
    const std::size_t before = folder.entryCount();
    expectFailure("", "no file");
    expectFailure(outputs, "no file");
    expectFailure(outputs + " " + folder.file("absent.tlod"), "absent.tlod: no such file");
    expectFailure(outputs + " " + model() + " " + folder.file("absent.obj"), "absent.obj");
    EXPECT_EQ(folder.entryCount(), before);

    writeBytes(folder.file("bad.tlod"), readBytes(model()).substr(0, 200));
    writeBytes(folder.file("x.unheardof"), "?");
    expectFailure(outputs + " " + folder.file("bad.tlod"), "bad.tlod: ");
    expectFailure(outputs + " " + folder.file("x.unheardof"), "x.unheardof");
    EXPECT_EQ(folder.entryCount(), before + 2);
    expectFailure("--headless --stats " + folder.file("absent/s.json") + " " + model(), "absent/s.json");
    expectFailure("--headless --screenshot " + folder.file("p.unheardof") + " " + model(), "p.unheardof");
    EXPECT_EQ(folder.entryCount(), before + 2);
}

TEST_F(Viewer, EndsWithAMessageWhereNothingCanBeDrawn)
{
    const Outcome outcome = runViewer(folder, "--headless --screenshot " + folder.file("p.png") + " " + model(),
                                      "MESA_GL_VERSION_OVERRIDE=3.2COMPAT MESA_GLSL_VERSION_OVERRIDE=150");
    if (outcome.output.find("OpenGL 3.3 is needed") == std::string::npos) { GTEST_SKIP() << outcome.output; } // not Mesa
    EXPECT_EQ(outcome.status, 1) << outcome.output;
    EXPECT_NE(outcome.output.find("x.tlod: cannot be drawn by OpenGL 3.2"), std::string::npos) << outcome.output;
    EXPECT_EQ(folder.entryCount(), 1U);
}

TEST_F(Viewer, NamesTheFileThatTheMemoryIsTooSmallFor)
{
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "sanitizers need more than a program without them may have";
#endif
    writeTlod(folder.file("heavy.tlod"), makeSyntheticHeavyAsset());
    const std::string arguments = "--headless --stats " + folder.file("s.json") + " " + folder.file("heavy.tlod");
    const Outcome outcome = runViewer(folder, arguments, "prlimit --as=" + std::to_string(190 << 20));
    EXPECT_EQ(outcome.status, 1) << outcome.output;
    EXPECT_NE(outcome.output.find("heavy.tlod: not enough memory"), std::string::npos) << outcome.output;
}

TEST_F(Viewer, TellsWhenItsOutputIsLost)
{
    const Outcome outcome = runViewer(folder, "--headless --size 16x16 " + model(), "sh -c '\"$@\" > /dev/full' sh");
    EXPECT_EQ(outcome.status, 1) << outcome.output;
    EXPECT_NE(outcome.output.find("standard output"), std::string::npos) << outcome.output;
}

TEST_F(Viewer, RefusesMalformedArguments)
{
    for (const std::string& arguments : std::vector<std::string>{"--size 10",
                                                                 "--size 0x10",
                                                                 "--size 10x10x10",
                                                                 "--size axb",
                                                                 "--size 99999x10",
                                                                 "--camera 1,2,3",
                                                                 "--camera 0,0,0,0,0,0,0,0,1",
                                                                 "--camera 0,0,0,0,0,1,0,0,1",
                                                                 "--camera 0,-5,0,0,0,0,0,0,nan",
                                                                 "--fov 0",
                                                                 "--fov 180",
                                                                 "--fov wide",
                                                                 "--error-pixels 0",
                                                                 "--error-pixels -1",
                                                                 "--error-pixels inf",
                                                                 "--max-factor 0",
                                                                 "--max-factor 1.5",
                                                                 "--metric best",
                                                                 "--bound loose",
                                                                 "--selection best",
                                                                 "--backend best",
                                                                 "--frames 0",
                                                                 "--unheardof",
                                                                 "-p absent.path",
                                                                 "--screenshot"}) {
        const std::string option = arguments.substr(0, arguments.find(' '));
        // The last is to be the option that lacks its value.
        const Outcome outcome = run("--headless " + model() + " " + arguments);
        EXPECT_EQ(outcome.status, 1) << arguments;
        EXPECT_NE(outcome.output.find(option), std::string::npos) << arguments << "\n" << outcome.output;
    }
    EXPECT_EQ(run(model() + " --stats " + folder.file("s.json")).status, 1) << "needs --headless";
    EXPECT_EQ(folder.entryCount(), 1U);
}

TEST_F(Viewer, SaysThatAWindowNeedsADisplay)
{
    const Outcome outcome = run(model());
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.output.find("--headless"), std::string::npos) << outcome.output;
}

TEST_F(Viewer, Helps)
{
    const Outcome help = run("--help");
    EXPECT_EQ(help.status, 0);
    EXPECT_NE(help.output.find("--error-pixels"), std::string::npos) << help.output;
    const Outcome keys = run("--help-keys");
    EXPECT_EQ(keys.status, 0);
    EXPECT_NE(keys.output.find("Freeze the selection"), std::string::npos) << keys.output;
}

} // namespace
} // namespace osgTessLOD
