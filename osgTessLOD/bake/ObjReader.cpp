// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/MeshReader.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/bake/MeshText.h>

#include <map>

namespace osgTessLOD::bake {

namespace {

/// Lines of an OBJ file: comments removed, lines ending in a backslash joined with the next.
class ObjLines {
public:
    explicit ObjLines(const std::string& content)
        : _lines(content)
    {
    }

    bool next(std::string_view& line)
    {
        if (_lines.atEnd()) { return false; }
        line = stripped(_lines.line());
        ++_number;
        if (line.empty() || line.back() != '\\') { return true; }
        _joined.clear();
        while (!line.empty() && line.back() == '\\') {
            _joined.append(line.substr(0, line.size() - 1)).push_back(' ');
            if (_lines.atEnd()) {
                line = {};
                break;
            }
            line = stripped(_lines.line());
            ++_number;
        }
        _joined.append(line);
        line = _joined;
        return true;
    }
    std::string where() const { return "line " + std::to_string(_number); }

private:
    static std::string_view stripped(std::string_view line)
    {
        line = line.substr(0, line.find('#'));
        while (!line.empty() && isBlank(line.back())) { line.remove_suffix(1); }
        return line;
    }

    Cursor _lines;
    std::uint64_t _number = 0;
    std::string _joined;
};

/// Part of a corner "v", "v/vt", "v//vn" or "v/vt/vn" → its number counted from 0; −1 when it is not one. A negative one counts
/// back from those so far; a positive one may refer to what follows.
std::int64_t objIndex(std::string_view part, std::size_t soFar)
{
    std::int64_t index = 0;
    if (!parseInteger(part, index)) { return -1; }
    return index > 0 ? index - 1 : index < 0 ? static_cast<std::int64_t>(soFar) + index : -1;
}

/// The vt of a corner, empty if it has none.
std::string_view uvPart(std::string_view corner)
{
    const std::size_t slash = corner.find('/');
    if (slash == corner.npos) { return {}; }
    const std::string_view rest = corner.substr(slash + 1);
    return rest.substr(0, rest.find('/'));
}

class ObjParser {
public:
    explicit ObjParser(const std::string& content)
        : _lines(content)
    {
    }

    RawMesh parse()
    {
        for (std::string_view line; _lines.next(line);) {
            Cursor words(line);
            const std::string_view keyword = words.token();
            if (keyword == "v") {
                addVertex(words);
            } else if (keyword == "vt") {
                addUv(words);
            } else if (keyword == "f") {
                addFace(words);
            } else if (keyword == "usemtl") {
                useMaterial(line.substr(words.position()));
            } else if (keyword == "mtllib") {
                for (auto file = words.token(); !file.empty(); file = words.token()) { _mesh.materialFiles.emplace_back(file); }
            }
        }
        if (_mesh.positions.size() > kMaxElements) { throw AssetError("more than 2^32 vertices"); }
        _vertices.check("vertex", _mesh.positions.size());
        if (_mesh.uvs.empty()) { _mesh.uvTriangles.clear(); } // left out of the file, whatever its faces say
        if (_mesh.uvTriangles.empty()) { _mesh.uvs.clear(); }
        if (!_mesh.uvs.empty()) { _uvs.check("texture coordinates", _mesh.uvs.size()); }
        return std::move(_mesh);
    }

private:
    /// The largest number referred to, and where.
    struct Largest {
        std::int64_t index = -1;
        std::string where;

        void check(const char* what, std::size_t count) const
        {
            if (index < static_cast<std::int64_t>(count)) { return; }
            throw AssetError(where + " refers to " + what + " " + std::to_string(index + 1) + ", but there are only " +
                             std::to_string(count));
        }
    };

