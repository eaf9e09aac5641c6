// SPDX-License-Identifier: MIT
#pragma once

#include <osg/Notify>
#include <osg/ref_ptr>

#include <mutex>
#include <string>

namespace osgTessLOD {

/// Collects what OSG warns of, GL errors included, while it lives.
class WarningCollector {
public:
    WarningCollector()
        : _before(osg::getNotifyHandler())
    {
        osg::setNotifyHandler(_handler.get());
    }
    ~WarningCollector() { osg::setNotifyHandler(_before.get()); }
    WarningCollector(const WarningCollector&) = delete;
    WarningCollector& operator=(const WarningCollector&) = delete;

    std::string text() const
    {
        const std::lock_guard<std::mutex> lock(_handler->mutex);
        return _handler->text;
    }

private:
    struct Handler : osg::NotifyHandler {
        void notify(osg::NotifySeverity severity, const char* message) override
        {
            const std::lock_guard<std::mutex> lock(mutex);
            if (severity <= osg::WARN) { text += message; }
        }
        mutable std::mutex mutex;
        std::string text;
    };
    osg::ref_ptr<Handler> _handler = new Handler;
    osg::ref_ptr<osg::NotifyHandler> _before;
};

} // namespace osgTessLOD
