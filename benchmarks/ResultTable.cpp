// SPDX-License-Identifier: MIT
#include "ResultTable.h"

#include <algorithm>

namespace osgTessLOD::benchmarks {

namespace {

/// Columns of a UTF-8 text: bytes that continue a character have none of their own.
std::size_t widthOf(const std::string& text)
{
    const auto starts = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; };
    return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), starts));
}

std::string padded(const std::string& text, std::size_t width, bool left)
{
    const std::string space(width - std::min(width, widthOf(text)), ' ');
    return left ? text + space : space + text;
}

} // namespace

std::string ResultTable::toText(bool markdown) const
{
    std::vector<std::size_t> widths(headers.size());
    const auto widen = [&](const std::vector<std::string>& cells) {
        for (std::size_t k = 0; k < widths.size(); ++k) { widths[k] = std::max(widths[k], widthOf(cells[k])); }
    };
    widen(headers);
    for (const std::vector<std::string>& row : rows) { widen(row); }

    const auto line = [&](const std::vector<std::string>& cells) {
        std::string text = markdown ? "|" : "";
        for (std::size_t k = 0; k < widths.size(); ++k) {
            if (markdown) {
                text += " " + cells[k] + " |";
            } else {
                text += (k == 0 ? "" : "  ") + padded(cells[k], widths[k], k == 0);
            }
        }
        return text + "\n";
    };
    std::string text = line(headers);
    if (markdown) {
        text += "|---|";
        for (std::size_t k = 1; k < widths.size(); ++k) { text += "---:|"; }
        text += "\n";
    }
    for (const std::vector<std::string>& row : rows) { text += line(row); }
    return text;
}

std::string grouped(unsigned long long number)
{
    std::string text = std::to_string(number);
    for (std::size_t at = text.size(); at > 3;) {
        at -= 3;
        text.insert(at, ",");
    }
    return text;
}

} // namespace osgTessLOD::benchmarks
