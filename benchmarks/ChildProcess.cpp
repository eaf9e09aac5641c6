// SPDX-License-Identifier: MIT
#include "ChildProcess.h"

#include <nlohmann/json.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

std::string describe(const std::string& what)
{
    return what + ": " + std::strerror(errno);
}

void writeAll(int descriptor, const std::string& text)
{
    std::size_t done = 0;
    while (done < text.size()) {
        const ssize_t written = write(descriptor, text.data() + done, text.size() - done);
        if (written < 0 && errno == EINTR) { continue; }
        if (written <= 0) { return; }
        done += static_cast<std::size_t>(written);
    }
}

std::string readAll(int descriptor)
{
    std::string text;
    std::array<char, 4096> block{};
    while (true) {
        const ssize_t got = read(descriptor, block.data(), block.size());
        if (got < 0 && errno == EINTR) { continue; }
        if (got <= 0) { return text; }
        text.append(block.data(), static_cast<std::size_t>(got));
    }
}

/// Never returns: destructors of what the parent owns must not run here.
[[noreturn]] void runChild(int descriptor, const std::function<Json()>& work)
{
    Json answer;
    try {
        answer["result"] = work();
    } catch (const std::bad_alloc&) {
        answer["error"] = "out of memory";
    } catch (const std::exception& error) {
        answer["error"] = error.what();
    }
    writeAll(descriptor, answer.dump(-1, ' ', false, Json::error_handler_t::replace));
    _exit(0);
}

std::string endOf(int status)
{
    if (WIFSIGNALED(status)) { return std::string("ended by a signal: ") + strsignal(WTERMSIG(status)); }
    return "ended with status " + std::to_string(WEXITSTATUS(status));
}

} // namespace

Json runInChild(const std::function<Json()>& work)
{
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) { throw std::runtime_error(describe("no pipe")); }
    const pid_t child = fork();
    if (child == 0) {
        close(ends[0]);
        runChild(ends[1], work);
    }
    close(ends[1]);
    const std::string text = child > 0 ? readAll(ends[0]) : "";
    close(ends[0]);
    if (child < 0) { throw std::runtime_error(describe("no process")); }
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {}

    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) { throw TimeLimitReached("took too long"); }
    const Json answer = Json::parse(text, nullptr, false);
    if (answer.is_discarded()) { throw std::runtime_error(endOf(status)); }
    if (answer.contains("error")) { throw std::runtime_error(answer["error"].get<std::string>()); }
    return answer["result"];
}

void limitChild(unsigned seconds)
{
    alarm(seconds); // whose signal ends a process that does not handle it
}

} // namespace osgTessLOD::benchmarks
