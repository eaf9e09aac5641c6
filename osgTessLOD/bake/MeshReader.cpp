// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/MeshReader.h>

#include <osgTessLOD/asset/AssetError.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <string_view>
#include <utility>

namespace osgTessLOD::bake {

namespace {

constexpr std::uint64_t kMaxElements = 0xFFFFFFFEU;

bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }
bool isSpace(char c) { return isBlank(c) || c == '\n'; }

std::string lowerCase(std::string_view text)
{
    std::string lower(text);
    for (char& c : lower) {
        if (c >= 'A' && c <= 'Z') { c = static_cast<char>(c - 'A' + 'a'); }
    }
    return lower;
}

/// At most a few printable characters of the file, for messages.
std::string quoted(std::string_view text)
{
    std::string out = "'";
    for (const char c : text.substr(0, 24)) { out += c >= ' ' && c <= '~' ? c : '?'; }
    return out + (text.size() > 24 ? "…'" : "'");
}

/// Takes tokens off the front of a text.
class Cursor {
public:
    explicit Cursor(std::string_view text) : _text(text) {}

    /// The next token separated by white space, line ends included; empty at the end.
    std::string_view token()
    {
        while (_at < _text.size() && isSpace(_text[_at])) { ++_at; }
        return rest([](char c) { return isSpace(c); });
    }
    /// The next line without its end (\n, \r\n or \r); call only while !atEnd().
    std::string_view line()
    {
        const std::string_view result = rest([](char c) { return c == '\n' || c == '\r'; });
        if (_at < _text.size() && _text[_at++] == '\r' && _at < _text.size() && _text[_at] == '\n') { ++_at; }
        return result;
    }
    bool atEnd() const { return _at >= _text.size(); }
    std::size_t position() const { return _at; }
    std::size_t remaining() const { return _text.size() - _at; }

private:
    template <typename Ends>
    std::string_view rest(Ends ends)
    {
        const std::size_t begin = _at;
        while (_at < _text.size() && !ends(_text[_at])) { ++_at; }
        return _text.substr(begin, _at - begin);
    }

    std::string_view _text;
    std::size_t _at = 0;
};

/// Parses all of `token`; out of double's range gives infinity or zero. "nan" and "inf" are numbers here.
bool parseNumber(std::string_view token, double& value)
{
    if (!token.empty() && token.front() == '+') { token.remove_prefix(1); }
    const char* end = token.data() + token.size();
    const auto result = std::from_chars(token.data(), end, value);
    if (result.ec == std::errc::result_out_of_range) {
        const bool tiny = token.find("e-") != token.npos || token.find("E-") != token.npos;
        value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
        return result.ptr == end;
    }
    return result.ec == std::errc() && result.ptr == end;
}

bool parseInteger(std::string_view token, std::int64_t& value)
{
    if (!token.empty() && token.front() == '+') { token.remove_prefix(1); }
    const char* end = token.data() + token.size();
    const auto result = std::from_chars(token.data(), end, value);
    return result.ec == std::errc() && result.ptr == end;
}

/// A vertex reference of face `face` in a file of `vertexCount` vertices, counted from 0.
std::uint32_t checkedIndex(std::int64_t index, std::uint64_t vertexCount, std::uint64_t face)
{
    if (index < 0 || static_cast<std::uint64_t>(index) >= vertexCount) {
        throw AssetError("face " + std::to_string(face) + " refers to vertex " + std::to_string(index) +
                         ", but there are only " + std::to_string(vertexCount) + " (counted from 0)");
    }
    return static_cast<std::uint32_t>(index);
}

void requireCountFits(const std::string& what, std::uint64_t count, std::uint64_t bytesEach, std::uint64_t bytesLeft)
{
    if (count > kMaxElements) { throw AssetError("declares " + std::to_string(count) + " " + what + ": too many"); }
    if (bytesEach != 0 && count > bytesLeft / bytesEach) {
        throw AssetError("truncated: declares " + std::to_string(count) + " " + what + ", more than the file can hold");
    }
}

} // namespace

