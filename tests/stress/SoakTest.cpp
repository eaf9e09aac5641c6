// SPDX-License-Identifier: MIT
// Scenes that come and go, for seconds or, with OSGTESSLOD_SOAK_SECONDS, for as long as one likes: nothing may be left behind.
#include <asset/SyntheticAsset.h>

#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <osgTessLOD/render/TessLODInstances.h>
#include <osgTessLOD/render/VideoMemory.h>
#include <render/ViewerTest.h>
#include <stress/Stress.h>

#include <osg/GLExtensions>
#include <osg/Timer>
#include <osgDB/ReadFile>

#include <cstdint>
#include <fstream>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <unistd.h>

namespace osgTessLOD::stress {
namespace {

double soakSeconds()
{
    const char* seconds = std::getenv("OSGTESSLOD_SOAK_SECONDS");
    return seconds != nullptr ? std::strtod(seconds, nullptr) : 6.0;
}

/// Resident set of the process, bytes.
std::uint64_t residentBytes()
{
    std::ifstream file("/proc/self/statm");
    std::uint64_t whole = 0;
    std::uint64_t pages = 0;
    file >> whole >> pages;
    return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

class Soak : public testing::Test {
protected:
    Soak()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        setUpHeadless(*viewer.getCamera(), 96, 96);
        viewer.setSceneData(scene.get());
        viewer.realize();
    }
    ~Soak() override { VideoMemory::shared().setLimits({}); }

    double random(double low, double high) { return std::uniform_real_distribution<double>(low, high)(_random); }
    bool chance(double part) { return random(0.0, 1.0) < part; }

    /// As a file would bring it.
    std::shared_ptr<const LodAsset> makeAsset()
    {
        const unsigned factor = 1U << static_cast<unsigned>(random(1.0, 5.99));
        std::stringstream file;
        writeTlod(file, makeSyntheticAsset(factor, chance(0.5)));
        return std::make_shared<const LodAsset>(readTlod(file, "soak"));
    }

    /// Another scene of one to four drawables.
    void changeScene()
    {
        scene->removeChildren(0, scene->getNumChildren());
        const auto count = static_cast<unsigned>(random(1.0, 4.99));
        for (unsigned k = 0; k < count; ++k) {
            osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(makeAsset());
            if (chance(0.3)) {
                const osg::ref_ptr<TessLODInstances> instances = new TessLODInstances;
                instances->shareAsset(*drawable);
                instances->setPlacements({osg::Matrixd(), osg::Matrixd::translate(random(2.0, 4.0), 0.0, 0.0)});
                drawable = instances.get();
            }
            SelectionOptions options;
            options.errorPixels = random(0.02, 4.0);
            options.backend = chance(0.5) ? Backend::Tessellation : Backend::Instanced;
            options.selector = chance(0.2) ? SelectionOptions::Selector::Gpu : SelectionOptions::Selector::Cpu;
            drawable->setOptions(options);
            scene->addChild(drawable.get());
        }
        constexpr std::uint64_t kNone = VideoMemory::Limits::kNone;
        VideoMemory::shared().setLimits({chance(0.3) ? 50'000U : kNone, chance(0.3) ? 300'000U : kNone});
    }

    void frames(unsigned count)
    {
        for (unsigned k = 0; k < count; ++k) {
            const double distance = std::exp(random(0.3, 5.0));
            viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(0.0, -distance, 0.3 * distance), osg::Vec3d(),
                                                      osg::Vec3d(0.0, 0.0, 1.0));
            viewer.frame();
        }
    }

    /// Buffers and textures of the context.
    std::size_t glObjects()
    {
        osg::GraphicsContext& context = *viewer.getCamera()->getGraphicsContext();
        context.makeCurrent();
        const auto* gl = context.getState()->get<osg::GLExtensions>();
        std::size_t count = 0;
        for (GLuint name = 1; name < 10'000; ++name) {
            count += (gl->glIsBuffer(name) != 0 ? 1 : 0) + (glIsTexture(name) != 0 ? 1 : 0);
        }
        context.releaseContext();
        return count;
    }

    osg::ref_ptr<osg::Group> scene = new osg::Group;
    osgViewer::Viewer viewer;

private:
    std::mt19937 _random{1};
};

TEST_F(Soak, ChangingScenesLeaveNothingBehind)
{
    const osg::Timer_t start = osg::Timer::instance()->tick();
    const auto seconds = [&] { return osg::Timer::instance()->delta_s(start, osg::Timer::instance()->tick()); };
    const double all = soakSeconds();
    std::uint64_t scenes = 0;
    // The first quarter fills pools and caches: programs of all variants, OSG's pools of buffers, the allocator's.
    std::size_t mostObjects = 0;
    std::uint64_t mostBytes = 0;
    for (; seconds() < all / 4; ++scenes) {
        changeScene();
        frames(6);
        mostObjects = std::max(mostObjects, glObjects());
        mostBytes = std::max(mostBytes, residentBytes());
    }
    const std::uint64_t scenesBefore = scenes;
    std::size_t objects = 0;
    for (; seconds() < all; ++scenes) {
        changeScene();
        frames(6);
        objects = std::max(objects, glObjects());
    }
    report("seconds", seconds());
    report("scenes", static_cast<double>(scenes));
    report("most GL objects, first quarter", static_cast<double>(mostObjects));
    report("most GL objects, then", static_cast<double>(objects));
    report("most MiB, first quarter", static_cast<double>(mostBytes) / 1048576.0);
    report("MiB in the end", static_cast<double>(residentBytes()) / 1048576.0);
    ASSERT_GT(scenes, scenesBefore);
    // Each scene has some 30 objects: a leak of one in ten scenes would show within a minute.
    EXPECT_LE(objects, 2 * mostObjects + 20);
    // Three quarters of the scenes came after: were a scene's 100 KiB left behind, the set would have doubled.
    EXPECT_LE(residentBytes(), mostBytes + mostBytes / 4 + (32U << 20));

    scene->removeChildren(0, scene->getNumChildren());
    for (int k = 0; k < 20; ++k) { viewer.frame(); }
    EXPECT_EQ(VideoMemory::shared().statistics().wholeBytes, 0U) << "no asset is left";
}

} // namespace
} // namespace osgTessLOD::stress
