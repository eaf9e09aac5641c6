// SPDX-License-Identifier: MIT
// Materials of OBJ and MTL files through the bake: their borders become borders of patches.
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/AssetImages.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/ControlMesh.h>
#include <osgTessLOD/bake/MeshReader.h>
#include <osgTessLOD/bake/RefinedPatches.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <filesystem>

namespace osgTessLOD::bake {
namespace {

using Role = LodTexture::Role;
using testing::Test;

TEST(MtlFile, KeywordsAreThoseOfTheFormat)
{
    const auto materials = parseMtl("# a comment\r\n"
                                    "Kd 9 9 9\n" // of no material
                                    "newmtl red paint\n"
                                    "\tKa 0.1 0.2 0.3\n"
                                    "Kd 1 0.5 0 # trailing\n"
                                    "Ks 0.25\n"
                                    "Ke 0 0 2\n"
                                    "Ns 1000\n"
                                    "d 0.5\n"
                                    "illum 2\n"
                                    "newmtl glass\n"
                                    "Tr 0.75\n"
                                    "Kd spectral file.rfl 1\n"
                                    "newmtl plain\n");
    ASSERT_EQ(materials.size(), 3U);
    const LodReflectance& red = materials[0].reflectance;
    EXPECT_EQ(materials[0].name, "red paint");
    EXPECT_TRUE(materials[0].hasReflectance);
    EXPECT_EQ(red.ambient, (std::array<float, 4>{0.1F, 0.2F, 0.3F, 1.0F}));
    EXPECT_EQ(red.diffuse, (std::array<float, 4>{1.0F, 0.5F, 0.0F, 0.5F}));
    EXPECT_EQ(red.specular, (std::array<float, 4>{0.25F, 0.25F, 0.25F, 1.0F})) << "one number is a grey";
    EXPECT_EQ(red.emission, (std::array<float, 4>{0.0F, 0.0F, 1.0F, 1.0F})) << "limited";
    EXPECT_EQ(red.shininess, 128.0F) << "limited";
    EXPECT_EQ(materials[1].reflectance.diffuse[3], 0.25F);
    EXPECT_EQ(materials[1].reflectance.diffuse[0], LodReflectance().diffuse[0]) << "spectra are not read";
    EXPECT_FALSE(materials[2].hasReflectance);
    EXPECT_TRUE(materials[2].textures.empty());
}

TEST(MtlFile, TexturesHaveOptionsAndRoles)
{
    const auto materials = parseMtl("newmtl a\n"
                                    "map_Kd -s 1 1 -blendu on -mm 0 1 maps\\my wood.png\n"
                                    "map_Bump -bm 0.3 stone_normal.png\n"
                                    "bump height.png\n"
                                    "norm n.png\n"
                                    "map_Ks\n"
                                    "map_d -clamp on alpha.png\n");
    ASSERT_EQ(materials.size(), 1U);
    EXPECT_EQ(materials[0].textures, (std::vector<LodTexture>{{Role::Color, "map_kd", "maps/my wood.png"},
                                                              {Role::Normal, "map_bump", "stone_normal.png"},
                                                              {Role::Other, "bump", "height.png"},
                                                              {Role::Normal, "norm", "n.png"},
                                                              {Role::Other, "map_d", "alpha.png"}}));
    EXPECT_EQ(materials[0].reflectance.diffuse, (std::array<float, 4>{1.0F, 1.0F, 1.0F, 1.0F})) << "the image alone";
    EXPECT_FALSE(materials[0].hasReflectance);
}

class ObjMaterials : public Test {
protected:
    SourceMesh import(const std::string& content)
    {
        writeBytes(folder.file("m.obj"), content);
        return importMesh(folder.file("m.obj"));
    }

