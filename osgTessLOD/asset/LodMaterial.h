// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace osgTessLOD {

/// An image that goes with a material, over the surface's texture coordinates.
struct LodTexture {
    enum class Role : std::uint8_t {
        Color,  ///< of the surface, what light is multiplied with
        Normal, ///< tangent space
        Other,  ///< kept for shaders of one's own
        ObjectNormal ///< (n + 1) / 2 of unit normals n along the asset's axes, which the surface is lit by
    };
    static constexpr std::uint32_t kRoles = 4;

    Role role = Role::Color;
    /// What the source says it is for, such as "map_Kd".
    std::string name;
    /// File relative to the folder of the asset's own, or the name of one of LodAsset::images.
    std::string image;

    bool operator==(const LodTexture& o) const { return role == o.role && name == o.name && image == o.image; }
};

/// How light is reflected, as OpenGL's fixed function takes it; 0 … 1.
struct LodReflectance {
    std::array<float, 4> ambient{0.2F, 0.2F, 0.2F, 1.0F};
    std::array<float, 4> diffuse{0.8F, 0.8F, 0.8F, 1.0F};
    std::array<float, 4> specular{0.0F, 0.0F, 0.0F, 1.0F};
    std::array<float, 4> emission{0.0F, 0.0F, 0.0F, 1.0F};
    float shininess = 0.0F; ///< 0 … 128

    bool operator==(const LodReflectance& o) const
    {
        return ambient == o.ambient && diffuse == o.diffuse && specular == o.specular && emission == o.emission &&
               shininess == o.shininess;
    }
};

/// What patches are shaded with. Neither reflectance nor textures: by the scene's state.
struct LodMaterial {
    std::string name;
    bool hasReflectance = false; ///< without: the scene's
    LodReflectance reflectance;
    std::vector<LodTexture> textures;

    bool operator==(const LodMaterial& o) const
    {
        return name == o.name && hasReflectance == o.hasReflectance && reflectance == o.reflectance &&
               textures == o.textures;
    }
};

/// The content of an image file in the asset.
struct LodImage {
    std::string name; ///< by which textures refer to it; its extension tells the format
    std::vector<std::uint8_t> bytes;

    bool operator==(const LodImage& o) const { return name == o.name && bytes == o.bytes; }
};

} // namespace osgTessLOD
