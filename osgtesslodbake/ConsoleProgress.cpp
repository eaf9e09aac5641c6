// SPDX-License-Identifier: MIT
#include "ConsoleProgress.h"

#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>

namespace osgTessLOD {

namespace {

volatile std::sig_atomic_t stopSignal = 0;

void noteSignal(int signal)
{
    stopSignal = signal;
}

double secondsSince(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

} // namespace

ConsoleProgress::ConsoleProgress(bool quiet)
    : _quiet(quiet)
    , _terminal(isatty(STDERR_FILENO) != 0)
{
    std::signal(SIGINT, noteSignal);
    std::signal(SIGTERM, noteSignal);
}

void ConsoleProgress::begin(const std::string& stage, std::uint64_t total, const std::string& unit)
{
    _stage = stage;
    _unit = unit;
    _total = total;
    _done = 0;
    _start = _lastDrawn = std::chrono::steady_clock::now();
}

void ConsoleProgress::advance(std::uint64_t amount)
{
    _done += amount;
    if (_quiet || !_terminal) { return; }
    const std::unique_lock<std::mutex> lock(_mutex, std::try_to_lock);
    constexpr double kRedrawSeconds = 0.1;
    if (!lock.owns_lock() || secondsSince(_lastDrawn) < kRedrawSeconds) { return; }
    _lastDrawn = std::chrono::steady_clock::now();
    draw(secondsSince(_start));
}

void ConsoleProgress::end()
{
    if (_quiet) { return; }
    const double seconds = secondsSince(_start);
    const std::uint64_t done = _done;
    const double rate = seconds > 0.0 ? static_cast<double>(done) / seconds : 0.0;
    fmt::print(stderr, "{}{:<16} {:>10} {:<14} {:>8.2f} s  {:>12.0f} {}/s\n", _terminal ? "\r\x1b[K" : "", _stage, done,
               _unit, seconds, rate, _unit);
}

bool ConsoleProgress::stopRequested() const
{
    return stopSignal != 0;
}

void ConsoleProgress::draw(double seconds) const
{
    constexpr std::uint64_t kWidth = 30;
    const std::uint64_t done = _done;
    const std::uint64_t filled = _total > 0 ? std::min(kWidth, done * kWidth / _total) : 0;
    const double rate = seconds > 0.0 ? static_cast<double>(done) / seconds : 0.0;
    fmt::print(stderr, "\r\x1b[K{:<16} [{:#<{}}{:.<{}}] {:3}%  {:.0f} {}/s", _stage, "", filled, "", kWidth - filled,
               _total > 0 ? std::min<std::uint64_t>(100, done * 100 / _total) : 0, rate, _unit);
    std::fflush(stderr);
}

} // namespace osgTessLOD
