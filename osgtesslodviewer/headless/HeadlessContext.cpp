// SPDX-License-Identifier: MIT
#include <osgtesslodviewer/headless/HeadlessContext.h>

#include <osg/Notify>
#include <osg/State>

#define EGL_NO_X11 // keep Xlib's macros out
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <cstring>
#include <vector>

namespace osgTessLOD {

namespace {

/// What a context is made of. The display stays initialized for the life of the process: EGL gives every caller the same
/// one and does not count them, so that terminating it would take other contexts along.
struct EglObjects {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLConfig config = nullptr;
    EGLSurface surface = EGL_NO_SURFACE;
    EGLContext context = EGL_NO_CONTEXT;
};

struct Candidate {
    std::string name;
    EGLDisplay display;
};

/// eglGetProcAddress gives one pointer type for every function.
template <typename Function> Function eglFunction(const char* name)
{
    return reinterpret_cast<Function>(eglGetProcAddress(name));
}

bool hasClientExtension(const char* name)
{
    const char* all = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    return all != nullptr && std::strstr(all, name) != nullptr;
}

/// Displays in the order in which they are to be tried.
std::vector<Candidate> candidates()
{
    std::vector<Candidate> result;
    const auto platformDisplay = eglFunction<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
    const auto queryDevices = eglFunction<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
    if (platformDisplay != nullptr && queryDevices != nullptr && hasClientExtension("EGL_EXT_platform_device")) {
        std::array<EGLDeviceEXT, 32> devices{};
        EGLint count = 0;
        if (queryDevices(static_cast<EGLint>(devices.size()), devices.data(), &count) != EGL_TRUE) { count = 0; }
        for (EGLint k = 0; k < count; ++k) {
            result.push_back({"device " + std::to_string(k),
                              platformDisplay(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(k)], nullptr)});
        }
    }
    if (platformDisplay != nullptr && hasClientExtension("EGL_MESA_platform_surfaceless")) {
        result.push_back({"surfaceless", platformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr)});
    }
    result.push_back({"default display", eglGetDisplay(EGL_DEFAULT_DISPLAY)});
    return result;
}

EGLContext createContext(const EglObjects& egl, EGLContext shared)
{
    const std::array<EGLint, 7> compatibility{EGL_CONTEXT_MAJOR_VERSION,
                                              4,
                                              EGL_CONTEXT_MINOR_VERSION,
                                              2,
                                              EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                              EGL_CONTEXT_OPENGL_COMPATIBILITY_PROFILE_BIT,
                                              EGL_NONE};
    const EGLContext context = eglCreateContext(egl.display, egl.config, shared, compatibility.data());
    if (context != EGL_NO_CONTEXT) { return context; }
    const EGLint any = EGL_NONE;
    return eglCreateContext(egl.display, egl.config, shared, &any);
}

std::string hexadecimal(EGLint error)
{
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "0x%04x", static_cast<unsigned>(error));
    return text.data();
}

void destroy(EglObjects& egl)
{
    if (egl.context != EGL_NO_CONTEXT) { eglDestroyContext(egl.display, egl.context); }
    if (egl.surface != EGL_NO_SURFACE) { eglDestroySurface(egl.display, egl.surface); }
    egl = EglObjects();
}

/// What the thread had current, given back at the end.
class CurrentContext {
public:
    CurrentContext() = default;
    ~CurrentContext()
    {
        if (_context != EGL_NO_CONTEXT) { eglMakeCurrent(_display, _draw, _read, _context); }
    }
    CurrentContext(const CurrentContext&) = delete;
    CurrentContext& operator=(const CurrentContext&) = delete;

private:
    EGLDisplay _display = eglGetCurrentDisplay();
    EGLSurface _draw = eglGetCurrentSurface(EGL_DRAW);
    EGLSurface _read = eglGetCurrentSurface(EGL_READ);
    EGLContext _context = eglGetCurrentContext();
};

/// Empty when all went well, else what failed.
std::string open(EglObjects& egl, EGLDisplay display, int width, int height, EGLContext shared)
{
    const auto failed = [](const char* what) { return what + (" failed, EGL error " + hexadecimal(eglGetError())); };
    egl.display = display;
    if (display == EGL_NO_DISPLAY) { return "no such display"; }
    if (eglInitialize(display, nullptr, nullptr) != EGL_TRUE) { return failed("eglInitialize"); }
    if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) { return failed("eglBindAPI(OpenGL)"); }
    const std::array<EGLint, 17> wanted{EGL_SURFACE_TYPE,
                                        EGL_PBUFFER_BIT,
                                        EGL_RENDERABLE_TYPE,
                                        EGL_OPENGL_BIT,
                                        EGL_RED_SIZE,
                                        8,
                                        EGL_GREEN_SIZE,
                                        8,
                                        EGL_BLUE_SIZE,
                                        8,
                                        EGL_ALPHA_SIZE,
                                        8,
                                        EGL_DEPTH_SIZE,
                                        24,
                                        EGL_STENCIL_SIZE,
                                        8,
                                        EGL_NONE};
    EGLint count = 0;
    if (eglChooseConfig(display, wanted.data(), &egl.config, 1, &count) != EGL_TRUE || count < 1) {
        return failed("eglChooseConfig");
    }
    const std::array<EGLint, 5> size{EGL_WIDTH, width, EGL_HEIGHT, height, EGL_NONE};
    egl.surface = eglCreatePbufferSurface(display, egl.config, size.data());
    if (egl.surface == EGL_NO_SURFACE) { return failed("eglCreatePbufferSurface"); }
    egl.context = createContext(egl, shared);
    if (egl.context == EGL_NO_CONTEXT) { return failed("eglCreateContext"); }
    // Some devices answer every question and then cannot be made current.
    if (eglMakeCurrent(display, egl.surface, egl.surface, egl.context) != EGL_TRUE) { return failed("eglMakeCurrent"); }
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    return {};
}

