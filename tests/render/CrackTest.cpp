// SPDX-License-Identifier: MIT
// No background shines through closed models, whatever levels meet at a border, seen from anywhere outside of them.
#include <render/ClosedSurface.h>
#include <render/GlTest.h>
#include <render/ViewerTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/render/PlacedDrawable.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <support/RandomDirection.h>
#include <support/TemporaryDirectory.h>

#include <osg/CullFace>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace osgTessLOD {
namespace {

constexpr int kSize = 256;

/// The picture's pixels that show the background.
class Background {
public:
    explicit Background(const osg::Image& picture)
    {
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const unsigned char* p = picture.data(static_cast<unsigned>(x), static_cast<unsigned>(y));
                at(x, y) = p[0] == 0 && p[1] == 0 && p[2] == 255 ? Pixel::Background : Pixel::Surface;
            }
        }
        for (int k = 0; k < kSize; ++k) {
            for (const int end : {0, kSize - 1}) {
                flood(k, end);
                flood(end, k);
            }
        }
    }

    std::size_t covered() const
    {
        return static_cast<std::size_t>(std::count(_pixels.begin(), _pixels.end(), Pixel::Surface));
    }
    /// Pixels of the background inside the silhouette of a star-shaped body: not joined to the picture's edge, nor near to any
    /// that is. The last of these are left out because pixels that have their centres in the point of a notch may be apart.
    std::size_t holes() const
    {
        std::size_t count = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) { count += at(x, y) == Pixel::Background && !isNearOutside(x, y) ? 1 : 0; }
        }
        return count;
    }

private:
    enum class Pixel : char { Surface, Background, Outside };

    Pixel& at(int x, int y) { return _pixels[static_cast<std::size_t>(y * kSize + x)]; }
    Pixel at(int x, int y) const { return _pixels[static_cast<std::size_t>(y * kSize + x)]; }
    template <typename Visit> static void forNeighbours(int x, int y, int reach, const Visit& visit)
    {
        for (int v = std::max(0, y - reach); v <= std::min(kSize - 1, y + reach); ++v) {
            for (int u = std::max(0, x - reach); u <= std::min(kSize - 1, x + reach); ++u) { visit(u, v); }
        }
    }
    void flood(int x, int y)
    {
        std::vector<std::pair<int, int>> open{{x, y}};
        while (!open.empty()) {
            const auto [u, v] = open.back();
            open.pop_back();
            if (at(u, v) != Pixel::Background) { continue; }
            at(u, v) = Pixel::Outside;
            forNeighbours(u, v, 1, [&](int s, int t) { open.emplace_back(s, t); });
        }
    }
    bool isNearOutside(int x, int y) const
    {
        bool isNear = false;
        forNeighbours(x, y, 2, [&](int u, int v) { isNear = isNear || at(u, v) == Pixel::Outside; });
        return isNear;
    }

    std::array<Pixel, std::size_t{kSize} * kSize> _pixels{};
};

/// A star-shaped body about the origin, simplified by strips.
std::shared_ptr<const LodAsset> bakedAsteroid()
{
    static const std::shared_ptr<const LodAsset> asset = [] {
        bake::BakeOptions options;
        options.maxFactor = 16;
        options.normals = false;
        bake::Progress progress;
        bake::BakeReport report;
        return std::make_shared<const LodAsset>(bake::bakeSource("builtin:asteroid", options, progress, report));
    }();
    return asset;
}

std::vector<std::shared_ptr<const LodAsset>> closedAssets()
{
    return {bakedAsteroid(), std::make_shared<const LodAsset>(makeSyntheticDisplacedAsset(16, false)),
            std::make_shared<const LodAsset>(makeSyntheticMixedAsset(16))};
}

