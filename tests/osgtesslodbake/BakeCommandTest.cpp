// SPDX-License-Identifier: MIT
// The bake command as a program: what it writes, what it says and how it ends.
#include <asset/OpenEdges.h>
#include <asset/SyntheticAsset.h>
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/asset/TlodFile.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <thread>

namespace osgTessLOD {
namespace {

/// How soon an interrupted bake has to end: it is asked at steps, which take longer under a sanitizer.
#ifdef __SANITIZE_ADDRESS__
constexpr std::chrono::seconds kSoon(60);
#else
constexpr std::chrono::seconds kSoon(10);
#endif

using Arguments = std::vector<std::string>;

/// What holds of the command alone: called in its process before it begins.
using Circumstance = std::function<void()>;

void limitTo(int resource, rlim_t bytes)
{
    const rlimit limit{bytes, bytes};
    setrlimit(static_cast<__rlimit_resource_t>(resource), &limit);
}

/// A run of the command, with its two outputs in files of a folder of their own.
class BakeProcess {
public:
    explicit BakeProcess(
        const Arguments& arguments, const Circumstance& circumstance = [] {})
    {
        std::vector<std::string> words{OSGTESSLOD_BAKE};
        words.insert(words.end(), arguments.begin(), arguments.end());
        std::vector<char*> pointers;
        for (std::string& word : words) { pointers.push_back(word.data()); }
        pointers.push_back(nullptr);
        const std::string out = _logs.file("out");
        const std::string err = _logs.file("err");
        _pid = fork();
        if (_pid == 0) {
            const int outFile = open(out.c_str(), O_CREAT | O_WRONLY, 0600);
            const int errFile = open(err.c_str(), O_CREAT | O_WRONLY, 0600);
            dup2(outFile, STDOUT_FILENO);
            dup2(errFile, STDERR_FILENO);
            circumstance();
            execv(pointers[0], pointers.data());
            _exit(127);
        }
    }
    ~BakeProcess()
    {
        if (_running) {
            kill(_pid, SIGKILL);
            waitpid(_pid, nullptr, 0);
        }
    }
    BakeProcess(const BakeProcess&) = delete;
    BakeProcess& operator=(const BakeProcess&) = delete;

    void signal(int number) const { kill(_pid, number); }