class HeadlessContext : public osg::GraphicsContext {
public:
    HeadlessContext(const EglObjects& egl, Traits* traits)
        : _egl(egl)
    {
        _traits = traits;
        setState(new osg::State);
        getState()->setGraphicsContext(this);
        if (traits->sharedContext.valid()) {
            getState()->setContextID(traits->sharedContext->getState()->getContextID());
            incrementContextIDUsageCount(getState()->getContextID());
        } else {
            getState()->setContextID(createNewContextID());
        }
    }

    const char* libraryName() const override { return "osgTessLOD"; }
    const char* className() const override { return "HeadlessContext"; }
    bool isSameKindAs(const osg::Object* object) const override
    {
        return dynamic_cast<const HeadlessContext*>(object) != nullptr;
    }

    const EglObjects& egl() const { return _egl; }

    bool valid() const override { return _egl.context != EGL_NO_CONTEXT; }
    bool realizeImplementation() override
    {
        _realized = valid();
        return _realized;
    }
    bool isRealizedImplementation() const override { return _realized; }
    void closeImplementation() override
    {
        destroy(_egl);
        _realized = false;
    }
    bool makeCurrentImplementation() override
    {
        return valid() && eglBindAPI(EGL_OPENGL_API) == EGL_TRUE // which API is bound belongs to the thread
               && eglMakeCurrent(_egl.display, _egl.surface, _egl.surface, _egl.context) == EGL_TRUE;
    }
    bool makeContextCurrentImplementation(osg::GraphicsContext* readContext) override
    {
        const auto* read = dynamic_cast<const HeadlessContext*>(readContext);
        return valid() && read != nullptr && eglBindAPI(EGL_OPENGL_API) == EGL_TRUE &&
               eglMakeCurrent(_egl.display, _egl.surface, read->_egl.surface, _egl.context) == EGL_TRUE;
    }
    bool releaseContextImplementation() override
    {
        return valid() && eglMakeCurrent(_egl.display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT) == EGL_TRUE;
    }
    void bindPBufferToTextureImplementation(GLenum) override
    {
        OSG_WARN << "HeadlessContext: binding the buffer to a texture is not supported" << std::endl;
    }
    void swapBuffersImplementation() override { glFlush(); }

protected:
    ~HeadlessContext() override { close(true); }

private:
    EglObjects _egl;
    bool _realized = false;
};

osg::ref_ptr<osg::GraphicsContext::Traits> traitsOf(int width, int height, osg::GraphicsContext* sharedContext)
{
    osg::ref_ptr<osg::GraphicsContext::Traits> traits = new osg::GraphicsContext::Traits;
    traits->width = width;
    traits->height = height;
    traits->red = traits->green = traits->blue = traits->alpha = 8;
    traits->depth = 24;
    traits->stencil = 8;
    traits->pbuffer = true;
    traits->doubleBuffer = false;
    traits->windowDecoration = false;
    traits->sharedContext = sharedContext;
    return traits;
}

} // namespace

osg::ref_ptr<osg::GraphicsContext> createHeadlessContext(int width, int height, std::string& error,
                                                         osg::GraphicsContext* sharedContext)
{
    error.clear();
    if (width < 1 || height < 1) {
        error = "headless context: the size must be at least 1 × 1 pixels";
        return nullptr;
    }
    const auto* shared = dynamic_cast<const HeadlessContext*>(sharedContext);
    const CurrentContext current;
    for (const Candidate& candidate : candidates()) {
        if (shared != nullptr && shared->egl().display != candidate.display) { continue; }
        EglObjects egl;
        const EGLContext sharedEgl = shared != nullptr ? shared->egl().context : EGL_NO_CONTEXT;
        const std::string failure = open(egl, candidate.display, width, height, sharedEgl);
        if (failure.empty()) {
            error.clear();
            auto* sharing = shared != nullptr ? sharedContext : nullptr;
            return new HeadlessContext(egl, traitsOf(width, height, sharing).get());
        }
        destroy(egl);
        error += (error.empty() ? "headless context: " : "; ") + candidate.name + ": " + failure;
    }
    if (error.empty()) { error = "headless context: the context to share with is on no known display"; }
    return nullptr;
}

} // namespace osgTessLOD