void RawMesh::addPolygon(const std::vector<std::uint32_t>& corners)
{
    if (corners.empty()) { return; }
    if (triangles.size() + corners.size() > kMaxElements) { throw AssetError("more than 2^32 triangles"); }
    if (corners.size() < 3) {
        triangles.push_back({corners.front(), corners.back(), corners.back()});
        return;
    }
    if (corners.size() == 4) { quads.push_back(static_cast<std::uint32_t>(triangles.size())); }
    for (std::size_t i = 2; i < corners.size(); ++i) { triangles.push_back({corners[0], corners[i - 1], corners[i]}); }
}

// ---------------------------------------------------------------------------------------------------------- PLY ---

namespace {

enum class PlyType : std::uint8_t { None, Int8, Uint8, Int16, Uint16, Int32, Uint32, Float32, Float64 };

struct PlyProperty {
    std::string name;
    PlyType countType = PlyType::None; ///< of a list, else None
    PlyType type = PlyType::None;
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;
};

struct PlyHeader {
    enum class Format { Ascii, LittleEndian, BigEndian };
    Format format = Format::Ascii;
    std::vector<PlyElement> elements;
    std::size_t bytes = 0;
};

PlyType plyType(std::string_view name)
{
    static constexpr std::array<std::pair<std::string_view, PlyType>, 16> kNames{{
        {"char", PlyType::Int8}, {"int8", PlyType::Int8}, {"uchar", PlyType::Uint8}, {"uint8", PlyType::Uint8},
        {"short", PlyType::Int16}, {"int16", PlyType::Int16}, {"ushort", PlyType::Uint16}, {"uint16", PlyType::Uint16},
        {"int", PlyType::Int32}, {"int32", PlyType::Int32}, {"uint", PlyType::Uint32}, {"uint32", PlyType::Uint32},
        {"float", PlyType::Float32}, {"float32", PlyType::Float32}, {"double", PlyType::Float64},
        {"float64", PlyType::Float64}}};
    for (const auto& [known, type] : kNames) {
        if (name == known) { return type; }
    }
    throw AssetError("PLY header: unknown type " + quoted(name));
}

std::size_t plyBytes(PlyType type)
{
    switch (type) {
    case PlyType::None: return 0;
    case PlyType::Int8: case PlyType::Uint8: return 1;
    case PlyType::Int16: case PlyType::Uint16: return 2;
    case PlyType::Int32: case PlyType::Uint32: case PlyType::Float32: return 4;
    case PlyType::Float64: return 8;
    }
    return 0;
}

PlyProperty plyProperty(Cursor& words)
{
    PlyProperty property;
    std::string_view type = words.token();
    if (type == "list") {
        property.countType = plyType(words.token());
        if (property.countType >= PlyType::Float32) { throw AssetError("PLY header: a list's length is not an integer"); }
        type = words.token();
    }
    property.type = plyType(type);
    property.name = words.token();
    return property;
}

PlyHeader::Format plyFormat(std::string_view name)
{
    if (name == "ascii") { return PlyHeader::Format::Ascii; }
    if (name == "binary_little_endian") { return PlyHeader::Format::LittleEndian; }
    if (name == "binary_big_endian") { return PlyHeader::Format::BigEndian; }
    throw AssetError("PLY header: unknown format " + quoted(name));
}

PlyElement plyElement(Cursor& words)
{
    PlyElement element;
    element.name = words.token();
    std::int64_t count = 0;
    const std::string_view number = words.token();
    if (!parseInteger(number, count) || count < 0) {
        throw AssetError("PLY header: bad number of elements " + quoted(number));
    }
    element.count = static_cast<std::uint64_t>(count);
    return element;
}

PlyHeader parsePlyHeader(const std::string& content)
{
    Cursor lines(content);
    if (lines.atEnd() || Cursor(lines.line()).token() != "ply") { throw AssetError("not a PLY file"); }
    PlyHeader header;
    bool hasFormat = false;
    while (!lines.atEnd()) {
        Cursor words(lines.line());
        const std::string_view keyword = words.token();
        if (keyword == "end_header") {
            if (!hasFormat) { throw AssetError("PLY header: no format"); }
            header.bytes = lines.position();
            return header;
        }
        if (keyword == "format") {
            header.format = plyFormat(words.token());
            hasFormat = true;
        } else if (keyword == "element") {
            header.elements.push_back(plyElement(words));
        } else if (keyword == "property") {
            if (header.elements.empty()) { throw AssetError("PLY header: property before any element"); }
            header.elements.back().properties.push_back(plyProperty(words));
        } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
            throw AssetError("PLY header: unknown keyword " + quoted(keyword));
        }
    }
    throw AssetError("truncated: the PLY header does not end");
}

