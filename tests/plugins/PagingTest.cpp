// SPDX-License-Identifier: MIT
// .tlod files as children of PagedLODs, read by the DatabasePager's thread while frames are drawn.
#include <asset/SyntheticAsset.h>
#include <render/ViewerTest.h>
#include <render/WarningCollector.h>

#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/PlacedDrawable.h>
#include <support/TemporaryDirectory.h>

#include <osg/PagedLOD>
#include <osgDB/DatabasePager>
#include <osgDB/ReadFile>
#include <osgDB/WriteFile>

#include <chrono>
#include <thread>

namespace osgTessLOD {
namespace {

osg::ref_ptr<osg::PagedLOD> makePagedLod(const std::string& fileName)
{
    osg::ref_ptr<osg::PagedLOD> paged = new osg::PagedLOD;
    paged->setCenter(osg::Vec3());
    paged->setRadius(1.0F);
    paged->setFileName(0, fileName);
    paged->setRange(0, 0.0F, 1000.0F);
    return paged;
}

TEST(Paging, ModelsArriveThroughTheDatabasePager)
{
    const TemporaryDirectory folder;
    LodAsset asset = makeSyntheticAsset();
    asset.lattice.origin = {0.0, 2.0, 0.0};
    writeTlod(folder.file("x.tlod"), asset);
    // The scene itself from a file, as tiles of a terrain name the next finer ones.
    ASSERT_TRUE(osgDB::writeNodeFile(*makePagedLod("x.tlod"), folder.file("scene.osgt")));
    const osg::ref_ptr<osg::Node> scene = osgDB::readRefNodeFile(folder.file("scene.osgt"));
    ASSERT_TRUE(scene);

    const WarningCollector warnings;
    osgViewer::Viewer viewer;
    setUpHeadless(*viewer.getCamera(), 64, 64);
    const osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    viewer.getCamera()->setFinalDrawCallback(snapshot);
    viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(0.0, -10.0, 2.0), osg::Vec3d(0.0, 2.0, 0.0),
                                              osg::Vec3d(0, 0, 1));
    viewer.getCamera()->setClearColor(osg::Vec4(0.0F, 0.0F, 0.0F, 1.0F));
    viewer.setThreadingModel(osgViewer::ViewerBase::DrawThreadPerContext);
    viewer.setIncrementalCompileOperation(new osgUtil::IncrementalCompileOperation);
    viewer.setSceneData(scene);
    viewer.setReleaseContextAtEndOfFrameHint(true);
    viewer.realize();
    std::vector<PlacedDrawable> found;
    for (int frame = 0; frame < 2000 && found.empty(); ++frame) {
        viewer.frame();
        found = findTessLODDrawables(*scene);
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    ASSERT_EQ(found.size(), 1U) << warnings.text();
    EXPECT_EQ(found.front().localToWorld, osg::Matrixd::translate(0.0, 2.0, 0.0));
    viewer.frame();
    viewer.frame();
    viewer.stopThreading();
    EXPECT_NE(snapshot->image().getColor(32U, 32U), osg::Vec4(0.0F, 0.0F, 0.0F, 1.0F));
    EXPECT_EQ(warnings.text(), "");
}

} // namespace
} // namespace osgTessLOD
