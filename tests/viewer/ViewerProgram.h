// SPDX-License-Identifier: MIT
#pragma once

#include <asset/OpenEdges.h>

#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace osgTessLOD {

struct Outcome {
    int status;
    std::string output;
};

/// The viewer with these arguments, quoted for the shell where they need it, and without a display.
inline Outcome runViewer(const TemporaryDirectory& folder, const std::string& arguments,
                         const std::string& environment = "")
{
    const std::string log = folder.file("viewer.log");
    const std::string command = "env -u DISPLAY -u WAYLAND_DISPLAY -u OSG_LIBRARY_PATH " + environment + " " +
                                std::string(OSGTESSLOD_VIEWER) + " " + arguments + " > '" + log + "' 2>&1";
    const int status = std::system(command.c_str());
    Outcome outcome{WIFEXITED(status) ? WEXITSTATUS(status) : -1, readBytes(log)};
    std::filesystem::remove(log);
    return outcome;
}

inline nlohmann::json readJson(const std::string& path)
{
    return nlohmann::json::parse(readBytes(path));
}

/// Faces of a binary PLY of float or double coordinates, and how many vertices it has.
struct Ply {
    std::size_t vertices = 0;
    std::vector<std::array<std::uint32_t, 3>> faces;
    std::vector<std::array<double, 3>> positions;
};

inline Ply readPly(const std::string& path)
{
    const std::string bytes = readBytes(path);
    const std::string end = "end_header\n";
    const std::size_t headerSize = bytes.find(end) + end.size();
    std::istringstream header(bytes.substr(0, headerSize));
    Ply ply;
    std::size_t faces = 0;
    bool isDouble = false;
    for (std::string line; std::getline(header, line);) {
        std::sscanf(line.c_str(), "element vertex %zu", &ply.vertices);
        std::sscanf(line.c_str(), "element face %zu", &faces);
        isDouble = isDouble || line.find("property double x") == 0;
    }
    const char* at = bytes.data() + headerSize;
    EXPECT_EQ(bytes.size(), headerSize + ply.vertices * (isDouble ? 24 : 12) + faces * 13);
    for (std::size_t v = 0; v < ply.vertices; ++v) {
        std::array<double, 3> position{};
        for (double& coordinate : position) {
            float single = 0.0F;
            std::memcpy(isDouble ? static_cast<void*>(&coordinate) : &single, at, isDouble ? 8 : 4);
            if (!isDouble) { coordinate = static_cast<double>(single); }
            at += isDouble ? 8 : 4;
        }
        ply.positions.push_back(position);
    }
    for (std::size_t f = 0; f < faces; ++f) {
        EXPECT_EQ(*at, 3);
        std::array<std::uint32_t, 3> face{};
        std::memcpy(face.data(), at + 1, 12);
        ply.faces.push_back(face);
        at += 13;
    }
    return ply;
}

/// Edges, whatever their direction, that do not have exactly two faces.
inline std::size_t edgesWithoutTwoFaces(const Ply& ply)
{
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> faces;
    for (const auto& face : ply.faces) {
        for (std::size_t k = 0; k < 3; ++k) { ++faces[std::minmax({face[k], face[(k + 1) % 3]})]; }
    }
    std::size_t count = 0;
    for (const auto& [edge, number] : faces) { count += number == 2 ? 0 : 1; }
    return count;
}

} // namespace osgTessLOD
