// SPDX-License-Identifier: MIT
#include <osgtesslodviewer/CapturedMesh.h>

#include <gtest/gtest.h>

namespace osgTessLOD {
namespace {

TEST(CapturedMesh, WeldsEqualPositionsAlone)
{
    CapturedMesh mesh;
    // Two triangles that share an edge, one end of it given as −0; and one that misses them by a hair.
    mesh.add({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {-0.0F, 1, 0}}, osg::Matrixd());
    mesh.add({{0, 1e-7F, 0}, {5, 0, 0}, {0, 5, 0}}, osg::Matrixd());
    EXPECT_EQ(mesh.counts().triangles, 3U);
    EXPECT_EQ(mesh.counts().faces, 3U);
    EXPECT_EQ(mesh.counts().vertices, 4U + 3U);
    EXPECT_EQ(mesh.surface().triangles[1][2], mesh.surface().triangles[0][2]);
}

TEST(CapturedMesh, LeavesOutAndCountsTrianglesWithEqualCorners)
{
    CapturedMesh mesh;
    mesh.add({{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, osg::Matrixd());
    EXPECT_EQ(mesh.counts().triangles, 2U);
    EXPECT_EQ(mesh.counts().degenerateTriangles, 1U);
    EXPECT_EQ(mesh.counts().faces, 1U);
}

TEST(CapturedMesh, TransformsInDoublePrecision)
{
    CapturedMesh mesh;
    mesh.add({{0.125F, 0, 0}, {1, 0, 0}, {0, 1, 0}}, osg::Matrixd::translate(1e9, 0.0, 0.0));
    EXPECT_EQ(mesh.surface().positions[0][0], 1e9 + 0.125);
}

} // namespace
} // namespace osgTessLOD
