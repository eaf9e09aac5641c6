// SPDX-License-Identifier: MIT
// Baked surfaces as the GPU draws them: continuous in the view, closed, and the same in stock osgviewer.
#include <render/ViewerTest.h>
#include <viewer/ViewerProgram.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/SurfaceDistance.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <osgtesslodviewer/CapturedMesh.h>
#include <osgtesslodviewer/SelectionTotals.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <osg/Geode>
#include <osg/Image>
#include <osgDB/ReadFile>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

namespace osgTessLOD {
namespace {

LodAsset bakeBuiltin(const std::string& name, unsigned maxFactor)
{
    bake::BakeOptions options;
    options.maxFactor = maxFactor;
    bake::Progress progress;
    bake::BakeReport report;
    return bake::bakeSource("builtin:" + name, options, progress, report);
}

// ---- continuity

/// What one frame drew, ready to be compared with the next.
struct DrawnSurface {
    std::vector<Eigen::Vector3d> vertices;
    std::unique_ptr<bake::SurfaceDistance> distance;

    explicit DrawnSurface(const SurfaceMesh& mesh)
    {
        for (const auto& p : mesh.positions) { vertices.emplace_back(p[0], p[1], p[2]); }
        distance = std::make_unique<bake::SurfaceDistance>(vertices, mesh.triangles);
    }
};

/// How far the vertices of either surface are from the other.
double largestDistance(const DrawnSurface& a, const DrawnSurface& b)
{
    double largest = 0.0;
    for (const Eigen::Vector3d& p : a.vertices) { largest = std::max(largest, b.distance->distance(p)); }
    for (const Eigen::Vector3d& p : b.vertices) { largest = std::max(largest, a.distance->distance(p)); }
    return largest;
}

struct Frame {
    osg::Vec3d eye;
    double turn = 0.0;                ///< of the camera since the last frame, radians
    std::vector<PatchRecord> records; ///< in patch order
    std::optional<DrawnSurface> drawn;
    std::optional<DrawnSurface> rounded; ///< the same with every border's level rounded up
};

/// Captures what was drawn, and what would have been with whole levels.
class FrameCapture : public osg::Camera::DrawCallback {
public:
    explicit FrameCapture(const SelectionTotals& totals)
        : _totals(totals)
    {
    }

    using osg::Camera::DrawCallback::operator();
    void operator()(osg::RenderInfo& renderInfo) const override
    {
        const std::vector<FrameSelection> selections = _totals.thisFrame(renderInfo.getCurrentCamera());
        ASSERT_EQ(selections.size(), 1U);
        const FrameSelection& entry = selections.front();
        std::vector<PatchRecord> records = entry.selection->records().vector();
        _frame->drawn.emplace(surfaceOf(*entry.selection, renderInfo));
        _frame->records = records;
        std::sort(_frame->records.begin(), _frame->records.end(),
                  [](const PatchRecord& a, const PatchRecord& b) { return a.patch < b.patch; });

        for (PatchRecord& record : records) {
            for (float& level : record.edgeLevels) { level = std::ceil(level); }
        } // the level that a patch is drawn with stays, and so the order
        GpuAsset* asset = entry.drawable->getGpuAsset();
        const osg::ref_ptr<PatchSelection> rounded =
            new PatchSelection(asset, records, asset->selector().statisticsOf(records), entry.selection->view());
        _frame->rounded.emplace(surfaceOf(*rounded, renderInfo));
    }

    void captureTo(Frame& frame) { _frame = &frame; }

protected:
    ~FrameCapture() override = default;

private:
    static SurfaceMesh surfaceOf(const PatchSelection& selection, osg::RenderInfo& renderInfo)
    {
        CapturedMesh mesh;
        mesh.add(selection.capture(renderInfo), osg::Matrixd());
        return mesh.surface();
    }

