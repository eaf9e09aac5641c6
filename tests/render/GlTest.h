// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/PatchSelection.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <osgtesslodviewer/headless/HeadlessContext.h>
#include <render/WarningCollector.h>

#include <osg/GraphicsContext>
#include <osg/RenderInfo>
#include <osg/State>

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

namespace osgTessLOD {

/// A current context; after each test there must be no GL error and no warning.
class GlTest : public testing::Test {
protected:
    void SetUp() override
    {
        std::string error;
        context = createHeadlessContext(64, 64, error);
        ASSERT_TRUE(context.valid()) << error;
        ASSERT_TRUE(context->realize());
        ASSERT_TRUE(context->makeCurrent());
        context->getState()->initializeExtensionProcs();
        context->getState()->setCheckForGLErrors(osg::State::ONCE_PER_ATTRIBUTE);
        renderInfo.setState(context->getState());
    }
    void TearDown() override
    {
        EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
        EXPECT_EQ(warnings.text(), "");
        context->releaseContext();
    }
    osg::State& state() { return *context->getState(); }

    /// Captures what these records look like; grouped by level first.
    std::vector<osg::Vec3f> capture(GpuAsset& asset, std::vector<PatchRecord>& records,
                                    const std::string& varying = "tessLodObjectPosition")
    {
        const auto level = [](const PatchRecord& r) { return MorphedSurface::drawnLevel(r.edgeLevels); };
        std::stable_sort(records.begin(), records.end(),
                         [&](const PatchRecord& a, const PatchRecord& b) { return level(a) < level(b); });
        const osg::ref_ptr<PatchSelection> selection =
            new PatchSelection(&asset, records, asset.selector().statisticsOf(records), SelectionView());
        return selection->capture(renderInfo, varying);
    }

    WarningCollector warnings;
    osg::ref_ptr<osg::GraphicsContext> context;
    osg::RenderInfo renderInfo;
};

inline osg::ref_ptr<GpuAsset> makeGpuAsset(LodAsset asset)
{
    return new GpuAsset(std::make_shared<const LodAsset>(std::move(asset)));
}

} // namespace osgTessLOD
