// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/ShaderSource.h>

#include <osg/Notify>
#include <osgDB/FileUtils>
#include <osgDB/fstream>

#include <sstream>

namespace osgTessLOD {

std::string shaderText(const std::string& name)
{
    const std::string path = osgDB::findDataFile(name);
    if (!path.empty()) {
        osgDB::ifstream file(path.c_str(), std::ios::binary);
        std::ostringstream text;
        text << file.rdbuf();
        if (file && !text.str().empty()) {
            OSG_INFO << "osgTessLOD: shader " << name << " read from " << path << std::endl;
            return text.str();
        }
    }
    const char* embedded = embeddedShader(name);
    if (embedded == nullptr) {
        OSG_WARN << "osgTessLOD: no shader named " << name << std::endl;
        return {};
    }
    return embedded;
}

std::string shaderSource(const std::string& text, const std::vector<std::string>& shared)
{
    const std::size_t versionEnd = text.compare(0, 8, "#version") == 0 ? text.find('\n') : std::string::npos;
    const std::size_t bodyStart = versionEnd == std::string::npos ? 0 : versionEnd + 1;
    std::string source = text.substr(0, bodyStart);
    int file = 1;
    for (const std::string& name : shared) {
        source += "#line 1 " + std::to_string(file++) + "\n" + shaderText(name) + "\n";
    }
    source += bodyStart == 0 ? "#line 1 0\n" : "#line 2 0\n";
    return source + text.substr(bodyStart);
}

osg::ref_ptr<osg::Shader> createShader(osg::Shader::Type type, const std::string& stage,
                                       const std::vector<std::string>& shared)
{
    osg::ref_ptr<osg::Shader> shader = createShaderFromText(type, shaderText(stage), shared);
    shader->setName(stage);
    return shader;
}

osg::ref_ptr<osg::Shader> createShaderFromText(osg::Shader::Type type, const std::string& text,
                                               const std::vector<std::string>& shared)
{
    return new osg::Shader(type, shaderSource(text, shared));
}

} // namespace osgTessLOD
