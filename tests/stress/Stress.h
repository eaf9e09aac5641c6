// SPDX-License-Identifier: MIT
// What the stress tests share: how many trials, and the worst of what they measure.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace osgTessLOD::stress {

/// How often a test is to try: `few` in the short form; times the environment variable OSGTESSLOD_STRESS in the long one
/// (scripts/stress). Trial k is the same in both: it is seeded with k.
inline unsigned trials(unsigned few)
{
    const char* factor = std::getenv("OSGTESSLOD_STRESS");
    return few * std::max(1U, factor != nullptr ? static_cast<unsigned>(std::strtoul(factor, nullptr, 10)) : 1U);
}

/// A measured figure, for people and for the XML report.
inline void report(const std::string& name, double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", value);
    testing::Test::RecordProperty(name, text);
    std::printf("    %s: %s\n", name.c_str(), text);
}

/// The largest of what it was shown.
class Worst {
public:
    void add(double value) { _value = std::max(_value, value); }
    double value() const { return _value; }

private:
    double _value = 0.0;
};

} // namespace osgTessLOD::stress
