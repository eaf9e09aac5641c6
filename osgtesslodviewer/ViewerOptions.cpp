// SPDX-License-Identifier: MIT
#include "ViewerOptions.h"

#include <osg/ApplicationUsage>
#include <osg/ArgumentParser>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

namespace osgTessLOD {

namespace {

constexpr int kLargestSide = 16384;
constexpr unsigned kMostFrames = 100000;

/// The options and their values, and what they are for.
constexpr std::pair<const char*, const char*> kOptions[] = {
    {"--error-pixels <number>", "Largest error on screen asked for, in pixels."},
    {"--max-factor <number>", "Do not use levels of larger tessellation factors."},
    {"--metric <view|isotropic>", "Errors as seen, or at their largest over all directions."},
    {"--bound <conservative|first-order>",
     "Keep the error asked for everywhere on screen, or about at the middles of patch borders."},
    {"--selection <cpu|gpu>",
     "Select levels in the cull traversal, or in the control shader; what is drawn is then known at most."},
    {"--backend <auto|tessellation|instanced>",
     "Draw with tessellation shaders, or an instance per patch; auto tries which is faster."},
    {"--no-cull", "Draw patches outside the view frustum too."},
    {"--video-memory <MiB>", "Most that levels and normals may take on the GPU; those not drawn give way."},
    {"--upload <MiB>", "Most of them to send to the GPU in a frame; what is to be finer waits."},
    {"--color-by-level", "Colour patches by their level."},
    {"--wireframe", "Draw lines instead of filled triangles."},
    {"-p <file>", "Follow the animation path in the file; headless, all of it in the frames timed."},
    {"--headless", "Render without a window or display, write the files asked for, and end."},
    {"--size <W>x<H>", "Headless: size of the picture in pixels; 1280x800 if not given."},
    {"--camera <ex,ey,ez,cx,cy,cz,ux,uy,uz>",
     "Headless: eye, centre and up vector; the trackball's home position if not given."},
    {"--fov <degrees>", "Headless: vertical field of view."},
    {"--frames <number>", "Headless: frames to take times of; 5 if not given."},
    {"--screenshot <file.png>", "Headless: write the picture."},
    {"--capture <file.ply>", "Headless: write the triangles that the GPU drew, in world space."},
    {"--stats <file.json>", "Headless: write the view, what was drawn, and times."},
    {"--trace <file.jsonl>", "Headless: write what was selected in each frame timed, a JSON object a line."},
};

void reject(osg::ArgumentParser& arguments, const std::string& option, const std::string& value, const char* wanted)
{
    arguments.reportError(option + " " + value + ": " + wanted, osg::ArgumentParser::CRITICAL);
}

/// The value of an option, taken out of `arguments` with it; no value where the option is not given. The last one counts.
/// Values may start with a minus sign, so osg::ArgumentParser's own parameters will not do.
std::optional<std::string> takeValue(osg::ArgumentParser& arguments, const std::string& option)
{
    std::optional<std::string> value;
    for (int position = arguments.find(option); position > 0; position = arguments.find(option)) {
        if (position + 1 >= arguments.argc()) {
            arguments.remove(position);
            arguments.reportError(option + " needs a value", osg::ArgumentParser::CRITICAL);
            return std::nullopt;
        }
        value = arguments[position + 1];
        arguments.remove(position, 2);
    }
    return value;
}

/// All of `text` as finite numbers separated by commas; nothing if it is anything else.
std::vector<double> parseNumbers(const std::string& text)
{
    std::vector<double> numbers;
    const char* at = text.c_str();
    while (true) {
        char* end = nullptr;
        const double number = std::strtod(at, &end);
        if (end == at || !std::isfinite(number)) { return {}; }
        numbers.push_back(number);
        if (*end == '\0') { return numbers; }
        if (*end != ',') { return {}; }
        at = end + 1;
    }
}

std::optional<double> takeNumber(osg::ArgumentParser& arguments, const std::string& option, double above, double below,
                                 const char* wanted)
{
    const std::optional<std::string> text = takeValue(arguments, option);
    if (!text) { return std::nullopt; }
    const std::vector<double> numbers = parseNumbers(*text);
    if (numbers.size() == 1 && numbers[0] > above && numbers[0] < below) { return numbers[0]; }
    reject(arguments, option, *text, wanted);
    return std::nullopt;
}

std::optional<unsigned> takeCount(osg::ArgumentParser& arguments, const std::string& option, unsigned most,
                                  const char* wanted)
{
    const std::optional<std::string> text = takeValue(arguments, option);
    if (!text) { return std::nullopt; }
    const std::vector<double> numbers = parseNumbers(*text);
    if (numbers.size() == 1 && numbers[0] >= 1.0 && numbers[0] <= most && numbers[0] == std::floor(numbers[0])) {
        return static_cast<unsigned>(numbers[0]);
    }
    reject(arguments, option, *text, wanted);
    return std::nullopt;
}

/// What the option's value names, as `find` knows it.
template <typename Value>
std::optional<Value> takeNamed(osg::ArgumentParser& arguments, const std::string& option,
                               std::optional<Value> (*find)(const std::string&), const char* wanted)
{
    const std::optional<std::string> text = takeValue(arguments, option);
    if (!text) { return std::nullopt; }
    const std::optional<Value> value = find(*text);
    if (!value) { reject(arguments, option, *text, wanted); }
    return value;
}

void takeSize(osg::ArgumentParser& arguments, ViewerOptions& options)
{
    const std::optional<std::string> text = takeValue(arguments, "--size");
    if (!text) { return; }
    int width = 0;
    int height = 0;
    int length = 0;
    const int read = std::sscanf(text->c_str(), "%5dx%5d%n", &width, &height, &length);
    if (read != 2 || static_cast<std::size_t>(length) != text->size() || width < 1 || height < 1 ||
        width > kLargestSide || height > kLargestSide) {
        reject(arguments, "--size", *text, "WIDTHxHEIGHT is needed, each 1 to 16384, as in 1280x800");
        return;
    }
    options.width = width;
    options.height = height;
}

void takeCamera(osg::ArgumentParser& arguments, ViewerOptions& options)
{
    const std::optional<std::string> text = takeValue(arguments, "--camera");
    if (!text) { return; }
    const std::vector<double> n = parseNumbers(*text);
    if (n.size() == 9) {
        const LookAt camera{{n[0], n[1], n[2]}, {n[3], n[4], n[5]}, {n[6], n[7], n[8]}};
        const osg::Vec3d across = (camera.center - camera.eye) ^ camera.up;
        if (across.length() > 0.0 && std::isfinite(across.length())) {
            options.camera = camera;
            return;
        }
    }
    reject(arguments, "--camera", *text,
           "nine numbers are needed, ex,ey,ez,cx,cy,cz,ux,uy,uz: eye, centre and up, not on one line");
}

} // namespace

void describeViewerOptions(osg::ApplicationUsage& usage)
{
    for (const auto& [option, purpose] : kOptions) { usage.addCommandLineOption(option, purpose); }
}

ViewerOptions readViewerOptions(osg::ArgumentParser& arguments)
{
    ViewerOptions options;
    options.errorPixels = takeNumber(arguments, "--error-pixels", 0.0, 1e9, "a number of pixels above 0 is needed");
    options.maxFactor = takeCount(arguments, "--max-factor", 1024, "a whole number from 1 is needed");
    options.metric = takeNamed(arguments, "--metric", metricNamed, "view or isotropic is needed");
    options.bound = takeNamed(arguments, "--bound", boundNamed, "conservative or first-order is needed");
    options.selector = takeNamed(arguments, "--selection", selectorNamed, "cpu or gpu is needed");
    options.backend = takeNamed(arguments, "--backend", backendNamed, "auto, tessellation or instanced is needed");
    while (arguments.read("--no-cull")) { options.cullPatches = false; }
    options.videoMemoryMebibytes =
        takeNumber(arguments, "--video-memory", 0.0, 1e9, "a number of mebibytes above 0 is needed");
    options.uploadMebibytes = takeNumber(arguments, "--upload", 0.0, 1e9, "a number of mebibytes above 0 is needed");
    while (arguments.read("--color-by-level")) { options.colorByLevel = true; }
    while (arguments.read("--wireframe")) { options.wireframe = true; }
    options.pathFile = takeValue(arguments, "-p").value_or("");
    while (arguments.read("--headless")) { options.headless = true; }
    if (!options.headless) {
        for (const char* option : {"--size", "--camera", "--fov", "--frames", "--screenshot", "--capture", "--stats",
                                   "--trace"}) {
            if (takeValue(arguments, option)) {
                arguments.reportError(std::string(option) + " needs --headless", osg::ArgumentParser::CRITICAL);
            }
        }
        return options;
    }
    takeSize(arguments, options);
    takeCamera(arguments, options);
    options.fovDegrees = takeNumber(arguments, "--fov", 0.0, 180.0, "an angle between 0 and 180 degrees is needed");
    options.frames = takeCount(arguments, "--frames", kMostFrames, "a whole number from 1 to 100000 is needed")
                         .value_or(options.frames);
    options.screenshotFile = takeValue(arguments, "--screenshot").value_or("");
    options.captureFile = takeValue(arguments, "--capture").value_or("");
    options.statsFile = takeValue(arguments, "--stats").value_or("");
    options.traceFile = takeValue(arguments, "--trace").value_or("");
    if (options.camera && !options.pathFile.empty()) {
        arguments.reportError("-p and --camera: one of them alone", osg::ArgumentParser::CRITICAL);
    }
    return options;
}

} // namespace osgTessLOD