    void addVertex(Cursor& words)
    {
        Eigen::Vector3d position;
        if (!parsePosition(words, position)) {
            throw AssetError(_lines.where() + ": vertex " + std::to_string(_mesh.positions.size() + 1) +
                             " has not three coordinates");
        }
        std::array<double, 3> rgb{};
        const bool hasColor = parseNumber(words.token(), rgb[0]) && parseNumber(words.token(), rgb[1]) &&
                              parseNumber(words.token(), rgb[2]);
        if (hasColor || !_mesh.colors.empty()) {
            _mesh.colors.resize(_mesh.positions.size() + 1, kWhite);
            if (hasColor) { _mesh.colors.back() = {colorByte(rgb[0]), colorByte(rgb[1]), colorByte(rgb[2]), 255}; }
        }
        _mesh.positions.push_back(position);
    }

    void addUv(Cursor& words)
    {
        double u = 0.0;
        double v = 0.0; // may be left out
        if (!parseNumber(words.token(), u)) {
            throw AssetError(_lines.where() + ": texture coordinates " + std::to_string(_mesh.uvs.size() + 1) +
                             " are no numbers");
        }
        const std::string_view second = words.token();
        if (!second.empty() && !parseNumber(second, v)) {
            throw AssetError(_lines.where() + ": texture coordinates " + std::to_string(_mesh.uvs.size() + 1) +
                             " are no numbers");
        }
        _mesh.uvs.emplace_back(static_cast<float>(u), static_cast<float>(v));
    }

    /// Faces before the first usemtl have a material without name.
    void useMaterial(std::string_view name)
    {
        while (!name.empty() && isBlank(name.front())) { name.remove_prefix(1); }
        std::vector<std::string>& materials = _mesh.materials;
        if (materials.empty() && !_mesh.triangles.empty()) {
            materials.emplace_back();
            _mesh.triangleMaterials.resize(_mesh.triangles.size(), 0);
        }
        const auto [known, isNew] = _materials.emplace(std::string(name), materials.size());
        if (isNew) {
            if (materials.size() == LodAsset::kMaxMaterials) {
                throw AssetError(_lines.where() + ": more than " + std::to_string(LodAsset::kMaxMaterials) + " materials");
            }
            materials.emplace_back(name);
        }
        _mesh.material = static_cast<std::uint16_t>(known->second);
    }

    std::uint32_t reference(std::string_view token, std::string_view part, std::size_t soFar, const char* what,
                            Largest& largest) const
    {
        const std::int64_t index = objIndex(part, soFar);
        const auto here = [&] { return _lines.where() + ": face " + std::to_string(_faceCount); };
        if (index < 0 || static_cast<std::uint64_t>(index) >= kMaxElements) {
            throw AssetError(here() + " refers to " + what + " " + quoted(token) + ", which does not exist");
        }
        if (index > largest.index) { largest = {index, here()}; }
        return static_cast<std::uint32_t>(index);
    }

    void addFace(Cursor& words)
    {
        ++_faceCount;
        _corners.clear();
        _uvCorners.clear();
        for (std::string_view token = words.token(); !token.empty(); token = words.token()) {
            const std::string_view vertex = token.substr(0, token.find('/'));
            _corners.push_back(reference(token, vertex, _mesh.positions.size(), "vertex", _vertices));
            const std::string_view uv = uvPart(token);
            if (uv.empty()) { continue; }
            _uvCorners.push_back(reference(token, uv, _mesh.uvs.size(), "texture coordinates", _uvs));
        }
        if (_uvCorners.size() != _corners.size()) { _uvCorners.clear(); } // all corners or none
        _mesh.addPolygon(_corners, _uvCorners);
    }

    static constexpr Rgba kWhite{255, 255, 255, 255};

    ObjLines _lines;
    RawMesh _mesh;
    std::uint64_t _faceCount = 0;
    Largest _vertices;
    Largest _uvs;
    std::map<std::string, std::size_t> _materials; ///< number by name
    std::vector<std::uint32_t> _corners;
    std::vector<std::uint32_t> _uvCorners;
};

} // namespace

RawMesh parseObj(const std::string& content)
{
    return ObjParser(content).parse();
}

} // namespace osgTessLOD::bake