/// Values of an ASCII body.
class PlyTextValues {
public:
    PlyTextValues(const std::string& content, const PlyHeader& header)
        : _cursor(std::string_view(content).substr(header.bytes)) {}
    static std::size_t leastBytes(PlyType type) { return type == PlyType::None ? 0 : 2; } // a digit and a separator
    std::size_t remaining() const { return _cursor.remaining() + 1; } // the last separator may be missing

    double real(PlyType)
    {
        const std::string_view token = next();
        double value = 0.0;
        if (!parseNumber(token, value)) { throw AssetError(quoted(token) + " is not a number"); }
        return value;
    }
    std::int64_t integer(PlyType)
    {
        const std::string_view token = next();
        std::int64_t value = 0;
        if (!parseInteger(token, value)) { throw AssetError(quoted(token) + " is not an integer"); }
        return value;
    }

private:
    std::string_view next()
    {
        const std::string_view token = _cursor.token();
        if (token.empty()) { throw AssetError("truncated"); }
        return token;
    }

    Cursor _cursor;
};

/// Values of a binary body.
class PlyBinaryValues {
public:
    PlyBinaryValues(const std::string& content, const PlyHeader& header)
        : _next(content.data() + header.bytes), _end(content.data() + content.size()),
          _swap((header.format == PlyHeader::Format::BigEndian) != kHostIsBigEndian) {}
    static std::size_t leastBytes(PlyType type) { return plyBytes(type); }
    std::size_t remaining() const { return static_cast<std::size_t>(_end - _next); }

    double real(PlyType type)
    {
        if (type == PlyType::Float32) { return static_cast<double>(take<float>()); }
        if (type == PlyType::Float64) { return take<double>(); }
        return static_cast<double>(integer(type));
    }
    std::int64_t integer(PlyType type)
    {
        switch (type) {
        case PlyType::Int8: return take<std::int8_t>();
        case PlyType::Uint8: return take<std::uint8_t>();
        case PlyType::Int16: return take<std::int16_t>();
        case PlyType::Uint16: return take<std::uint16_t>();
        case PlyType::Int32: return take<std::int32_t>();
        case PlyType::Uint32: return take<std::uint32_t>();
        default: throw AssetError("a floating point number where an integer is needed");
        }
    }

private:
    static constexpr bool kHostIsBigEndian = __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__;

    template <typename T>
    T take()
    {
        if (remaining() < sizeof(T)) { throw AssetError("truncated"); }
        std::array<char, sizeof(T)> bytes;
        std::memcpy(bytes.data(), _next, sizeof(T));
        if (_swap) { std::reverse(bytes.begin(), bytes.end()); }
        _next += sizeof(T);
        T value;
        std::memcpy(&value, bytes.data(), sizeof(T));
        return value;
    }

    const char* _next;
    const char* _end;
    bool _swap;
};

/// Length of a list whose items follow.
template <typename Values>
std::uint64_t listLength(Values& values, const PlyProperty& property)
{
    const std::int64_t length = values.integer(property.countType);
    if (length < 0) { throw AssetError("a list of negative length"); }
    requireCountFits("list items", static_cast<std::uint64_t>(length), Values::leastBytes(property.type),
                     values.remaining());
    return static_cast<std::uint64_t>(length);
}

