// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/MeshReader.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/MeshText.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>

namespace osgTessLOD::bake {

namespace {

/// Values that an option of a texture takes at most; those that may be left out are numbers.
const std::map<std::string_view, unsigned>& optionArguments()
{
    static const std::map<std::string_view, unsigned> arguments{
        {"-blendu", 1}, {"-blendv", 1}, {"-boost", 1}, {"-bm", 1}, {"-cc", 1},     {"-clamp", 1}, {"-imfchan", 1},
        {"-mm", 2},     {"-o", 3},      {"-s", 3},     {"-t", 3},  {"-texres", 1}, {"-type", 1},  {"-colorspace", 1}};
    return arguments;
}

/// Takes the options off the front of the rest of a texture's line; what is left is the image's name, blanks included.
std::string_view imageName(std::string_view rest)
{
    const auto trim = [&] {
        while (!rest.empty() && isBlank(rest.front())) { rest.remove_prefix(1); }
    };
    const auto drop = [&] {
        while (!rest.empty() && !isBlank(rest.front())) { rest.remove_prefix(1); }
        trim();
    };
    trim();
    while (!rest.empty() && rest.front() == '-') {
        const auto option = optionArguments().find(Cursor(rest).token());
        if (option == optionArguments().end()) { break; }
        drop();
        const bool isWord = option->second == 1;
        for (unsigned k = 0; k < option->second; ++k) {
            double number = 0.0;
            if (!isWord && k > 0 && !parseNumber(Cursor(rest).token(), number)) { break; }
            drop();
        }
    }
    return rest;
}

bool contains(const std::string& text, std::string_view part)
{
    return text.find(part) != std::string::npos;
}

LodTexture::Role roleOf(const std::string& keyword, const std::string& image)
{
    if (keyword == "map_kd") { return LodTexture::Role::Color; }
    if (keyword == "norm") { return LodTexture::Role::Normal; }
    const bool isBump = keyword == "map_bump" || keyword == "bump";
    const std::string name = lowerCase(image);
    return isBump && (contains(name, "norm") || contains(name, "nrm")) ? LodTexture::Role::Normal
                                                                       : LodTexture::Role::Other;
}

class MtlParser {
public:
    explicit MtlParser(const std::string& content)
        : _lines(content)
    {
    }

    std::vector<LodMaterial> parse()
    {
        while (!_lines.atEnd()) {
            const std::string_view line = _lines.line();
            parseLine(line.substr(0, line.find('#')));
        }
        finish();
        return std::move(_materials);
    }

private:
    void parseLine(std::string_view line)
    {
        while (!line.empty() && isBlank(line.back())) { line.remove_suffix(1); }
        Cursor words(line);
        const std::string keyword = lowerCase(words.token());
        const std::string_view rest = line.substr(words.position());
        if (keyword == "newmtl") {
            finish();
            _materials.emplace_back().name = std::string(imageName(rest));
            return;
        }
        if (_materials.empty()) { return; }
        LodReflectance& r = _materials.back().reflectance;
        if (keyword == "ka") {
            readColor(words, r.ambient);
        } else if (keyword == "kd") {
            _hasDiffuse = readColor(words, r.diffuse) || _hasDiffuse;
        } else if (keyword == "ks") {
            readColor(words, r.specular);
        } else if (keyword == "ke") {
            readColor(words, r.emission);
        } else if (keyword == "ns") {
            readNumber(words, 128.0, r.shininess);
        } else if (keyword == "d") {
            readNumber(words, 1.0, r.diffuse[3]);
        } else if (keyword == "tr") {
            if (readNumber(words, 1.0, r.diffuse[3])) { r.diffuse[3] = 1.0F - r.diffuse[3]; }
        } else if (keyword.rfind("map_", 0) == 0 || keyword == "bump" || keyword == "norm" || keyword == "disp") {
            addTexture(keyword, std::string(imageName(rest)));
        }
    }

    /// Of 0 … 1; one number is a grey. False where there is none: spectra and CIE colours.
    bool readColor(Cursor& words, std::array<float, 4>& color)
    {
        std::array<double, 3> channels{};
        if (!parseNumber(words.token(), channels[0])) { return false; }
        if (!parseNumber(words.token(), channels[1]) || !parseNumber(words.token(), channels[2])) {
            channels[1] = channels[2] = channels[0];
        }
        for (std::size_t k = 0; k < 3; ++k) { color[k] = limited(channels[k], 1.0); }
        _materials.back().hasReflectance = true;
        return true;
    }
    bool readNumber(Cursor& words, double most, float& value)
    {
        double number = 0.0;
        if (!parseNumber(words.token(), number)) { return false; }
        value = limited(number, most);
        _materials.back().hasReflectance = true;
        return true;
    }
    static float limited(double number, double most)
    {
        return number > 0.0 ? static_cast<float>(std::min(number, most)) : 0.0F; // NaN becomes 0
    }

    void addTexture(const std::string& keyword, std::string image)
    {
        if (image.empty()) { return; }
        std::replace(image.begin(), image.end(), '\\', '/');
        const LodTexture::Role role = roleOf(keyword, image);
        _materials.back().textures.push_back({role, keyword, std::move(image)});
    }

    void finish()
    {
        if (_materials.empty()) { return; }
        LodMaterial& material = _materials.back();
        const bool isTextured = std::any_of(material.textures.begin(), material.textures.end(),
                                            [](const LodTexture& t) { return t.role == LodTexture::Role::Color; });
        if (isTextured && !_hasDiffuse) { std::fill_n(material.reflectance.diffuse.begin(), 3, 1.0F); }
        _hasDiffuse = false;
    }

    Cursor _lines;
    std::vector<LodMaterial> _materials;
    bool _hasDiffuse = false;
};

} // namespace

std::vector<LodMaterial> parseMtl(const std::string& content)
{
    return MtlParser(content).parse();
}

} // namespace osgTessLOD::bake
