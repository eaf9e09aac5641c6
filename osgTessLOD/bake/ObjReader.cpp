// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/MeshReader.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/MeshText.h>

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

/// Corner "v", "v/vt", "v//vn" or "v/vt/vn" → v counted from 0; −1 when it is not one. A negative v counts back from the
/// vertices so far; a positive one may refer to a vertex that follows.
std::int64_t objCorner(std::string_view token, std::size_t verticesSoFar)
{
    std::int64_t index = 0;
    if (!parseInteger(token.substr(0, token.find('/')), index)) { return -1; }
    return index > 0 ? index - 1 : index < 0 ? static_cast<std::int64_t>(verticesSoFar) + index : -1;
}

} // namespace

RawMesh parseObj(const std::string& content)
{
    RawMesh mesh;
    ObjLines lines(content);
    std::uint64_t faceCount = 0;
    std::int64_t largestIndex = -1;
    std::string largestWhere;
    std::vector<std::uint32_t> corners;
    for (std::string_view line; lines.next(line);) {
        Cursor words(line);
        const std::string_view keyword = words.token();
        if (keyword == "v") {
            Eigen::Vector3d position;
            if (!parsePosition(words, position)) {
                throw AssetError(lines.where() + ": vertex " + std::to_string(mesh.positions.size() + 1) +
                                 " has not three coordinates");
            }
            mesh.positions.push_back(position);
        } else if (keyword == "f") {
            ++faceCount;
            corners.clear();
            for (std::string_view token = words.token(); !token.empty(); token = words.token()) {
                const std::int64_t index = objCorner(token, mesh.positions.size());
                if (index < 0 || static_cast<std::uint64_t>(index) >= kMaxElements) {
                    throw AssetError(lines.where() + ": face " + std::to_string(faceCount) + " refers to vertex " +
                                     quoted(token) + ", which does not exist");
                }
                if (index > largestIndex) {
                    largestIndex = index;
                    largestWhere = lines.where() + ": face " + std::to_string(faceCount);
                }
                corners.push_back(static_cast<std::uint32_t>(index));
            }
            mesh.addPolygon(corners);
        }
    }
    if (mesh.positions.size() > kMaxElements) { throw AssetError("more than 2^32 vertices"); }
    if (largestIndex >= static_cast<std::int64_t>(mesh.positions.size())) {
        throw AssetError(largestWhere + " refers to vertex " + std::to_string(largestIndex + 1) +
                         ", but there are only " + std::to_string(mesh.positions.size()));
    }
    return mesh;
}

} // namespace osgTessLOD::bake