    const SelectionTotals& _totals;
    Frame* _frame = nullptr;
};

/// How far the vertices of each patch and level are from their parents at most: steps[patch][level], 0 at level 0.
std::vector<std::vector<double>> largestSteps(const LodAsset& asset)
{
    std::vector<std::vector<double>> steps(asset.patches.size(), std::vector<double>(asset.ladder.size(), 0.0));
    for (std::size_t level = 1; level < asset.ladder.size(); ++level) {
        const std::vector<std::uint32_t> slots = asset.levelSlots(level);
        const std::vector<std::uint32_t> parentSlots = asset.levelSlots(level - 1);
        const std::uint32_t count = TessellationPattern::vertexCount(asset.ladder[level]);
        const std::uint32_t parentCount = TessellationPattern::vertexCount(asset.ladder[level - 1]);
        for (std::size_t p = 0; p < asset.patches.size(); ++p) {
            if (slots[p] == kNoPatch) { continue; }
            for (std::uint32_t v = 0; v < count; ++v) {
                const LodVertex vertex = asset.levels[level].vertices[slots[p] * count + v];
                const LodVertex parent =
                    asset.levels[level - 1].vertices[parentSlots[p] * parentCount + vertex.parent()];
                const auto a = asset.position(asset.patches[p], vertex);
                const auto b = asset.position(asset.patches[p], parent);
                const osg::Vec3d move(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
                steps[p][level] = std::max(steps[p][level], move.length());
            }
        }
    }
    return steps;
}

double largestLevelChange(const PatchRecord& a, const PatchRecord& b)
{
    double largest = 0.0;
    for (std::size_t side = 0; side < 3; ++side) {
        largest = std::max(largest, static_cast<double>(std::fabs(a.edgeLevels[side] - b.edgeLevels[side])));
    }
    return largest;
}

/// How far a vertex can move at most between two frames. A border's vertex runs along the chain of its ancestors, from
/// one to the next while the level changes by 1. An inner vertex lies between itself and its parent, at a
/// fraction that changes with the patch's level; the parent may be a border's vertex, which lags at a coarser
/// level, so that both are apart by the chain between the two levels, and which moves itself: in all, per unit of
/// level, at most twice the length of the chain.
double largestMove(const Frame& a, const Frame& b, const std::vector<std::vector<double>>& steps)
{
    double largest = 0.0;
    for (std::size_t p = 0; p < a.records.size(); ++p) {
        float lowest = 1e9F;
        float highest = 0.0F;
        for (const PatchRecord* record : {&a.records[p], &b.records[p]}) {
            for (const float level : record->edgeLevels) {
                lowest = std::min(lowest, level);
                highest = std::max(highest, level);
            }
        }
        double chain = 0.0;
        const auto finest = static_cast<std::size_t>(std::ceil(highest));
        for (auto level = static_cast<std::size_t>(lowest) + 1; level <= finest; ++level) { chain += steps[p][level]; }
        largest = std::max(largest, 2.0 * chain * largestLevelChange(a.records[p], b.records[p]));
    }
    return largest;
}

/// By how much at most what decides a patch's level changes, relatively, while the eye moves by `step` and the camera turns by
/// `turn` radians (see LevelNeed.cpp): the tolerance C² (D − R), C the cosine of the patch's largest angle from the axis,
/// at most a corner's; and the error as seen, which is at least m sin θ and changes by m times the angles' changes at most.
double relativeChange(const LodPatch& patch, const Frame& a, const Frame& b, double tangentOfCorner)
{
    const osg::Vec3d center(patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]);
    const double step = (b.eye - a.eye).length();
    const double distance = std::min((a.eye - center).length(), (b.eye - center).length()) - step;
    const double sine = double{patch.boundRadius} / distance;
    const double spreading = sine / std::sqrt(1.0 - sine * sine) * step / distance; // of the patch's half angle
    const double turning = step / distance;                                         // of the direction of its centre
    return step / (distance - patch.boundRadius) + 2.0 * tangentOfCorner * (b.turn + turning + spreading) +
           (turning + spreading) / sine;
}

/// From afar to the surface and away again, turning about it.
osg::Vec3d eyeAt(double t, double radius)
{
    const double distance = radius * std::exp(std::log(120.0) * std::fabs(2.0 * t - 1.0)) * 1.6;
    return osg::Vec3d(std::cos(2.0 * t), std::sin(2.0 * t), 0.4 * std::sin(3.0 * t)) * distance;
}

TEST(BakedModel, MovesNoVertexFurtherThanTheCameraAsks)
{
    constexpr int kFrames = 400;
    // LevelNeed goes from a level to the next while the tolerance falls to 1 / 1.1: the level as a function of its
    // logarithm has a slope of at most 1.1 / 0.1.
    constexpr double kLargestSlope = 11.0;
    const double tangentOfCorner =
        std::hypot(1.0, 4.0 / 3.0) * std::tan(osg::DegreesToRadians(15.0)); // of OSG's default

    const auto asset = std::make_shared<const LodAsset>(bakeBuiltin("asteroid", 16));
    const std::vector<std::vector<double>> steps = largestSteps(*asset);
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(asset);
    SelectionOptions options;
    options.cullPatches = false;
    options.errorPixels = 6.0;
    drawable->setOptions(options);
    const osg::ref_ptr<osg::Geode> scene = new osg::Geode;
    scene->addDrawable(drawable);
    const osg::BoundingSphere bound = scene->getBound();

    SelectionTotals totals({drawable});
    osgViewer::Viewer viewer;
    viewer.setThreadingModel(osgViewer::ViewerBase::SingleThreaded);
    ASSERT_NO_FATAL_FAILURE(setUpHeadless(*viewer.getCamera(), 320, 240));
    const osg::ref_ptr<FrameCapture> capture = new FrameCapture(totals);
    viewer.getCamera()->setFinalDrawCallback(capture);
    viewer.setSceneData(scene);
    viewer.realize();

    Frame last;
    std::size_t levelChanges = 0;
    double worst = 0.0;        // largest move in terms of what is allowed
    double worstRounded = 0.0; // the same if levels were whole numbers
    for (int k = 0; k <= kFrames; ++k) {
        Frame frame;
        frame.eye =
            osg::Vec3d(bound.center()) + eyeAt(static_cast<double>(k) / kFrames, static_cast<double>(bound.radius()));
        viewer.getCamera()->setViewMatrixAsLookAt(frame.eye, osg::Vec3d(bound.center()), osg::Vec3d(0, 0, 1));
        capture->captureTo(frame);
        totals.beginFrame();
        viewer.frame();
        ASSERT_EQ(frame.records.size(), asset->patches.size()) << "frame " << k;
        if (k > 0) {
            const osg::Vec3d center(bound.center());
            frame.turn =
                (frame.eye - last.eye).length() / std::min((frame.eye - center).length(), (last.eye - center).length());
            double allowedChange = 0.0;
            for (const LodPatch& patch : asset->patches) {
                allowedChange =
                    std::max(allowedChange, kLargestSlope * relativeChange(patch, last, frame, tangentOfCorner));
            }
            for (std::size_t p = 0; p < frame.records.size(); ++p) {
                EXPECT_LE(largestLevelChange(frame.records[p], last.records[p]), allowedChange) << "frame " << k;
                levelChanges += MorphedSurface::drawnLevel(frame.records[p].edgeLevels) !=
                                        MorphedSurface::drawnLevel(last.records[p].edgeLevels)
                                    ? 1
                                    : 0;
            }
            // Positions are rounded to single precision and to the lattice.
            const double allowed = largestMove(last, frame, steps) + 1e-5 * static_cast<double>(bound.radius());
            const double move = largestDistance(*last.drawn, *frame.drawn);
            EXPECT_LE(move, allowed) << "frame " << k;
            worst = std::max(worst, move / allowed);
            worstRounded = std::max(worstRounded, largestDistance(*last.rounded, *frame.rounded) / allowed);
        }
        last = std::move(frame);
    }
    viewer.getCamera()->setFinalDrawCallback(nullptr);
    RecordProperty("worstOfAllowed", std::to_string(worst));
    RecordProperty("worstRoundedOfAllowed", std::to_string(worstRounded));
    EXPECT_GT(levelChanges, 4 * asset->patches.size()) << "the flight passes too few levels to show anything";
    EXPECT_GT(worst, 0.0);
    EXPECT_GT(worstRounded, 2.0) << "this would not notice a discontinuous selection";
}

// ---- the viewer

class BakedModelViewer : public testing::TestWithParam<const char*> {
protected:
    BakedModelViewer() { writeTlod(model(), bakeBuiltin(GetParam(), 8)); }
    std::string model() const { return folder.file("x.tlod"); }

