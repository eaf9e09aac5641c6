// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/MaterialState.h>

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/Image>
#include <osg/Material>
#include <osg/StateSet>
#include <osg/Texture2D>
#include <osg/Uniform>
#include <osgDB/FileNameUtils>
#include <osgDB/ReadFile>
#include <osgDB/Registry>

#include <map>
#include <sstream>

namespace osgTessLOD {

namespace {

constexpr unsigned kColorUnit = 0;
constexpr unsigned kNormalUnit = 1;
constexpr unsigned kUnits = 8; ///< those above are the surface's own
constexpr unsigned kObjectNormalUnit = 9; ///< below those of AssetPages

/// The textures of an asset's images, each made once.
class ImageTextures {
public:
    ImageTextures(const LodAsset& asset, std::string folder, const osgDB::Options* options)
        : _asset(asset)
        , _folder(std::move(folder))
        , _options(options)
    {
    }

    /// Null, after a warning, if it cannot be read.
    osg::ref_ptr<osg::Texture2D> textureOf(const LodTexture& texture)
    {
        const auto [known, isNew] = _textures.emplace(texture.image, nullptr);
        if (!isNew) { return known->second; }
        const LodImage* embedded = _asset.imageOf(texture);
        const osg::ref_ptr<osg::Image> image = embedded != nullptr ? decode(*embedded) : readFile(texture.image);
        if (!image) {
            OSG_WARN << "osgTessLOD: " << _asset.source << ": its image " << texture.image << " cannot be read"
                     << std::endl;
            return nullptr;
        }
        known->second = new osg::Texture2D(image);
        known->second->setWrap(osg::Texture::WRAP_S, osg::Texture::REPEAT);
        known->second->setWrap(osg::Texture::WRAP_T, osg::Texture::REPEAT);
        return known->second;
    }

private:
    osg::ref_ptr<osg::Image> readFile(const std::string& name) const
    {
        return osgDB::readRefImageFile(_folder.empty() ? name : osgDB::concatPaths(_folder, name), _options);
    }
    osg::ref_ptr<osg::Image> decode(const LodImage& image) const
    {
        osgDB::ReaderWriter* reader =
            osgDB::Registry::instance()->getReaderWriterForExtension(osgDB::getLowerCaseFileExtension(image.name));
        if (reader == nullptr) { return nullptr; }
        std::istringstream stream(std::string(image.bytes.begin(), image.bytes.end()), std::ios::in | std::ios::binary);
        return reader->readImage(stream, _options).getImage();
    }

    const LodAsset& _asset;
    std::string _folder;
    const osgDB::Options* _options;
    std::map<std::string, osg::ref_ptr<osg::Texture2D>> _textures; ///< by name of the image
};

osg::Vec4 vec4(const std::array<float, 4>& color)
{
    return {color[0], color[1], color[2], color[3]};
}

void addReflectance(const LodReflectance& reflectance, osg::StateSet& state)
{
    constexpr osg::Material::Face kBoth = osg::Material::FRONT_AND_BACK;
    const osg::ref_ptr<osg::Material> material = new osg::Material;
    const float alpha = reflectance.diffuse[3];
    material->setAmbient(kBoth,
                         osg::Vec4(reflectance.ambient[0], reflectance.ambient[1], reflectance.ambient[2], alpha));
    material->setDiffuse(kBoth, vec4(reflectance.diffuse));
    material->setSpecular(kBoth, vec4(reflectance.specular));
    material->setEmission(kBoth, vec4(reflectance.emission));
    material->setShininess(kBoth, reflectance.shininess);
    state.setAttribute(material);
    if (alpha >= 1.0F) { return; }
    state.setMode(GL_BLEND, osg::StateAttribute::ON);
    state.setRenderingHint(osg::StateSet::TRANSPARENT_BIN);
}

/// What the surface's shaders light it by.
void addNormalMap(osg::Texture2D* map, const UvLattice& uvs, osg::StateSet& state)
{
    if (map == nullptr) { return; }
    map->setInternalFormatMode(osg::Texture::USE_USER_DEFINED_FORMAT);
    map->setInternalFormat(GL_RGB10_A2); // a tenth of a degree, in the bytes of eight bits a channel
    for (const std::size_t axis : {0U, 1U}) { // what is at one border is next to the other only where the image repeats
        const float largest = uvs.origin[axis] + uvs.step[axis] * static_cast<float>(UvLattice::kUnits);
        map->setWrap(axis == 0 ? osg::Texture::WRAP_S : osg::Texture::WRAP_T,
                     uvs.origin[axis] < 0.0F || largest > 1.0F ? osg::Texture::REPEAT : osg::Texture::CLAMP_TO_EDGE);
    }
    map->setResizeNonPowerOfTwoHint(false);
    map->setMaxAnisotropy(4.0F);
    state.setTextureAttribute(kObjectNormalUnit, map);
    state.addUniform(new osg::Uniform("tessLodNormalMap", static_cast<int>(kObjectNormalUnit)));
    state.setDefine("TESSLOD_NORMAL_MAP");
}

void addTextures(const LodAsset& asset, const LodMaterial& material, ImageTextures& textures, osg::StateSet& state)
{
    unsigned other = kNormalUnit + 1;
    for (const LodTexture& texture : material.textures) {
        if (texture.role == LodTexture::Role::ObjectNormal) {
            if (asset.hasUvs()) { addNormalMap(textures.textureOf(texture).get(), asset.uvLattice, state); }
            continue;
        }
        const unsigned unit = texture.role == LodTexture::Role::Color    ? kColorUnit
                              : texture.role == LodTexture::Role::Normal ? kNormalUnit
                                                                         : other++;
        if (unit >= kUnits || state.getTextureAttribute(unit, osg::StateAttribute::TEXTURE) != nullptr) { continue; }
        const osg::ref_ptr<osg::Texture2D> made = textures.textureOf(texture);
        if (!made) { continue; }
        // Only the colour is a texture to fixed function; shaders of one's own find the others on their units.
        if (unit == kColorUnit) {
            state.setTextureAttributeAndModes(unit, made);
        } else {
            state.setTextureAttribute(unit, made);
        }
    }
}

} // namespace

void addMaterialStates(TessLODDrawable& drawable, const std::string& folder, const osgDB::Options* options,
                       bool hasImages)
{
    if (drawable.getGpuAsset() == nullptr) { return; }
    const LodAsset& asset = drawable.getGpuAsset()->asset();
    ImageTextures textures(asset, folder, options);
    for (std::size_t m = 0; m < asset.materials.size(); ++m) {
        const LodMaterial& material = asset.materials[m];
        const osg::ref_ptr<osg::StateSet> state = new osg::StateSet;
        state->setName(material.name);
        if (material.hasReflectance) { addReflectance(material.reflectance, *state); }
        if (hasImages) { addTextures(asset, material, textures, *state); }
        drawable.setMaterialState(m, state);
    }
}

} // namespace osgTessLOD
