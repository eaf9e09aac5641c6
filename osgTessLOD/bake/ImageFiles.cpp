// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/ImageFiles.h>

#include <osgTessLOD/asset/AssetError.h>

#include <dlfcn.h>

#include <filesystem>

namespace osgTessLOD::bake {

namespace {

constexpr const char* kModule = "libosgTessLODImages.so";

/// The module beside what this code is in (library or test), or in the folder of libraries beside that one's.
std::string modulePath()
{
    Dl_info self{};
    if (dladdr(reinterpret_cast<const void*>(&imageFiles), &self) == 0) { return kModule; }
    std::error_code error;
    const std::filesystem::path folder = std::filesystem::absolute(self.dli_fname, error).parent_path();
    for (const std::filesystem::path& path : {folder / kModule, folder.parent_path() / "lib" / kModule}) {
        if (std::filesystem::exists(path, error)) { return path.string(); }
    }
    return kModule;
}

const ImageFiles& load()
{
    void* module = dlopen(modulePath().c_str(), RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr) { throw AssetError(std::string("image files cannot be read here: ") + dlerror()); }
    const auto function = reinterpret_cast<ImageFilesFunction*>(dlsym(module, kImageFilesFunction));
    if (function == nullptr) { throw AssetError(std::string(kModule) + " is not what reads image files"); }
    return *function();
}

} // namespace

const ImageFiles& imageFiles()
{
    static const ImageFiles& files = load();
    return files;
}

} // namespace osgTessLOD::bake