    TemporaryDirectory folder;
};

TEST_P(BakedModelViewer, CapturesAClosedSurface)
{
    const std::string common = "--headless --no-cull --size 320x240 --frames 1 --capture " + folder.file("c.ply") +
                               " --stats " + folder.file("s.json") + " ";
    std::size_t mixed = 0;
    // Home; close to one side, so that levels differ much; along a slanted line.
    for (const char* view : {"", "--camera 0.2,-1.1,0.1,0,0,0,0,0,1 ", "--camera 3,2,2.5,0.2,0,0,0,0,1 "}) {
        for (const char* error : {"5", "15", "40"}) {
            const Outcome outcome = runViewer(folder, common + view + "--error-pixels " + error + " " + model());
            ASSERT_EQ(outcome.status, 0) << outcome.output;
            const nlohmann::json stats = readJson(folder.file("s.json"));
            mixed += stats["patchesByFactor"].size() > 1 ? 1 : 0;
            const Ply ply = readPly(folder.file("c.ply"));
            EXPECT_GE(ply.faces.size(), 20U);
            EXPECT_EQ(openEdges(ply.faces), 0U) << view << "error " << error;
            EXPECT_EQ(edgesWithoutTwoFaces(ply), 0U) << view << "error " << error;
        }
    }
    EXPECT_GE(mixed, 3U) << "levels are too much alike to show anything";
}

INSTANTIATE_TEST_SUITE_P(ClosedModels, BakedModelViewer, testing::Values("asteroid", "seashell"),
                         [](const testing::TestParamInfo<const char*>& parameter) { return parameter.param; });

// ---- stock osgviewer

bool isInstalled(const std::string& program)
{
    return std::system(("command -v " + program + " > /dev/null 2>&1").c_str()) == 0;
}

/// Rows from the top of what an X server of 32 bits a pixel shows, from its file of XWD's format: a header of
/// big-endian words, a colour map of 12 bytes an entry, and pixels B, G, R, x. Empty if it is something else.
std::vector<std::array<int, 3>> readScreen(const std::string& path, int width, int height)
{
    const std::string bytes = readBytes(path);
    const auto word = [&](std::size_t index) {
        std::uint32_t value = 0;
        for (std::size_t k = 0; k < 4; ++k) { value = value << 8U | static_cast<unsigned char>(bytes[4 * index + k]); }
        return value;
    };
    if (bytes.size() < 100) { return {}; }
    const std::size_t start = word(0) + std::size_t{12} * word(19);
    const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    if (word(11) != 32 || bytes.size() != start + 4 * size) { return {}; }
    std::vector<std::array<int, 3>> pixels;
    for (std::size_t k = 0; k < size; ++k) {
        const auto byte = [&](std::size_t offset) {
            return static_cast<int>(static_cast<unsigned char>(bytes[start + 4 * k + offset]));
        };
        pixels.push_back({byte(2), byte(1), byte(0)});
    }
    return pixels;
}

/// Shows `model` in osgviewer under an X server of its own until the last pixel, of the background, is no more black.
/// The result is the server's screen.
std::string showInStockViewer(const TemporaryDirectory& folder, const std::string& model)
{
    const std::string screen = folder.file("Xvfb_screen0");
    const std::string shot = folder.file("shot.xwd");
    writeBytes(folder.file("show.sh"), "osgviewer --SingleThreaded --window 0 0 320 240 '" + model +
                                           "' & viewer=$!\n"
                                           "for try in $(seq 300); do\n"
                                           "  sleep 0.1\n"
                                           "  [ \"$(tail -c 4 '" +
                                           screen +
                                           "' | od -An -tx4)\" = ' 00000000' ] || break\n"
                                           "done\n"
                                           "sleep 0.5\n"
                                           "cp '" +
                                           screen + "' '" + shot +
                                           "'\n"
                                           "kill $viewer\n");
    const std::string command = "env OSG_LIBRARY_PATH='" OSGTESSLOD_PLUGINS "' timeout 60 xvfb-run -a "
                                "-s '-screen 0 320x240x24 -fbdir " +
                                folder.file("") + "' sh '" + folder.file("show.sh") + "' > '" +
                                folder.file("show.log") + "' 2>&1";
    EXPECT_NE(std::system(command.c_str()), -1);
    return shot;
}

TEST(BakedModelStockViewer, ShowsTheSamePicture)
{
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "the sanitizer's library would have to be osgviewer's first";
#endif
    if (!isInstalled("xvfb-run") || !isInstalled("osgviewer")) { GTEST_SKIP() << "needs xvfb-run and osgviewer"; }
    const TemporaryDirectory folder;
    const std::string model = folder.file("x.tlod");
    writeTlod(model, bakeBuiltin("asteroid", 16));
    const Outcome outcome =
        runViewer(folder, "--headless --size 320x240 --screenshot " + folder.file("p.png") + " " + model);
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    const osg::ref_ptr<osg::Image> image = osgDB::readRefImageFile(folder.file("p.png"));
    ASSERT_TRUE(image);

    const std::vector<std::array<int, 3>> screen = readScreen(showInStockViewer(folder, model), 320, 240);
    ASSERT_EQ(screen.size(), 320U * 240U) << readBytes(folder.file("show.log"));
    double sum = 0.0;
    std::size_t surfacePixels = 0;
    for (unsigned y = 0; y < 240; ++y) {
        for (unsigned x = 0; x < 320; ++x) {
            const osg::Vec4 color = image->getColor(x, 239U - y); // rows from the bottom
            const std::array<int, 3>& pixel = screen[y * 320 + x];
            for (unsigned c = 0; c < 3; ++c) { sum += std::fabs(static_cast<double>(color[c]) * 255.0 - pixel[c]); }
            surfacePixels += pixel != screen.front() ? 1 : 0;
        }
    }
    EXPECT_GT(surfacePixels, 5000U) << "the model is not to be seen";
    EXPECT_LE(sum / (3.0 * 320.0 * 240.0), 2.0) << "mean difference in 255ths";
}

} // namespace
} // namespace osgTessLOD
