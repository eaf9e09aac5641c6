// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/MeshReader.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/MeshText.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace osgTessLOD::bake {

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
    struct Name {
        std::string_view name;
        PlyType type;
    };
    static constexpr Name kNames[] = {
        {"char", PlyType::Int8},      {"int8", PlyType::Int8},       {"uchar", PlyType::Uint8},
        {"uint8", PlyType::Uint8},    {"short", PlyType::Int16},     {"int16", PlyType::Int16},
        {"ushort", PlyType::Uint16},  {"uint16", PlyType::Uint16},   {"int", PlyType::Int32},
        {"int32", PlyType::Int32},    {"uint", PlyType::Uint32},     {"uint32", PlyType::Uint32},
        {"float", PlyType::Float32},  {"float32", PlyType::Float32}, {"double", PlyType::Float64},
        {"float64", PlyType::Float64}};
    for (const auto& [known, type] : kNames) {
        if (name == known) { return type; }
    }
    throw AssetError("PLY header: unknown type " + quoted(name));
}

std::size_t plyBytes(PlyType type)
{
    switch (type) {
    case PlyType::None: return 0;
    case PlyType::Int8:
    case PlyType::Uint8: return 1;
    case PlyType::Int16:
    case PlyType::Uint16: return 2;
    case PlyType::Int32:
    case PlyType::Uint32:
    case PlyType::Float32: return 4;
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
        if (property.countType >= PlyType::Float32) {
            throw AssetError("PLY header: a list's length is not an integer");
        }
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

/// Of the elements that are used there can be one each: indices count the vertices of all.
void addElement(PlyElement element, std::vector<PlyElement>& elements)
{
    const auto isSame = [&](const PlyElement& other) { return other.name == element.name; };
    if ((element.name == "vertex" || element.name == "face") && std::any_of(elements.begin(), elements.end(), isSame)) {
        throw AssetError("PLY header: two elements " + quoted(element.name));
    }
    elements.push_back(std::move(element));
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
            addElement(plyElement(words), header.elements);
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
        : _cursor(std::string_view(content).substr(header.bytes))
    {
    }
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
        : _next(content.data() + header.bytes)
        , _end(content.data() + content.size())
        , _swap((header.format == PlyHeader::Format::BigEndian) != kHostIsBigEndian)
    {
    }
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

    template <typename T> T take()
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
template <typename Values> std::uint64_t listLength(Values& values, const PlyProperty& property)
{
    const std::int64_t length = values.integer(property.countType);
    if (length < 0) { throw AssetError("a list of negative length"); }
    requireCountFits("list items", static_cast<std::uint64_t>(length), Values::leastBytes(property.type),
                     values.remaining());
    return static_cast<std::uint64_t>(length);
}

template <typename Values> void skipProperty(Values& values, const PlyProperty& property)
{
    const std::uint64_t items = property.countType == PlyType::None ? 1 : listLength(values, property);
    for (std::uint64_t i = 0; i < items; ++i) { values.real(property.type); }
}

/// What a vertex can have, by property name; the order of VertexChannel.
enum VertexChannel : std::uint8_t { X, Y, Z, U, V, Red, Green, Blue, Alpha, kChannels };

VertexChannel vertexChannel(const PlyProperty& property)
{
    struct Name {
        std::string_view name;
        VertexChannel channel;
    };
    static constexpr Name kNames[] = {{"x", X},         {"y", Y},         {"z", Z},         {"u", U},
                                      {"v", V},         {"s", U},         {"t", V},         {"texture_u", U},
                                      {"texture_v", V}, {"texture_s", U}, {"texture_t", V}, {"red", Red},
                                      {"green", Green}, {"blue", Blue},   {"alpha", Alpha}};
    if (property.countType != PlyType::None) { return kChannels; }
    for (const auto& [name, channel] : kNames) {
        if (property.name == name) { return channel; }
    }
    return kChannels;
}

/// What a colour of this type has to be divided by.
double fullChannel(PlyType type)
{
    switch (type) {
    case PlyType::Int8: return 127.0;
    case PlyType::Uint8: return 255.0;
    case PlyType::Int16: return 32767.0;
    case PlyType::Uint16: return 65535.0;
    case PlyType::Int32: return 2147483647.0;
    case PlyType::Uint32: return 4294967295.0;
    default: return 1.0;
    }
}

template <typename Values> void readPlyVertices(Values& values, const PlyElement& element, RawMesh& mesh)
{
    std::vector<VertexChannel> channels;
    std::array<bool, kChannels + 1> found{};
    std::array<double, kChannels + 1> full{};
    full.fill(1.0);
    for (const PlyProperty& p : element.properties) {
        channels.push_back(vertexChannel(p));
        found[channels.back()] = true;
        if (channels.back() >= Red) { full[channels.back()] = fullChannel(p.type); }
    }
    if (!(found[X] && found[Y] && found[Z])) { throw AssetError("PLY header: vertices without x, y and z"); }
    const bool hasUvs = found[U] && found[V];
    const bool hasColors = found[Red] && found[Green] && found[Blue];
    mesh.positions.reserve(element.count);
    mesh.uvs.reserve(hasUvs ? element.count : 0);
    mesh.colors.reserve(hasColors ? element.count : 0);
    std::array<double, kChannels + 1> value{};
    value[Alpha] = 1.0;
    for (std::uint64_t vertex = 0; vertex < element.count; ++vertex) {
        for (std::size_t i = 0; i < channels.size(); ++i) {
            const PlyProperty& property = element.properties[i];
            if (channels[i] == kChannels) {
                skipProperty(values, property);
            } else {
                value[channels[i]] = values.real(property.type) / full[channels[i]];
            }
        }
        mesh.positions.emplace_back(value[X], value[Y], value[Z]);
        if (hasUvs) { mesh.uvs.emplace_back(static_cast<float>(value[U]), static_cast<float>(value[V])); }
        if (!hasColors) { continue; }
        mesh.colors.push_back(
            {colorByte(value[Red]), colorByte(value[Green]), colorByte(value[Blue]), colorByte(value[Alpha])});
    }
}

/// Reads a face's list u0 v0 u1 v1 … into mesh.uvs, and their numbers into `uvNumbers`.
template <typename Values>
void readFaceUvs(Values& values, const PlyProperty& property, RawMesh& mesh, std::vector<std::uint32_t>& uvNumbers)
{
    const std::uint64_t length = listLength(values, property);
    for (std::uint64_t i = 0; i < length; ++i) {
        const auto value = static_cast<float>(values.real(property.type));
        if (i % 2 == 1) {
            mesh.uvs.back().y() = value;
        } else {
            uvNumbers.push_back(static_cast<std::uint32_t>(mesh.uvs.size()));
            mesh.uvs.emplace_back(value, 0.0F);
        }
    }
}

template <typename Values>
void readPlyFaces(Values& values, const PlyElement& element, std::uint64_t vertexCount, RawMesh& mesh)
{
    const auto isIndices = [](const PlyProperty& p) {
        return p.countType != PlyType::None && (p.name == "vertex_indices" || p.name == "vertex_index");
    };
    const auto isUvs = [](const PlyProperty& p) { return p.countType != PlyType::None && p.name == "texcoord"; };
    if (std::none_of(element.properties.begin(), element.properties.end(), isIndices)) {
        throw AssetError("PLY header: faces without vertex_indices");
    }
    // Texture coordinates of the faces are more exact than the vertices', which cannot differ between faces.
    if (std::any_of(element.properties.begin(), element.properties.end(), isUvs)) { mesh.uvs.clear(); }
    mesh.triangles.reserve(element.count);
    std::vector<std::uint32_t> corners;
    std::vector<std::uint32_t> uvNumbers;
    for (std::uint64_t face = 0; face < element.count; ++face) {
        corners.clear();
        uvNumbers.clear();
        for (const PlyProperty& property : element.properties) {
            if (isUvs(property)) {
                readFaceUvs(values, property, mesh, uvNumbers);
                continue;
            }
            if (!isIndices(property)) {
                skipProperty(values, property);
                continue;
            }
            corners.resize(listLength(values, property));
            for (std::uint32_t& corner : corners) {
                corner = checkedIndex(values.integer(property.type), vertexCount, face);
            }
        }
        if (uvNumbers.size() != corners.size()) { uvNumbers.clear(); } // all corners or none
        mesh.addPolygon(corners, uvNumbers);
    }
    if (mesh.uvTriangles.empty() && std::any_of(element.properties.begin(), element.properties.end(), isUvs)) {
        mesh.uvs.clear(); // no face has as many as corners
    }
}

template <typename Values> RawMesh readPlyBody(Values values, const PlyHeader& header)
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

} // namespace osgTessLOD::bake