class Cracks : public testing::TestWithParam<Backend> {
protected:
    Cracks()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        setUpHeadless(*viewer.getCamera(), kSize, kSize);
        viewer.getCamera()->setClearColor(osg::Vec4(0.0F, 0.0F, 1.0F, 1.0F));
        viewer.getCamera()->setFinalDrawCallback(snapshot.get());
        osg::StateSet* state = root->getOrCreateStateSet();
        state->setMode(GL_LIGHTING, osg::StateAttribute::OFF | osg::StateAttribute::OVERRIDE);
        // Or the inside of the other half would show through a crack.
        state->setAttributeAndModes(new osg::CullFace(osg::CullFace::BACK));
        viewer.setSceneData(root.get());
        viewer.realize();
    }
    ~Cracks() override { EXPECT_EQ(warnings.text(), ""); }

    double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random); }
    osg::Vec3d direction() { return randomDirection(random); }
    /// Looks from anywhere outside at some place near the middle, so that all of the body is before the eye.
    void lookAtRandom(const LodAsset& asset)
    {
        double squared = 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
            const double most = std::max(std::fabs(double{asset.boundsMin[k]}), std::fabs(double{asset.boundsMax[k]}));
            squared += most * most;
        }
        const double radius = std::sqrt(squared);
        viewer.getCamera()->setProjectionMatrixAsPerspective(uniform(20.0, 90.0), 1.0, 0.1, 100.0);
        viewer.getCamera()->setViewMatrixAsLookAt(direction() * radius * std::exp(uniform(0.2, 1.4)),
                                                  direction() * radius * uniform(0.0, 0.2), direction());
    }
    Background picture()
    {
        viewer.renderingTraversals();
        return Background(snapshot->image());
    }
    /// Shows all patches at these levels.
    osg::ref_ptr<PatchSelection> show(const GpuAsset& asset, const std::vector<float>& edgeLevels)
    {
        std::vector<PatchRecord> records;
        for (std::uint32_t p = 0; p < asset.asset().patches.size(); ++p) {
            const auto& edges = asset.asset().patches[p].edges;
            records.push_back({p, {edgeLevels[edges[0]], edgeLevels[edges[1]], edgeLevels[edges[2]]}});
        }
        const auto level = [](const PatchRecord& record) { return MorphedSurface::drawnLevel(record.edgeLevels); };
        std::stable_sort(records.begin(), records.end(),
                         [&](const PatchRecord& a, const PatchRecord& b) { return level(a) < level(b); });
        const SelectionStatistics statistics = asset.selector().statisticsOf(records);
        osg::ref_ptr<PatchSelection> selection =
            new PatchSelection(&asset, std::move(records), statistics, SelectionView(), GetParam());
        selection->setStateSet(asset.sortState()); // as a leaf has it: drawing puts the program in this one's place
        show(selection.get());
        return selection;
    }
    void show(osg::Node* node)
    {
        root->removeChildren(0, root->getNumChildren());
        root->addChild(node);
    }
    /// The triangles that the GPU makes of a selection, between frames.
    std::vector<osg::Vec3f> capture(const PatchSelection& selection)
    {
        osg::GraphicsContext& context = *viewer.getCamera()->getGraphicsContext();
        EXPECT_TRUE(context.makeCurrent());
        osg::RenderInfo renderInfo(context.getState(), nullptr);
        std::vector<osg::Vec3f> corners = selection.capture(renderInfo);
        context.releaseContext();
        return corners;
    }
    /// Every border at one of two levels, or a little below where `fractional`, as far as it goes.
    std::vector<float> mixedLevels(const LodAsset& asset, unsigned one, unsigned other, bool fractional)
    {
        std::vector<float> levels;
        for (const LodEdge& edge : asset.edges) {
            const double level = (random() % 3 == 0 ? other : one) - (fractional ? uniform(0.0, 0.999) : 0.0);
            levels.push_back(static_cast<float>(std::clamp(level, 0.0, static_cast<double>(edge.finestLevel))));
        }
        return levels;
    }

    std::size_t holesBetween(const std::vector<LodAsset>& assets);

    WarningCollector warnings;
    std::mt19937 random{2024};
    osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    osg::ref_ptr<osg::Group> root = new osg::Group;
    osgViewer::Viewer viewer;
};