    /// True once the process has a handler for SIGINT; false if it never gets one.
    bool waitForHandler() const
    {
        for (int i = 0; i < 1000; ++i) {
            std::ifstream status("/proc/" + std::to_string(_pid) + "/status");
            for (std::string line; std::getline(status, line);) {
                if (line.rfind("SigCgt:", 0) == 0 &&
                    (std::stoull(line.substr(7), nullptr, 16) >> (SIGINT - 1) & 1U) != 0) {
                    return true;
                }
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        return false;
    }

    /// Exit code; −1 if a signal ended it or it is still running after `limit`.
    int exitCode(std::chrono::seconds limit = std::chrono::seconds(300))
    {
        const auto end = std::chrono::steady_clock::now() + limit;
        int status = 0;
        while (_running && std::chrono::steady_clock::now() < end) {
            if (waitpid(_pid, &status, WNOHANG) == _pid) {
                _running = false;
                return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        return -1;
    }
    std::string output() const { return readBytes(_logs.file("out")); }
    std::string errors() const { return readBytes(_logs.file("err")); }

private:
    TemporaryDirectory _logs;
    pid_t _pid = -1;
    bool _running = true;
};

struct Outcome {
    int code;
    std::string output;
    std::string errors;
};

Outcome run(
    const Arguments& arguments, const Circumstance& circumstance = [] {})
{
    BakeProcess process(arguments, circumstance);
    const int code = process.exitCode();
    return {code, process.output(), process.errors()};
}

void writeOff(const std::string& path, const bake::SourceMesh& mesh)
{
    std::ofstream file(path);
    file << "OFF\n" << mesh.positions.size() << ' ' << mesh.triangles.size() << " 0\n";
    for (const auto& p : mesh.positions) { file << p.x() << ' ' << p.y() << ' ' << p.z() << '\n'; }
    for (const auto& [a, b, c] : mesh.triangles) { file << "3 " << a << ' ' << b << ' ' << c << '\n'; }
}

/// A folder with a small closed source and what was baked of it.
class BakeCommand : public testing::Test {
protected:
    std::string source() const
    {
        writeOff(_folder.file("torus.off"), bake::noisy(bake::torus(40, 16), 0.004, 51));
        return _folder.file("torus.off");
    }
    std::string baked() const
    {
        const std::string path = _folder.file("torus.tlod");
        EXPECT_EQ(run({source(), "-o", path, "--max-factor", "8", "--patches", "24", "--patch-tolerance", "0.02", "-q"}).code, 0);
        return path;
    }

    /// That the command says why in one line, exits with 1 and leaves the folder as it is.
    void expectRefused(
        const Arguments& arguments, const std::string& reason, const Circumstance& circumstance = [] {}) const
    {
        const std::size_t before = _folder.entryCount();
        const Outcome outcome = run(arguments, circumstance);
        std::string said;
        for (const std::string& word : arguments) { said += word + " "; }
        EXPECT_EQ(outcome.code, 1) << said;
        EXPECT_EQ(outcome.output, "") << said;
        EXPECT_NE(outcome.errors.find(reason), std::string::npos) << said << "gave: " << outcome.errors;
        EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1)
            << said << "gave: " << outcome.errors;
        EXPECT_EQ(_folder.entryCount(), before) << said << "left something behind";
    }

    TemporaryDirectory _folder;
};

TEST_F(BakeCommand, BakesChecksAndDescribes)
{
    const std::string report = _folder.file("report.json");
    const std::string path = _folder.file("torus.tlod");
    const Outcome bake = run({source(), "-o", path, "--max-factor", "8", "--patches", "24", "--patch-tolerance", "0.02", "--report", report});
    EXPECT_EQ(bake.code, 0) << bake.errors;
    EXPECT_EQ(bake.output, "");
    EXPECT_NE(bake.errors.find("1280 triangles"), std::string::npos) << bake.errors;
    EXPECT_EQ(_folder.entryCount(), 3U) << "source, asset, report and nothing temporary";

    const Outcome check = run({"--check", path});
    EXPECT_EQ(check.code, 0) << check.errors;
    EXPECT_EQ(check.output, path + ": sound\n");

    const Outcome info = run({"--info", path});
    EXPECT_EQ(info.code, 0) << info.errors;
    const auto json = nlohmann::json::parse(info.output);
    EXPECT_EQ(json["technique"], "strips");
    EXPECT_EQ(json["source"], "torus.off");
    EXPECT_EQ(json["source_triangles"], 1280);
    EXPECT_EQ(json["ladder"], nlohmann::json({1, 2, 4, 8}));
    ASSERT_EQ(json["levels"].size(), 4U);
    const auto patches = json["patches"].get<std::size_t>();
    EXPECT_GE(patches, 14U) << "no torus has less";
    for (std::size_t level = 0; level < 4; ++level) {
        const std::size_t factor = std::size_t{1} << level;
        EXPECT_EQ(json["levels"][level]["factor"], factor);
        const auto reaching = json["levels"][level]["patches"].get<std::size_t>();
        EXPECT_LE(reaching, patches);
        EXPECT_EQ(json["levels"][level]["triangles"], reaching * (factor == 1 ? 1 : 3 * factor * factor / 2));
        EXPECT_GE(json["levels"][level]["largest_error"], json["levels"][level]["mean_error"]);
    }
    EXPECT_EQ(json["edges"], 3 * patches / 2) << "closed";
    EXPECT_EQ(json["base_vertices"], patches / 2) << "Euler characteristic 0";
    EXPECT_EQ(json["file_bytes"], std::filesystem::file_size(path));
    EXPECT_EQ(json["normal_resolution"], 16);
    std::uint64_t vertexBytes = 0;
    std::uint64_t parameterBytes = 0;
    for (const auto& chunk : json["chunks"]) {
        if (chunk["type"] == "LVLV") { vertexBytes += chunk["stored_bytes"].get<std::uint64_t>(); }
        if (chunk["type"] == "LVLP") { parameterBytes += chunk["stored_bytes"].get<std::uint64_t>(); }
    }
    EXPECT_GT(parameterBytes, 0U);
    EXPECT_DOUBLE_EQ(json["vertex_bytes_per_finest_vertex"].get<double>(),
                     static_cast<double>(vertexBytes + parameterBytes) / json["finest_vertices"].get<double>());

    const auto told = nlohmann::json::parse(readBytes(report));
    EXPECT_EQ(told["levels"].size(), 4U);
    EXPECT_GT(told["stages"].size(), 3U);
    for (const auto& stage : told["stages"]) {
        EXPECT_TRUE(stage["name"].is_string());
        EXPECT_GE(stage["seconds"], 0.0);
    }
    EXPECT_GT(told["seconds"], 0.0);
    EXPECT_GT(told["peak_bytes"], 1 << 20);
    EXPECT_EQ(told["levels"][3]["largest_error"], json["levels"][3]["largest_error"]);
}

TEST_F(BakeCommand, ExportsClosedSurfacesOfAClosedSource)
{
    const std::string path = baked();
    std::size_t coarser = 0;
    for (const char* factor : {"1", "2", "4", "8"}) {
        const std::string ply = _folder.file(std::string("torus") + factor + ".ply");
        const Outcome outcome = run({"--export", path, "-o", ply, "--factor", factor});
        ASSERT_EQ(outcome.code, 0) << outcome.errors;
        const bake::SourceMesh mesh = bake::importMesh(ply);
        EXPECT_EQ(openEdges(mesh.triangles), 0U) << "factor " << factor;
        EXPECT_GT(mesh.triangles.size(), coarser);
        coarser = mesh.triangles.size();
    }
}

TEST_F(BakeCommand, StoresNoMoreThanTheToleranceAsksFor)
{
    const std::string mesh = source();
    std::uint64_t before = std::numeric_limits<std::uint64_t>::max();
    for (const char* tolerance : {"0", "0.01", "0.5"}) {
        const std::string path = _folder.file(std::string("within") + tolerance + ".tlod");
        ASSERT_EQ(run({mesh, "-o", path, "--max-factor", "8", "--patches", "24", "--patch-tolerance", "0.02",
                       "--tolerance", tolerance, "-q"}).code,
                  0);
        const auto json = nlohmann::json::parse(run({"--info", path}).output);
        const auto triangles = json["finest_triangles"].get<std::uint64_t>();
        EXPECT_LT(triangles, before);
        before = triangles;
        const std::string ply = _folder.file("finest.ply");
        ASSERT_EQ(run({"--export", path, "-o", ply, "--factor", "8"}).code, 0);
        const bake::SourceMesh surface = bake::importMesh(ply);
        EXPECT_LE(surface.triangles.size(), triangles) << "fewer where borders stay behind";
        EXPECT_EQ(openEdges(surface.triangles), 0U);
    }
}

TEST_F(BakeCommand, BakesWithoutNormalsAndQuietly)
{
    const std::string path = _folder.file("glacier.tlod");
    const Outcome outcome = run({"builtin:glacier", "-o", path, "--max-factor", "2", "--no-normals", "-q"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.errors, "");
    EXPECT_EQ(nlohmann::json::parse(run({"--info", path}).output)["normal_resolution"], 0);
}

TEST_F(BakeCommand, StoresNormalsAtTheResolutionAskedFor)
{
    const std::string path = _folder.file("torus.tlod");
    const auto resolutionOf = [&](const char* asked) {
        EXPECT_EQ(run({source(), "-o", path, "--max-factor", "4", "--patches", "24", "--patch-tolerance", "0.02", "-q",
                       "--normal-resolution", asked}).code, 0);
        return nlohmann::json::parse(run({"--info", path}).output)["normal_resolution"].get<unsigned>();
    };
    EXPECT_EQ(resolutionOf("0"), 8U);
    EXPECT_EQ(resolutionOf("4"), 4U);
    EXPECT_EQ(resolutionOf("64"), 8U);
    expectRefused({source(), "-o", path, "-q", "--normal-resolution", "3"}, "must be a power of two, not 3");
}

TEST_F(BakeCommand, SameBytesWhateverTheThreads)
{
    const std::string mesh = source();
    std::string first;
    for (const char* threads : {"1", "2"}) {
        const std::string path = _folder.file(std::string("by") + threads + ".tlod");
        ASSERT_EQ(run({mesh, "-o", path, "--max-factor", "8", "--patches", "24", "--patch-tolerance", "0.02", "--threads", threads, "-q"}).code, 0);
        if (first.empty()) { first = readBytes(path); }
        EXPECT_TRUE(readBytes(path) == first);
    }
}

TEST_F(BakeCommand, TellsHowItIsUsed)
{
    const Outcome help = run({"--help"});
    EXPECT_EQ(help.code, 0);
    for (const char* word : {"--output", "--max-factor", "--info", "--check", "--export", "builtin:NAME", "glacier"}) {
        EXPECT_NE(help.output.find(word), std::string::npos) << word;
    }
}

TEST_F(BakeCommand, RefusesWhatItCannotDo)
{
    const std::string out = _folder.file("out.tlod");
    expectRefused({}, "nothing to do");
    expectRefused({"builtin:glacier"}, "where to write is not said");
    expectRefused({"builtin:teapot", "-o", out, "-q"}, "teapot");
    expectRefused({"builtin:glacier", "-o", out, "-q", "--max-factor", "7"}, "7");
    for (const char* tolerance : {"-0.5", "nan", "inf"}) {
        expectRefused({"builtin:glacier", "-o", out, "-q", "--tolerance", tolerance}, "the tolerance must be");
    }
    expectRefused({_folder.file("missing.ply"), "-o", out, "-q"}, "missing.ply");
}

TEST_F(BakeCommand, RefusesContradictoryArguments)
{
    // The command line parser adds a line about --help.
    const std::string path = baked();
    const std::size_t before = _folder.entryCount();
    for (const Arguments& arguments :
         {Arguments{"--info", path, "--check", path}, Arguments{"--check", path, "--export", path},
          Arguments{"--factor", "4"}, Arguments{"--unknown"}, Arguments{"builtin:glacier", "--technique", "magic"},
          Arguments{"builtin:glacier", "--crease-angle", "400"},
          Arguments{"builtin:glacier", "--max-factor", "many"}}) {
        const Outcome outcome = run(arguments);
        EXPECT_EQ(outcome.code, 1) << arguments.front();
        EXPECT_NE(outcome.errors.find("--"), std::string::npos) << outcome.errors;
        EXPECT_LE(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 2) << outcome.errors;
    }
    EXPECT_EQ(_folder.entryCount(), before);
}

TEST_F(BakeCommand, RefusesGarbage)
{
    const std::string out = _folder.file("out.tlod");
    for (const char* name : {"garbage.ply", "garbage.obj", "garbage.off", "garbage.stl", "garbage.txt"}) {
        const std::string path = _folder.file(name);
        std::ofstream(path) << "neither a mesh\nnor anything else\n";
        expectRefused({path, "-o", out, "-q"}, path);
        for (const char* option : {"--info", "--check"}) { expectRefused({option, path}, path); }
        expectRefused({"--export", path, "-o", out}, path);
    }
}

TEST_F(BakeCommand, RefusesTruncatedAssets)
{
    const std::string whole = readBytes(baked());
    const std::string path = _folder.file("truncated.tlod");
    for (const std::size_t size :
         {std::size_t{0}, std::size_t{10}, std::size_t{100}, whole.size() / 2, whole.size() - 1}) {
        std::ofstream(path, std::ios::binary | std::ios::trunc) << whole.substr(0, size);
        for (const char* option : {"--info", "--check"}) { expectRefused({option, path}, path); }
        expectRefused({"--export", path, "-o", _folder.file("out.ply"), "--factor", "4"}, path);
    }
}

TEST_F(BakeCommand, RefusesFactorsThatTheAssetLacks)
{
    const std::string path = baked();
    for (const char* factor : {"0", "3", "16", "64"}) {
        expectRefused({"--export", path, "-o", _folder.file("out.ply"), "--factor", factor}, factor);
    }
    expectRefused({"--export", path, "--factor", "4"}, "where to write is not said");
}

TEST_F(BakeCommand, RefusesPlacesItCannotWriteTo)
{
    const std::string path = baked();
    const std::string nowhere = _folder.file("missing folder/out");
    expectRefused({"builtin:glacier", "-o", nowhere, "--max-factor", "1", "-q"}, nowhere);
    expectRefused({"--export", path, "-o", nowhere, "--factor", "2"}, nowhere);
    // Below a file.
    expectRefused({"builtin:glacier", "-o", path + "/out.tlod", "--max-factor", "1", "-q"}, path);
}

TEST_F(BakeCommand, AFailedBakeKeepsTheOldFile)
{
    const std::string out = _folder.file("old.tlod");
    std::ofstream(out) << "old";
    std::ofstream(_folder.file("bad.ply")) << "ply\n";
    expectRefused({_folder.file("bad.ply"), "-o", out, "-q"}, "bad.ply");
    EXPECT_EQ(readBytes(out), "old");
}

TEST_F(BakeCommand, EndsSoonAndCleanlyWhenInterrupted)
{
    for (const int number : {SIGINT, SIGTERM}) {
        for (const int milliseconds : {0, 1500}) {
            BakeProcess process(
                {"builtin:asteroid", "--triangles", "20000000", "-o", _folder.file("asteroid.tlod"), "-q"});
            ASSERT_TRUE(process.waitForHandler());
            std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
            process.signal(number);
            EXPECT_EQ(process.exitCode(kSoon), 1) << "signal " << number << " after " << milliseconds;
            EXPECT_NE(process.errors().find("interrupted"), std::string::npos);
            EXPECT_EQ(_folder.entryCount(), 0U);
        }
    }
}

TEST_F(BakeCommand, AnInterruptedBakeOfAMeshEndsSoonToo)
{
    const std::string source = _folder.file("sphere.off");
    writeOff(source, bake::sphere(8)); // 524,288 triangles
    BakeProcess process({source, "-o", _folder.file("sphere.tlod"), "-q"});
    ASSERT_TRUE(process.waitForHandler());
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    process.signal(SIGINT);
    EXPECT_EQ(process.exitCode(kSoon), 1);
    EXPECT_NE(process.errors().find("interrupted"), std::string::npos);
    EXPECT_EQ(_folder.entryCount(), 1U);
}

TEST_F(BakeCommand, AKilledBakeLeavesTheOldFile)
{
    const std::string out = _folder.file("asteroid.tlod");
    writeBytes(out, "old");
    BakeProcess process({"builtin:asteroid", "--triangles", "20000000", "-o", out, "-q"});
    ASSERT_TRUE(process.waitForHandler());
    process.signal(SIGKILL);
    EXPECT_EQ(process.exitCode(kSoon), -1);
    EXPECT_EQ(readBytes(out), "old");
    EXPECT_EQ(_folder.entryCount(), 1U) << "the file is begun when all of it is known";
}

TEST_F(BakeCommand, AFullDiskKeepsTheOldFile)
{
    const std::string path = baked();
    const std::string out = _folder.file("old");
    writeBytes(out, "old");
    const auto diskIsFull = [] {
        std::signal(SIGXFSZ, SIG_IGN);
        limitTo(RLIMIT_FSIZE, 500); // room for the message
    };
    const std::string reason = out + ": cannot be written: File too large\n";
    expectRefused({source(), "-o", out, "--max-factor", "2", "--patches", "24", "-q"}, reason, diskIsFull);
    expectRefused({"--export", path, "-o", out, "--factor", "2"}, reason, diskIsFull);
    const Outcome reported =
        run({source(), "-o", _folder.file("new.tlod"), "--max-factor", "1", "--patches", "4", "-q", "--report", out},
            diskIsFull);
    EXPECT_EQ(reported.code, 1) << reported.errors;
    EXPECT_EQ(readBytes(out), "old");
}

TEST_F(BakeCommand, TellsWhenItsOutputIsLost)
{
    const std::string path = baked();
    const auto outputIsFull = [] { dup2(open("/dev/full", O_WRONLY), STDOUT_FILENO); };
    for (const char* option : {"--info", "--check"}) { expectRefused({option, path}, "standard output", outputIsFull); }
}

TEST_F(BakeCommand, NamesTheFileThatTheMemoryIsTooSmallFor)
{
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "sanitizers need more than a program without them may have";
#endif
    const auto memoryIsSmall = [] { limitTo(RLIMIT_AS, rlim_t{220} << 20); };
    const std::string path = _folder.file("heavy.tlod");
    writeTlod(path, makeSyntheticHeavyAsset());
    for (const char* option : {"--info", "--check"}) {
        expectRefused({option, path}, path + ": not enough memory", memoryIsSmall);
    }
    const std::string out = _folder.file("out");
    expectRefused({"--export", path, "-o", out}, path + ": not enough memory", memoryIsSmall);
    for (const char* name : {"holes.off", "N00E000.hgt"}) { // all of them zeros that take no space
        const std::string source = _folder.file(name);
        std::ofstream(source) << "OFF";
        std::filesystem::resize_file(source, 2 * std::uintmax_t{20000} * 20000);
        expectRefused({source, "-o", out, "-q"}, source + ": not enough memory", memoryIsSmall);
    }
}

TEST_F(BakeCommand, DescribesTextsOfAnyBytes)
{
    const std::string path = _folder.file("bytes.tlod");
    LodAsset asset = makeSyntheticAsset(2);
    asset.source = "gr\xF6\xDF";
    writeTlod(path, asset);
    const Outcome info = run({"--info", path});
    ASSERT_EQ(info.code, 0) << info.errors;
    EXPECT_EQ(nlohmann::json::parse(info.output)["source"], "gr\uFFFD\uFFFD");

    const std::string mesh = _folder.file("\xFF.off");
    std::filesystem::rename(source(), mesh);
    const std::string report = _folder.file("report.json");
    const Outcome bake = run({mesh, "-o", path, "--max-factor", "1", "--patches", "24", "-q", "--report", report});
    ASSERT_EQ(bake.code, 0) << bake.errors;
    EXPECT_EQ(nlohmann::json::parse(readBytes(report))["source_triangles"], 1280U);
}

TEST_F(BakeCommand, NamesTheColourImageRelativeToTheOutput)
{
    const std::string square = _folder.file("square.obj");
    std::ofstream(square) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    const std::string path = _folder.file("square.tlod");
    EXPECT_EQ(run({square, "-o", path, "--max-factor", "2", "-q", "--color-image", _folder.file("images/a.png")}).code, 0);
    const std::string info = run({"--info", path}).output;
    const auto materials = nlohmann::json::parse(info)["materials"];
    EXPECT_EQ(materials[0]["textures"][0]["image"], "images/a.png") << info;
    EXPECT_EQ(materials[0]["textures"][0]["embedded"], false) << info;
    EXPECT_NE(info.find("\"texture_coordinates\": true"), std::string::npos);
    EXPECT_NE(info.find("\"largest_uv_error\""), std::string::npos);
    const Outcome without = run({source(), "-o", path, "--max-factor", "2", "--patches", "24", "-q", "--color-image", "a.png"});
    EXPECT_EQ(without.code, 1);
    EXPECT_NE(without.errors.find("no texture coordinates for a colour image"), std::string::npos) << without.errors;
}

TEST_F(BakeCommand, EmbedsTheImagesOfMaterials)
{
    const std::string squares = _folder.file("squares.obj");
    writeBytes(_folder.file("m.mtl"), "newmtl a\nmap_Kd a.png\nnewmtl b\nKd 1 0 0\n");
    writeBytes(_folder.file("a.png"), "not looked into");
    writeBytes(squares, "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
                        "usemtl a\nf 1/1 2/2 3/3\nf 1/1 3/2 4/3\nusemtl b\nf 2/1 5/2 6/3\nf 2/1 6/2 3/3\n");
    const std::string path = _folder.file("squares.tlod");
    const Arguments bake{squares, "-o", path, "--max-factor", "2", "-q"};
    EXPECT_EQ(run(bake).code, 0);
    const auto materialsOf = [&] { return nlohmann::json::parse(run({"--info", path}).output)["materials"]; };
    auto materials = materialsOf();
    ASSERT_EQ(materials.size(), 2U);
    EXPECT_EQ(materials[0]["textures"][0]["image"], "a.png") << "as seen from the output";
    EXPECT_EQ(materials[0]["textures"][0]["embedded"], false);
    EXPECT_EQ(materials[0]["patches"], 2);
    EXPECT_EQ(materials[1]["patches"], 2);

    Arguments embed = bake;
    embed.push_back("--embed-textures");
    EXPECT_EQ(run(embed).code, 0);
    materials = materialsOf();
    EXPECT_EQ(materials[0]["textures"][0]["embedded"], true);
    EXPECT_NE(readBytes(path).find("not looked into"), std::string::npos);
}

TEST_F(BakeCommand, BakesNormalsIntoAnImageOverTextureCoordinates)
{
    const std::string square = _folder.file("square.obj");
    const std::string corners = "v 0 0 0\nv 1 0 0\nv 1 1 0.2\nv 0 1 0\n";
    writeBytes(_folder.file("m.mtl"), "newmtl oak\nKd 1 0 0\n");
    writeBytes(square, "mtllib m.mtl\n" + corners + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl oak\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n");
    const std::string path = _folder.file("square.tlod");
    const std::string report = _folder.file("report.json");
    const Arguments bake{square, "-o", path, "--max-factor", "4", "-q", "--report", report};
    Arguments mapped = bake;
    mapped.insert(mapped.end(), {"--normal-map", "64"});
    const Outcome outcome = run(mapped);
    EXPECT_EQ(outcome.code, 0) << outcome.errors;

    const auto info = nlohmann::json::parse(run({"--info", path}).output);
    EXPECT_EQ(info["normal_resolution"], 0);
    const auto texture = info["materials"][0]["textures"][0];
    EXPECT_EQ(texture["role"], "object-normal");
    EXPECT_EQ(texture["image"], "normals-oak.png");
    EXPECT_EQ(texture["embedded"], true);
    const auto told = nlohmann::json::parse(readBytes(report))["normal_maps"][0];
    EXPECT_EQ(told["image"], "normals-oak.png");
    EXPECT_EQ(told["bytes"], texture["bytes"]);
    EXPECT_EQ(told["coverage"], 1.0);
    EXPECT_EQ(told["covered_twice"], 0.0);
    EXPECT_EQ(run({"--check", path}).code, 0);
    EXPECT_EQ(run(bake).code, 0);
    EXPECT_FALSE(nlohmann::json::parse(readBytes(report)).contains("normal_maps"));

    std::filesystem::remove(path);
    std::filesystem::remove(report);
    writeBytes(square, "mtllib m.mtl\n" + corners + "vt 0 0\nvt 1 0\nvt 1 1\nusemtl oak\nf 1/1 2/2 3/3\nf 1/1 3/3 4/2\n");
    expectRefused(mapped, square + ": the texture coordinates of material oak overlap in 100.0 %");
    expectRefused(mapped, "bake normals per patch (without --normal-map)");
    writeBytes(square, "mtllib m.mtl\n" + corners + "vt 0 0\nvt 1 0\nvt 1 1\nusemtl oak\nf 1/1 2/2 3/3\nf 1 3 4\n");
    expectRefused(mapped, square + ": has faces of material oak without texture coordinates");
    writeBytes(square, corners + "f 1 2 3 4\n");
    expectRefused(mapped, square + ": no texture coordinates for a normal map");
    expectRefused({square, "-o", path, "--normal-map", "100"}, "a power of two from 64 to 8192, not 100");
    expectRefused({"builtin:asteroid", "-o", path, "--normal-map", "64"}, "builtin:asteroid: only meshes");
    EXPECT_EQ(run({square, "-o", path, "--normal-map", "64", "--no-normals"}).code, 1);
}

TEST_F(BakeCommand, TellsOfRepairsAndRefusesThemIfStrict)
{
    const std::string square = _folder.file("square.obj");
    writeBytes(square, "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl a\nf 1 2 3\nf 1 4 3\nf 1 2 3\nf 1 1 2\n");
    const std::string path = _folder.file("square.tlod");
    const Outcome outcome = run({square, "-o", path, "--max-factor", "2"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_NE(outcome.errors.find("repaired: 1 face without an area dropped; 1 duplicate face dropped; 1 face turned to agree"),
              std::string::npos)
        << outcome.errors;
    EXPECT_NE(outcome.errors.find("warning: " + _folder.file("gone.mtl") + ": no such file"), std::string::npos) << outcome.errors;
    expectRefused({square, "-o", path, "--max-factor", "2", "-q", "--strict"}, "square.obj: not baked, as it is not sound: 1 face");
    writeBytes(square, "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl a\nf 1 2 3\nf 1 3 4\n");
    expectRefused({square, "-o", path, "--max-factor", "2", "-q", "--strict"}, "gone.mtl: no such file");
    writeBytes(square, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\nf 1 2 3\nf 1 3 4\n");
    EXPECT_EQ(run({square, "-o", path, "--max-factor", "2", "-q", "--strict"}).code, 0) << "an idle vertex is no fault";
}

TEST_F(BakeCommand, BakesDisplacedMeshesAndTerrain)
{
    const std::string square = _folder.file("square.obj");
    std::ofstream(square) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    // The smallest of image formats: 9 × 9 grey values, a bump in the middle.
    const std::string map = _folder.file("map.pgm");
    std::string pixels(81, '\0');
    pixels[40] = '\xFF';
    writeBytes(map, "P5 9 9 255\n" + pixels);
    const std::string path = _folder.file("x.tlod");
    const auto heightOf = [&] {
        const auto bounds = nlohmann::json::parse(run({"--info", path}).output)["bounds"];
        return bounds["max"][2].get<double>() - bounds["min"][2].get<double>();
    };
    const Arguments bake{square, "-o", path, "--max-factor", "16", "-q", "--displacement", map, "--scale", "0.5"};
    EXPECT_EQ(run(bake).code, 0);
    EXPECT_EQ(run({"--check", path}).code, 0);
    EXPECT_GT(heightOf(), 0.2);

    // A raw SRTM tile: 17 × 17 heights, 500 m in the middle.
    const std::string tile = _folder.file("N47E008.hgt");
    std::string heights(2 * 17 * 17, '\0');
    heights[2 * (8 * 17 + 8)] = '\x01';
    heights[2 * (8 * 17 + 8) + 1] = '\xF4';
    writeBytes(tile, heights);
    EXPECT_EQ(run({tile, "-o", path, "--max-factor", "16", "-q"}).code, 0);
    EXPECT_GT(heightOf(), 100.0);

    expectRefused({square, "-o", path, "-q", "--displacement", _folder.file("none.png")}, "none.png");
    expectRefused({tile, "-o", path, "-q", "--smooth", "1"}, "only meshes");
}

TEST_F(BakeCommand, BakesTilesOfTerrain)
{
    const std::string dem = _folder.file("N47E008.hgt");
    std::string heights(2 * 17 * 17, '\0');
    for (std::size_t i = 0; i < 17 * 17; ++i) { heights[2 * i + 1] = static_cast<char>(i * i % 120); }
    writeBytes(dem, heights);
    const std::string path = _folder.file("tile.tlod");
    const std::string report = _folder.file("report.json");
    for (const char* tile : {"0,0,2", "1,0,2", "1,1,2"}) {
        const Outcome outcome = run({dem, "-o", path, "--max-factor", "8", "-q", "--tile", tile, "--report", report});
        ASSERT_EQ(outcome.code, 0) << outcome.errors;
        EXPECT_EQ(run({"--check", path}).code, 0);
        const LodAsset asset = readTlod(path);
        EXPECT_TRUE(asset.hasSeams());
        EXPECT_EQ(asset.source, "N47E008.hgt (tile " + std::string(tile, 3) + " of 2 x 2)");
        EXPECT_EQ(asset.sourceTriangles, 2U * 8U * 8U);
        std::ifstream file(report);
        EXPECT_EQ(nlohmann::json::parse(file)["tile"][2], 2);
    }
    const Arguments bake{dem, "-o", _folder.file("none.tlod"), "-q", "--tile"};
    const auto refuse = [&](const std::string& tile, const std::string& part) {
        Arguments arguments = bake;
        arguments.push_back(tile);
        expectRefused(arguments, part);
    };
    refuse("2,0,2", "there is no tile 2,0 of 2 x 2");
    refuse("0,2,2", "there is no tile 0,2 of 2 x 2");
    refuse("0,0,17", "cannot be cut into 17 x 17 tiles");
    for (const char* tile : {"1,2", "1,0,-2", "a,b,c"}) {
        Arguments arguments = bake;
        arguments.emplace_back(tile);
        EXPECT_EQ(run(arguments).code, 1) << tile;
    }
    expectRefused({"builtin:glacier", "-o", path, "-q", "--tile", "0,0,2"}, "only height images have tiles");
}

TEST_F(BakeCommand, WritesDisplacementMapsThatItReads)
{
    const std::string mesh = _folder.file("sphere.off");
    writeOff(mesh, bake::sphere(4));
    const std::string map = _folder.file("out.exr");
    const std::string path = _folder.file("x.tlod");
    const Outcome written = run({mesh, "-q", "--elevation", "--patches", "24", "--max-factor", "8", "--write-displacement", map});
    ASSERT_EQ(written.code, 0) << written.errors;
    EXPECT_NE(written.output.find("osgtesslodbake out.obj --displacement out.exr --scale 1 --midlevel 0"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(path)) << "only what was asked for";
    ASSERT_EQ(run({_folder.file("out.obj"), "-q", "-o", path, "--displacement", map}).code, 0);
    const std::string surface = _folder.file("surface.ply");
    ASSERT_EQ(run({"--export", path, "--factor", "16", "-o", surface}).code, 0);
    // A sphere in a box of diagonal 1. Vertices between the map's pixels, an eighth of a patch apart, are inside, and so is the source between its own.
    const double radius = 0.5 / std::sqrt(3.0);
    for (const Eigen::Vector3d& p : bake::importMesh(surface).positions) { EXPECT_NEAR(p.norm(), radius, 0.015 * radius); }

    // A vector map, beside a bake.
    const std::string png = _folder.file("vector.png");
    const Outcome both = run({mesh, "-q", "-o", path, "--max-factor", "4", "--write-displacement", png, "--sampling", "fit"});
    ASSERT_EQ(both.code, 0) << both.errors;
    EXPECT_NE(both.output.find("--vector object"), std::string::npos);
    EXPECT_EQ(run({"--check", path}).code, 0);

    expectRefused({mesh, "-q", "--write-displacement", _folder.file("out.jpg")}, "out.jpg");
    expectRefused({_folder.file("out.obj"), "-q", "--write-displacement", map}, "would replace the source");
    expectRefused({"builtin:asteroid", "-q", "-o", path, "--elevation"}, "elevations are made of meshes");
}

} // namespace
} // namespace osgTessLOD
