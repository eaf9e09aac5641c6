// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/CulledFace.h>

#include <osg/CullFace>
#include <osg/FrontFace>
#include <osg/StateSet>
#include <osgUtil/CullVisitor>
#include <osgUtil/StateGraph>

#include <vector>

namespace osgTessLOD {

namespace {

/// A value as osg::State keeps it: what comes later replaces it, unless it overrides and the later one is not protected.
template <class Value> class InheritedValue {
public:
    explicit InheritedValue(Value value)
        : _value(value)
    {
    }
    void set(Value value, osg::StateAttribute::OverrideValue how)
    {
        if ((_how & osg::StateAttribute::OVERRIDE) != 0 && (how & osg::StateAttribute::PROTECTED) == 0) { return; }
        _value = value;
        _how = how;
    }
    Value get() const { return _value; }

private:
    Value _value;
    osg::StateAttribute::OverrideValue _how = osg::StateAttribute::OFF;
};

/// What decides about faces, as state sets are pushed.
class FaceState {
public:
    void push(const osg::StateSet& state)
    {
        const osg::StateAttribute::GLModeValue mode = state.getMode(GL_CULL_FACE);
        if ((mode & osg::StateAttribute::INHERIT) == 0) { _isOn.set((mode & osg::StateAttribute::ON) != 0, mode); }
        if (const auto* pair = state.getAttributePair(osg::StateAttribute::CULLFACE)) {
            _cullFace.set(static_cast<const osg::CullFace&>(*pair->first).getMode(), pair->second);
        }
        if (const auto* pair = state.getAttributePair(osg::StateAttribute::FRONTFACE)) {
            _frontFace.set(static_cast<const osg::FrontFace&>(*pair->first).getMode(), pair->second);
        }
    }

    CulledFace culled() const
    {
        if (!_isOn.get() || _cullFace.get() == osg::CullFace::FRONT_AND_BACK) { return CulledFace::None; }
        const bool isBack = _cullFace.get() == osg::CullFace::BACK;
        return isBack == (_frontFace.get() == osg::FrontFace::COUNTER_CLOCKWISE) ? CulledFace::Clockwise
                                                                                 : CulledFace::CounterClockwise;
    }

private:
    InheritedValue<bool> _isOn{false};
    InheritedValue<osg::CullFace::Mode> _cullFace{osg::CullFace::BACK};
    InheritedValue<osg::FrontFace::Mode> _frontFace{osg::FrontFace::COUNTER_CLOCKWISE};
};

} // namespace

CulledFace culledFaceOf(osgUtil::CullVisitor& visitor, const osg::StateSet* own)
{
    // Further state sets will be pushed for these.
    if (!visitor.getCurrentCullingSet().getStateFrustumList().empty()) { return CulledFace::None; }
    std::vector<const osg::StateSet*> sets;
    if (own != nullptr) { sets.push_back(own); }
    for (const osgUtil::StateGraph* graph = visitor.getCurrentStateGraph(); graph != nullptr; graph = graph->_parent) {
        if (graph->getStateSet() != nullptr) { sets.push_back(graph->getStateSet()); }
    }
    FaceState state;
    for (auto set = sets.rbegin(); set != sets.rend(); ++set) { state.push(**set); }
    return state.culled();
}

} // namespace osgTessLOD