    const std::string quads = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n";
    TemporaryDirectory folder;
};

TEST_F(ObjMaterials, AreOfTheFacesThatFollow)
{
    std::filesystem::create_directory(folder.file("maps"));
    writeBytes(folder.file("maps/a.mtl"), "newmtl blue\nKd 0 0 1\nmap_Kd blue.png\n");
    writeBytes(folder.file("maps/blue.png"), "x");
    const SourceMesh mesh =
        import("mtllib maps/a.mtl\n" + quads + "f 1 2 3 4\nusemtl blue\nf 2 5 6 3\nusemtl  none \nf 1 2 6\n");
    ASSERT_EQ(mesh.materials.size(), 3U);
    EXPECT_EQ(mesh.materials[0], LodMaterial()) << "of faces before the first usemtl";
    EXPECT_EQ(mesh.materials[1].name, "blue");
    EXPECT_EQ(mesh.materials[1].reflectance.diffuse[2], 1.0F);
    ASSERT_EQ(mesh.materials[1].textures.size(), 1U);
    EXPECT_EQ(mesh.materials[1].textures[0].image, folder.file("maps/blue.png"));
    EXPECT_EQ(mesh.triangleMaterials, (std::vector<std::uint16_t>{0, 0, 1, 1, 2}));
    ASSERT_EQ(mesh.warnings.size(), 1U);
    EXPECT_EQ(mesh.warnings[0], "the material none is in none of the files it should be in");
}

TEST_F(ObjMaterials, OneIsOfAllAndNoneIsNone)
{
    EXPECT_TRUE(import(quads + "f 1 2 3\n").materials.empty());
    const SourceMesh mesh = import(quads + "usemtl x\nf 1 2 3\nf 1 3 4\n");
    EXPECT_EQ(mesh.materials.size(), 1U);
    EXPECT_TRUE(mesh.triangleMaterials.empty());
    EXPECT_TRUE(mesh.warnings.empty()) << "no file was named";
}

TEST_F(ObjMaterials, WhatIsMissingIsNamed)
{
    writeBytes(folder.file("b.mtl"), "newmtl x\nmap_Kd lost.png\n");
    const SourceMesh mesh = import("mtllib gone.mtl b.mtl\nmtllib ./gone.mtl\n" + quads + "usemtl x\nf 1 2 3\n");
    ASSERT_EQ(mesh.warnings.size(), 2U) << "a file that is named twice is read once";
    EXPECT_EQ(mesh.warnings[0], folder.file("gone.mtl") + ": no such file");
    EXPECT_EQ(mesh.warnings[1], folder.file("lost.png") + ": no such file, which is map_kd of the material x");
}

TEST_F(ObjMaterials, StayWithTheirFacesInCleaning)
{
    SourceMesh mesh = import(quads + "usemtl a\nf 1 2 3\nf 1 2 2\nusemtl b\nf 3 2 5\nf 1 2 3\nusemtl c\nf 3 5 6\n");
    cleanMesh(mesh);
    EXPECT_EQ(mesh.triangleMaterials, (std::vector<std::uint16_t>{0, 1, 2}))
        << "a face without an area and a double are gone";
}

/// A torus in three materials by the angle around it, and by which side of its tube: borders that meet, and closed ones.
SourceMesh paintedTorus()
{
    SourceMesh mesh = torus(48, 24);
    mesh.materials.resize(3);
    for (const auto& t : mesh.triangles) {
        const Eigen::Vector3d p = (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.0;
        mesh.triangleMaterials.push_back(p.z() > 0.0 ? 2 : p.x() > 0.0 ? 1 : 0);
    }
    return mesh;
}

/// Within a cell of the mesh, a 24th of the way around the tube.
void expectMaterialOfPlace(std::uint16_t material, const Eigen::Vector3d& p)
{
    constexpr double kCell = 0.05;
    EXPECT_TRUE(material == 2 ? p.z() > -kCell : p.z() < kCell) << material << " at " << p.transpose();
    if (material == 2) { return; }
    EXPECT_TRUE(material == 1 ? p.x() > -kCell : p.x() < kCell) << material << " at " << p.transpose();
}

TEST(Materials, EveryPatchHasOne)
{
    const SourceMesh source = paintedTorus();
    for (const std::size_t patches : {24U, 90U}) {
        ControlMeshOptions options;
        options.patches = patches;
        Progress progress;
        auto control = std::make_unique<ControlMesh>(source, options, progress);
        const ControlMesh& map = *control;
        std::array<std::size_t, 3> counts{};
        std::mt19937 random(5);
        for (std::uint32_t p = 0; p < map.topology().patches.size(); ++p) {
            ++counts[map.materialOf(p)];
            for (int k = 0; k < 200; ++k) {
                const FacePoint at = map.toSource({p, randomWeights(random)});
                EXPECT_EQ(source.materialOf(at.face), map.materialOf(p)) << "patch " << p << " of " << patches;
            }
        }
        for (const std::size_t count : counts) { EXPECT_GT(count, 0U); }
        const RefinedPatches refined(std::move(control), 4, 1e-4, progress);
        ASSERT_GT(refined.topology().patches.size(), patches) << "some are bisected";
        for (std::uint32_t p = 0; p < refined.topology().patches.size(); ++p) {
            for (int k = 0; k < 20; ++k) {
                expectMaterialOfPlace(refined.materialOf(p), refined.evaluate(p, randomWeights(random)).position);
            }
        }
    }
}

TEST(Materials, AreInTheAssetWhateverTheTechnique)
{
    for (const char* technique : {"strips", "uniform"}) {
        SourceMesh source = paintedTorus();
        source.name = "painted";
        source.materials[1].name = "east";
        BakeOptions options;
        options.maxFactor = 8;
        options.technique = technique;
        options.patchTolerance = 0.01;
        Progress progress;
        BakeReport report;
        const LodAsset asset = bakeMesh(std::move(source), options, progress, report);
        ASSERT_EQ(asset.materials.size(), 3U);
        EXPECT_EQ(asset.materials[1].name, "east");
        ASSERT_EQ(asset.patchMaterials.size(), asset.patches.size());
        const std::vector<std::uint32_t> slots = asset.levelSlots(2);
        for (std::size_t p = 0; p < asset.patches.size(); ++p) {
            if (slots[p] == kNoPatch) { continue; }
            for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(4); ++v) {
                const auto at = asset.position(
                    asset.patches[p], asset.levels[2].vertices[slots[p] * TessellationPattern::vertexCount(4) + v]);
                expectMaterialOfPlace(asset.patchMaterials[p], Eigen::Vector3f(at[0], at[1], at[2]).cast<double>());
            }
        }
    }
}

TEST(Images, AreEmbeddedOnceAndReferredToFromWhereTheAssetIs)
{
    const TemporaryDirectory folder;
    std::filesystem::create_directory(folder.file("a"));
    std::filesystem::create_directory(folder.file("b"));
    writeBytes(folder.file("a/x.png"), "first");
    writeBytes(folder.file("b/x.png"), "second");
    LodAsset asset;
    asset.materials.resize(2);
    asset.materials[0].textures = {{Role::Color, "map_kd", folder.file("a/x.png")},
                                   {Role::Other, "map_d", folder.file("lost.png")}};
    asset.materials[1].textures = {{Role::Color, "map_kd", folder.file("b/x.png")},
                                   {Role::Other, "map_d", folder.file("a/x.png")}};
    LodAsset linked = asset;
    moveReferences(linked, "", folder.file("b"));
    EXPECT_EQ(linked.materials[0].textures[0].image, "../a/x.png");
    EXPECT_EQ(linked.materials[1].textures[0].image, "x.png");
    moveReferences(linked, folder.file("b"), folder.file("a"));
    EXPECT_EQ(linked.materials[1].textures[0].image, "../b/x.png");

    embedImages(asset);
    ASSERT_EQ(asset.images.size(), 2U);
    EXPECT_EQ(asset.images[0], (LodImage{"x.png", {'f', 'i', 'r', 's', 't'}}));
    EXPECT_EQ(asset.images[1].name, "x_2.png");
    EXPECT_EQ(asset.imageOf(asset.materials[0].textures[0]), &asset.images[0]);
    EXPECT_EQ(asset.imageOf(asset.materials[1].textures[0]), &asset.images[1]);
    EXPECT_EQ(asset.imageOf(asset.materials[1].textures[1]), &asset.images[0]);
    EXPECT_EQ(asset.imageOf(asset.materials[0].textures[1]), nullptr);
    moveReferences(asset, "", folder.file("b"));
    EXPECT_EQ(asset.materials[0].textures[0].image, "x.png") << "what is in the asset is found everywhere";
    EXPECT_EQ(asset.materials[0].textures[1].image, "../lost.png");
}

} // namespace
} // namespace osgTessLOD::bake