template <typename Values>
void skipProperty(Values& values, const PlyProperty& property)
{
    const std::uint64_t items = property.countType == PlyType::None ? 1 : listLength(values, property);
    for (std::uint64_t i = 0; i < items; ++i) { values.real(property.type); }
}

template <typename Values>
void readPlyVertices(Values& values, const PlyElement& element, RawMesh& mesh)
{
    std::vector<int> axes; // which coordinate each property is, −1 for none
    std::array<bool, 3> found{};
    for (const PlyProperty& p : element.properties) {
        const bool isAxis = p.countType == PlyType::None && p.name.size() == 1 && p.name[0] >= 'x' && p.name[0] <= 'z';
        axes.push_back(isAxis ? p.name[0] - 'x' : -1);
        if (isAxis) { found[static_cast<std::size_t>(axes.back())] = true; }
    }
    if (!(found[0] && found[1] && found[2])) { throw AssetError("PLY header: vertices without x, y and z"); }
    mesh.positions.resize(element.count, Eigen::Vector3d::Zero());
    for (Eigen::Vector3d& position : mesh.positions) {
        for (std::size_t i = 0; i < axes.size(); ++i) {
            const PlyProperty& property = element.properties[i];
            if (axes[i] < 0) { skipProperty(values, property); }
            else { position[axes[i]] = values.real(property.type); }
        }
    }
}

template <typename Values>
void readPlyFaces(Values& values, const PlyElement& element, std::uint64_t vertexCount, RawMesh& mesh)
{
    const auto isIndices = [](const PlyProperty& p) {
        return p.countType != PlyType::None && (p.name == "vertex_indices" || p.name == "vertex_index");
    };
    if (std::none_of(element.properties.begin(), element.properties.end(), isIndices)) {
        throw AssetError("PLY header: faces without vertex_indices");
    }
    mesh.triangles.reserve(element.count);
    std::vector<std::uint32_t> corners;
    for (std::uint64_t face = 0; face < element.count; ++face) {
        corners.clear();
        for (const PlyProperty& property : element.properties) {
            if (!isIndices(property)) {
                skipProperty(values, property);
                continue;
            }
            corners.resize(listLength(values, property));
            for (std::uint32_t& corner : corners) {
                corner = checkedIndex(values.integer(property.type), vertexCount, face);
            }
        }
        mesh.addPolygon(corners);
    }
}

template <typename Values>
RawMesh readPlyBody(Values values, const PlyHeader& header)
{
    RawMesh mesh;
    std::uint64_t vertexCount = 0;
    for (const PlyElement& element : header.elements) {
        if (element.name == "vertex") { vertexCount = element.count; }
        if (element.name == "tristrips") { throw AssetError("PLY triangle strips are not supported"); }
    }
    for (const PlyElement& element : header.elements) {
        std::size_t bytesEach = 0;
        for (const PlyProperty& p : element.properties) {
            bytesEach += Values::leastBytes(p.countType != PlyType::None ? p.countType : p.type);
        }
        requireCountFits("elements " + quoted(element.name), element.count, bytesEach, values.remaining());
        if (element.count == 0 || element.properties.empty()) { continue; }
        if (element.name == "vertex") {
            readPlyVertices(values, element, mesh);
        } else if (element.name == "face") {
            readPlyFaces(values, element, vertexCount, mesh);
        } else {
            for (std::uint64_t i = 0; i < element.count; ++i) {
                for (const PlyProperty& property : element.properties) { skipProperty(values, property); }
            }
        }
    }
    return mesh;
}

} // namespace

RawMesh parsePly(const std::string& content)
{
    const PlyHeader header = parsePlyHeader(content);
    return header.format == PlyHeader::Format::Ascii ? readPlyBody(PlyTextValues(content, header), header)
                                                     : readPlyBody(PlyBinaryValues(content, header), header);
}

// ---------------------------------------------------------------------------------------------------------- OBJ ---

namespace {

/// Lines of an OBJ file: comments removed, lines ending in a backslash joined with the next.
class ObjLines {
public:
    explicit ObjLines(const std::string& content) : _lines(content) {}

