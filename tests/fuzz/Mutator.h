// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace osgTessLOD {

/// Seeded random changes of files: the same ones on every machine. Far from what libFuzzer finds, which sees what the code does.
class Mutator {
public:
    Mutator(std::vector<std::string> seeds, std::uint32_t seed)
        : _seeds(std::move(seeds))
        , _random(seed)
    {
    }

    /// One of the seeds, changed in one to four ways.
    std::string next()
    {
        std::string bytes = any();
        for (std::size_t changes = 1 + below(4); changes > 0; --changes) { change(bytes); }
        return bytes;
    }

private:
    std::size_t below(std::size_t limit) { return limit == 0 ? 0 : _random() % limit; }
    const std::string& any() { return _seeds[below(_seeds.size())]; }

    void change(std::string& bytes)
    {
        const std::size_t at = below(bytes.size());
        const std::size_t length = std::min(std::size_t{1} << below(7), bytes.size() - at);
        switch (below(8)) {
        case 0: bytes.resize(at); break;
        case 1: bytes.erase(at, length); break;
        case 2: bytes.insert(at, bytes.substr(below(bytes.size()), length)); break;
        case 3: splice(bytes, at); break;
        case 4: putNumber(bytes, at); break;
        case 5: putText(bytes, at); break;
        default:
            if (!bytes.empty()) { bytes[at] = static_cast<char>(bytes[at] ^ 1 << below(8)); }
        }
    }

    /// Goes on as another seed does from some place.
    void splice(std::string& bytes, std::size_t at)
    {
        const std::string& other = any();
        bytes.resize(at);
        bytes += other.substr(below(other.size()));
    }

    /// An integer of 1 to 8 bytes, in either order of bytes, at the ends of its range or near zero.
    void putNumber(std::string& bytes, std::size_t at)
    {
        static constexpr std::array<std::uint64_t, 8> kValues{0,           1,           0x7F,        0x7FFF,
                                                              0x7FFFFFFFU, 0x80000000U, 0xFFFFFFFEU, ~std::uint64_t{0}};
        const std::uint64_t value = kValues[below(kValues.size())];
        const std::size_t size = std::min(std::size_t{1} << below(4), bytes.size() - at);
        const bool isBigEndian = below(2) == 1;
        for (std::size_t k = 0; k < size; ++k) {
            bytes[at + k] = static_cast<char>(value >> 8 * (isBigEndian ? size - 1 - k : k) & 0xFF);
        }
    }

    /// A number for a word of digits, as text formats have them.
    void putText(std::string& bytes, std::size_t at)
    {
        static constexpr std::array<const char*, 9> kWords{
            "0", "-1", "2147483648", "4294967295", "-9223372036854775808", "nan", "1e308", "1e-320", "0.1"};
        const std::size_t begin = std::min(bytes.find_first_of("0123456789", at), bytes.size());
        const std::size_t end = std::min(bytes.find_first_not_of("0123456789.", begin), bytes.size());
        bytes.replace(begin, end - begin, kWords[below(kWords.size())]);
    }

    std::vector<std::string> _seeds;
    std::mt19937 _random;
};

} // namespace osgTessLOD
