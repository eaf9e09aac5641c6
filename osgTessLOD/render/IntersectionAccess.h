// SPDX-License-Identifier: MIT
#pragma once

#include <osgUtil/IntersectionVisitor>

namespace osgTessLOD {

/// What OSG's own nodes do in intersections and is protected; pointers to it are not.
class IntersectionAccess : public osgUtil::IntersectionVisitor {
public:
    /// Does what is looked for meet the node's bounding sphere?
    static bool enters(osgUtil::IntersectionVisitor& visitor, const osg::Node& node)
    {
        return (visitor.*(&IntersectionAccess::enter))(node);
    }
    /// Looks in the space of the visitor's model matrix from now on.
    static void pushClone(osgUtil::IntersectionVisitor& visitor) { (visitor.*(&IntersectionAccess::push_clone))(); }
    static void popClone(osgUtil::IntersectionVisitor& visitor) { (visitor.*(&IntersectionAccess::pop_clone))(); }
};

} // namespace osgTessLOD