    bool next(std::string_view& line)
    {
        if (_lines.atEnd()) { return false; }
        line = stripped(_lines.line());
        ++_number;
        if (line.empty() || line.back() != '\\') { return true; }
        _joined.clear();
        while (!line.empty() && line.back() == '\\') {
            _joined.append(line.substr(0, line.size() - 1)).push_back(' ');
            if (_lines.atEnd()) { line = {}; break; }
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

/// The three numbers of a vertex, further ones (weight, colour) left alone. False when they are not there.
bool parsePosition(Cursor& words, Eigen::Vector3d& position)
{
    return parseNumber(words.token(), position[0]) && parseNumber(words.token(), position[1]) &&
           parseNumber(words.token(), position[2]);
}

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
        throw AssetError(largestWhere + " refers to vertex " + std::to_string(largestIndex + 1) + ", but there are only " +
                         std::to_string(mesh.positions.size()));
    }
    return mesh;
}

// ---------------------------------------------------------------------------------------------------------- OFF ---

namespace {

/// The next line that holds more than blanks and a comment.
std::string_view offLine(Cursor& lines)
{
    while (!lines.atEnd()) {
        std::string_view line = lines.line();
        line = line.substr(0, line.find('#'));
        if (std::any_of(line.begin(), line.end(), [](char c) { return !isSpace(c); })) { return line; }
    }
    throw AssetError("truncated");
}

/// Reads the keyword and the counts of vertices and faces (the number of edges may be left out).
std::array<std::uint64_t, 2> parseOffHeader(Cursor& lines)
{
    std::string_view line = offLine(lines);
    Cursor words(line);
    std::string_view token = words.token();
    std::int64_t ignored = 0;
    if (!parseInteger(token, ignored)) { // the keyword, which the format lets one leave out
        if (token.size() < 3 || token.substr(token.size() - 3) != "OFF") { throw AssetError("not an OFF file"); }
        if (token.find('4') != token.npos || token.find('n') != token.npos) {
            throw AssetError("OFF with other than three dimensions (" + std::string(token.substr(0, 8)) +
                             ") is not supported");
        }
        token = words.token();
        if (lowerCase(token) == "binary") { throw AssetError("binary OFF is not supported"); }
        if (token.empty()) {
            words = Cursor(offLine(lines));
            token = words.token();
        }
    }
    std::array<std::uint64_t, 2> counts{};
    for (std::uint64_t& count : counts) {
        std::int64_t value = 0;
        if (!parseInteger(token, value) || value < 0) { throw AssetError("OFF header: bad count " + quoted(token)); }
        count = static_cast<std::uint64_t>(value);
        token = words.token();
    }
    return counts;
}

} // namespace

RawMesh parseOff(const std::string& content)
{
    Cursor lines(content);
    const auto [vertexCount, faceCount] = parseOffHeader(lines);
    requireCountFits("vertices", vertexCount, 6, lines.remaining() + 1); // "0 0 0\n"
    RawMesh mesh;
    mesh.positions.resize(vertexCount);
    for (std::size_t v = 0; v < vertexCount; ++v) {
        Cursor words(offLine(lines));
        if (!parsePosition(words, mesh.positions[v])) {
            throw AssetError("vertex " + std::to_string(v) + " has not three coordinates");
        }
    }
    requireCountFits("faces", faceCount, 2, lines.remaining() + 1); // "0\n"
    mesh.triangles.reserve(faceCount);
    std::vector<std::uint32_t> corners;
    for (std::uint64_t face = 0; face < faceCount; ++face) {
        const std::string_view line = offLine(lines);
        Cursor words(line);
        std::int64_t cornerCount = 0;
        if (!parseInteger(words.token(), cornerCount) || cornerCount < 0 ||
            static_cast<std::uint64_t>(cornerCount) > line.size()) {
            throw AssetError("face " + std::to_string(face) + " has a bad number of corners");
        }
        corners.clear();
        for (std::int64_t i = 0; i < cornerCount; ++i) {
            std::int64_t index = 0;
            if (!parseInteger(words.token(), index)) {
                throw AssetError("face " + std::to_string(face) + " is incomplete");
            }
            corners.push_back(checkedIndex(index, vertexCount, face));
        }
        mesh.addPolygon(corners);
    }
    return mesh;
}

// ---------------------------------------------------------------------------------------------------------- STL ---

namespace {

constexpr std::size_t kStlHeaderBytes = 84;
constexpr std::size_t kStlFacetBytes = 50;

std::uint32_t littleEndian32(const char* bytes)
{
    std::uint32_t value = 0;
    for (int i = 3; i >= 0; --i) { value = value << 8 | static_cast<unsigned char>(bytes[i]); }
    return value;
}

void addStlTriangle(RawMesh& mesh)
{
    if (mesh.positions.size() > kMaxElements) { throw AssetError("more than 2^32 vertices"); }
    const auto first = static_cast<std::uint32_t>(mesh.positions.size() - 3);
    mesh.triangles.push_back({first, first + 1, first + 2});
}

RawMesh parseBinaryStl(const std::string& content)
{
    const std::uint64_t count = littleEndian32(content.data() + 80);
    requireCountFits("facets", count, kStlFacetBytes, content.size() - kStlHeaderBytes);
    RawMesh mesh;
    mesh.positions.reserve(3 * count);
    mesh.triangles.reserve(count);
    for (std::uint64_t facet = 0; facet < count; ++facet) {
        const char* at = content.data() + kStlHeaderBytes + facet * kStlFacetBytes + 12; // behind the normal
        for (int corner = 0; corner < 3; ++corner) {
            std::array<float, 3> xyz{};
            for (float& value : xyz) {
                const std::uint32_t bits = littleEndian32(at);
                std::memcpy(&value, &bits, sizeof value);
                at += 4;
            }
            mesh.positions.emplace_back(xyz[0], xyz[1], xyz[2]);
        }
        addStlTriangle(mesh);
    }
    return mesh;
}

RawMesh parseTextStl(const std::string& content)
{
    RawMesh mesh;
    Cursor words(content);
    bool inSolid = false;
    while (true) {
        const std::string word = lowerCase(words.token());
        if (word.empty()) { break; }
        if (word == "solid") {
            words.line(); // its name, which may be any words
            inSolid = true;
        } else if (word == "endsolid") {
            if (!words.atEnd()) { words.line(); }
            inSolid = false;
        } else if (word == "vertex") {
            Eigen::Vector3d position;
            if (!parsePosition(words, position)) {
                throw AssetError("vertex " + std::to_string(mesh.positions.size()) + " has not three coordinates");
            }
            mesh.positions.push_back(position);
        } else if (word == "endloop") {
            if (mesh.positions.size() != 3 * (mesh.triangles.size() + 1)) {
                throw AssetError("facet " + std::to_string(mesh.triangles.size()) + " has not three vertices");
            }
            addStlTriangle(mesh);
        }
    }
    if (inSolid || mesh.positions.size() != 3 * mesh.triangles.size()) { throw AssetError("truncated: no endsolid"); }
    return mesh;
}

} // namespace

RawMesh parseStl(const std::string& content)
{
    // Many binary files begin with "solid" too: the size tells, and the first facet.
    const bool fits = content.size() >= kStlHeaderBytes &&
                      content.size() == kStlHeaderBytes + std::uint64_t{kStlFacetBytes} * littleEndian32(content.data() + 80);
    if (!fits) {
        Cursor words(content);
        const bool solid = lowerCase(words.token()) == "solid";
        const std::string start = lowerCase(std::string_view(content).substr(0, 1024));
        if (solid && (start.find("facet") != start.npos || start.find("endsolid") != start.npos)) {
            return parseTextStl(content);
        }
        if (content.size() < kStlHeaderBytes) { throw AssetError("not an STL file, or truncated"); }
    }
    return parseBinaryStl(content);
}

} // namespace osgTessLOD::bake
