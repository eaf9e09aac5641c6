// SPDX-License-Identifier: MIT
// What a TessLODInstances has beside what any TessLODDrawable has: its placements.
#include <osgTessLOD/render/TessLODInstances.h>

#include <osgDB/InputStream>
#include <osgDB/ObjectWrapper>
#include <osgDB/OutputStream>

#include <iomanip>
#include <limits>
#include <sstream>
#include <utility>
#include <vector>

namespace {

using osgTessLOD::TessLODInstances;

bool checkPlacements(const TessLODInstances& instances)
{
    return !instances.getPlacements().empty();
}

bool readPlacements(osgDB::InputStream& is, TessLODInstances& instances)
{
    unsigned count = 0;
    is >> count >> is.BEGIN_BRACKET;
    std::vector<osg::Matrixd> placements;
    for (unsigned k = 0; k < count && is.getException() == nullptr;
         ++k) { // whatever the number: no further than the file
        double* numbers = placements.emplace_back().ptr();
        for (int i = 0; i < 16; ++i) { is >> numbers[i]; }
    }
    is >> is.END_BRACKET;
    instances.setPlacements(std::move(placements));
    return true;
}

/// Files of text have six digits of OSG's own numbers: too few for places in a landscape.
void writeNumber(osgDB::OutputStream& os, double number)
{
    if (os.isBinary()) {
        os << number;
        return;
    }
    std::ostringstream text;
    text << std::setprecision(std::numeric_limits<double>::max_digits10) << number;
    os << text.str();
}

/// Numbers in rows of sixteen. A matrix has brackets of its own, in which OSG's writer of .osgx files would crash here.
bool writePlacements(osgDB::OutputStream& os, const TessLODInstances& instances)
{
    os << static_cast<unsigned>(instances.getPlacements().size()) << os.BEGIN_BRACKET << std::endl;
    for (const osg::Matrixd& placement : instances.getPlacements()) {
        for (int i = 0; i < 16; ++i) { writeNumber(os, placement.ptr()[i]); }
        os << std::endl;
    }
    os << os.END_BRACKET << std::endl;
    return true;
}

} // namespace

REGISTER_OBJECT_WRAPPER(osgTessLOD_TessLODInstances, new osgTessLOD::TessLODInstances, osgTessLOD::TessLODInstances,
                        "osg::Object osg::Node osg::Drawable osgTessLOD::TessLODDrawable osgTessLOD::TessLODInstances")
{
    ADD_USER_SERIALIZER(Placements);
}