TEST_P(Cracks, areNowhereInAThousandViews)
{
    constexpr int kCaptureEvery = 20;
    const auto assets = closedAssets();
    const std::array<int, 3> views{400, 300, 300};
    const osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
    int mixed = 0;
    for (std::size_t a = 0; a < assets.size(); ++a) {
        const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(assets[a]);
        drawable->setSelectionObserver(observer.get());
        show(drawable.get());
        for (int k = 0; k < views[a]; ++k) {
            lookAtRandom(*assets[a]);
            SelectionOptions options;
            options.backend = GetParam();
            options.errorPixels = std::exp(uniform(-1.5, 3.5));
            options.cullPatches = k % kCaptureEvery != 0; // all of it is captured
            options.bound = k % 2 == 0 ? SelectionOptions::Bound::Conservative : SelectionOptions::Bound::FirstOrder;
            drawable->setOptions(options);
            const Background background = picture();
            ASSERT_EQ(background.holes(), 0U) << "asset " << a << ", view " << k;
            ASSERT_GT(background.covered(), 100U) << "asset " << a << ", view " << k;
            const auto entries = observer->take();
            ASSERT_EQ(entries.size(), 1U);
            const auto& records = entries[0].records;
            mixed += MorphedSurface::drawnLevel(records.front().edgeLevels) !=
                             MorphedSurface::drawnLevel(records.back().edgeLevels)
                         ? 1
                         : 0;
            if (k % kCaptureEvery == 0) {
                ASSERT_EQ(unmatchedEdges(capture(*entries[0].selection)), 0U) << "asset " << a << ", view " << k;
            }
        }
    }
    EXPECT_GT(mixed, 300) << "several levels in one view, or the test shows little";
}

TEST_P(Cracks, areNowhereBetweenAnyTwoLevels)
{
    for (const auto& made : closedAssets()) {
        const osg::ref_ptr<GpuAsset> asset = new GpuAsset(made);
        std::set<std::pair<unsigned, unsigned>> neighbours; // levels that met at a border
        for (unsigned one = 0; one < made->ladder.size(); ++one) {
            for (unsigned other = 0; other < made->ladder.size(); ++other) {
                for (int k = 0; k < 4; ++k) {
                    const osg::ref_ptr<PatchSelection> shown = show(*asset, mixedLevels(*made, one, other, k % 2 != 0));
                    lookAtRandom(*made);
                    ASSERT_EQ(picture().holes(), 0U) << "levels " << one << " and " << other;
                    if (k < 2) {
                        ASSERT_EQ(unmatchedEdges(capture(*shown)), 0U) << "levels " << one << " and " << other;
                    }
                    std::vector<unsigned> drawn(made->patches.size());
                    for (const PatchRecord& record : shown->records()) {
                        drawn[record.patch] = MorphedSurface::drawnLevel(record.edgeLevels);
                    }
                    for (const LodEdge& edge : made->edges) {
                        neighbours.insert(std::minmax(drawn[edge.patches[0]], drawn[edge.patches[1]]));
                    }
                }
            }
        }
        const std::size_t levels = made->ladder.size();
        const auto reaches = [&](const LodPatch& patch) { return patch.finestLevel + 1U == levels; };
        if (std::all_of(made->patches.begin(), made->patches.end(), reaches)) {
            EXPECT_EQ(neighbours.size(), levels * (levels + 1) / 2);
        }
    }
}

/// Hills, 65 × 65 samples 10 apart, as a file of heights.
void writeHills(const std::string& path)
{
    constexpr int kSide = 65;
    std::ofstream file(path, std::ios::binary);
    for (int r = 0; r < kSide; ++r) {
        for (int c = 0; c < kSide; ++c) {
            const auto height = static_cast<int>(std::lround(300.0 + 30.0 * std::sin(0.17 * c) * std::cos(0.13 * r) +
                                                             3.0 * std::sin(0.9 * c + 0.5 * r)));
            file << static_cast<char>(height >> 8) << static_cast<char>(height & 0xFF);
        }
    }
}

/// Two by two tiles, baked apart.
const std::vector<LodAsset>& bakedTiles()
{
    static const std::vector<LodAsset> tiles = [] {
        const TemporaryDirectory folder;
        const std::string path = folder.file("N46E007.hgt");
        writeHills(path);
        bake::BakeOptions options;
        options.maxFactor = 8;
        options.normals = false;
        options.heights.spacing = {{10.0, 10.0}};
        options.tolerance = 0.002;
        std::vector<LodAsset> made;
        for (std::uint32_t k = 0; k < 4; ++k) {
            options.tile = bake::TileChoice{k % 2, k / 2, 2};
            bake::Progress progress;
            bake::BakeReport report;
            made.push_back(bake::bakeSource(path, options, progress, report));
            EXPECT_TRUE(made.back().hasSeams());
        }
        return made;
    }();
    return tiles;
}

/// Pixels of the background between tiles, seen from above in 100 views.
std::size_t Cracks::holesBetween(const std::vector<LodAsset>& assets)
{
    const osg::ref_ptr<osg::Group> terrain = new osg::Group;
    std::vector<osg::ref_ptr<TessLODDrawable>> tiles;
    for (const LodAsset& asset : assets) {
        tiles.push_back(new TessLODDrawable(std::make_shared<const LodAsset>(asset)));
        terrain->addChild(placeAtOrigin(*tiles.back()).get());
    }
    show(terrain.get());
    const osg::BoundingSphere around = terrain->getBound();
    std::size_t holes = 0;
    for (int k = 0; k < 100; ++k) {
        SelectionOptions options;
        options.backend = GetParam();
        options.bound = k % 2 == 0 ? SelectionOptions::Bound::Conservative : SelectionOptions::Bound::FirstOrder;
        for (const auto& tile : tiles) { // each asks for an error of its own
            options.errorPixels = std::exp(uniform(-1.0, 3.5));
            tile->setOptions(options);
        }
        // Steeper than the slopes, so that no hill hides ground behind it.
        const double azimuth = uniform(0.0, 6.3);
        const double slope = uniform(1.1, 1.57);
        const osg::Vec3d from(std::cos(azimuth) * std::cos(slope), std::sin(azimuth) * std::cos(slope), std::sin(slope));
        const double distance = around.radius() * std::exp(uniform(0.2, 1.6));
        viewer.getCamera()->setProjectionMatrixAsPerspective(40.0, 1.0, 0.01 * distance, 10.0 * distance);
        viewer.getCamera()->setViewMatrixAsLookAt(around.center() + from * distance, around.center(),
                                                  osg::Vec3d(-std::sin(azimuth), std::cos(azimuth), 0.0));
        const Background background = picture();
        EXPECT_GT(background.covered(), 100U) << k;
        holes += background.holes();
    }
    return holes;
}

TEST_P(Cracks, areNowhereBetweenTilesBakedApart)
{
    EXPECT_EQ(holesBetween(bakedTiles()), 0U);
}

TEST_P(Cracks, areSeenBetweenTilesWithoutSeams)
{
    std::vector<LodAsset> alone = bakedTiles();
    for (LodAsset& tile : alone) {
        for (LodEdge& edge : tile.edges) { edge.coarsestLevel = 0; }
    }
    EXPECT_GT(holesBetween(alone), 0U);
}

TEST_P(Cracks, areSeenWhereThereAreSome)
{
    LodAsset torn = makeSyntheticAsset(16, false);
    const unsigned level = 3;
    LodVertex& vertex = torn.levels[level].vertices[torn.ladder[level] / 2]; // in the middle of a border of patch 0
    std::array<std::int32_t, 3> offset = vertex.offset();
    for (std::int32_t& x : offset) { x -= x > 3000 ? 3000 : -3000; } // 3 % of the patch
    vertex = LodVertex::pack(offset, vertex.parent());
    const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(torn);
    const osg::ref_ptr<PatchSelection> shown =
        show(*asset, std::vector<float>(torn.edges.size(), static_cast<float>(level)));
    EXPECT_EQ(unmatchedEdges(capture(*shown)), 4U); // two edges, from both sides
    std::size_t holes = 0;
    for (int k = 0; k < 50; ++k) {
        lookAtRandom(torn);
        holes += picture().holes();
    }
    EXPECT_GT(holes, 0U);
}

INSTANTIATE_TEST_SUITE_P(EveryBackend, Cracks, testing::Values(Backend::Tessellation, Backend::Instanced),
                         [](const auto& named) { return std::string(nameOf(named.param)); });

} // namespace
} // namespace osgTessLOD
