// SPDX-License-Identifier: MIT
// picking FILE.tlod: marks where a click meets the surface, and what is in the middle of the first picture.
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/MatrixTransform>
#include <osg/ShapeDrawable>
#include <osgDB/ReadFile>
#include <osgUtil/LineSegmentIntersector>
#include <osgViewer/Viewer>

#include <iostream>

namespace {

class Picker : public osgGA::GUIEventHandler {
public:
    explicit Picker(osg::MatrixTransform* marker)
        : _marker(marker)
    {
    }

    bool handle(const osgGA::GUIEventAdapter& event, osgGA::GUIActionAdapter& action) override
    {
        auto* view = dynamic_cast<osgViewer::View*>(&action);
        if (view == nullptr) { return false; }
        // Nothing here is special to TessLODDrawable: it is what finds any geometry.
        Hits hits;
        if (event.getEventType() == osgGA::GUIEventAdapter::FRAME && ++_frames == 2) {
            osg::Camera* camera = view->getCamera();
            const osg::Viewport* viewport = camera->getViewport();
            view->computeIntersections(camera, osgUtil::Intersector::WINDOW, viewport->x() + 0.5 * viewport->width(),
                                       viewport->y() + 0.5 * viewport->height(), hits);
            mark(hits);
        } else if (event.getEventType() == osgGA::GUIEventAdapter::PUSH) {
            view->computeIntersections(event, hits);
            mark(hits);
        }
        return false; // the manipulator wants the event, too
    }

private:
    using Hits = osgUtil::LineSegmentIntersector::Intersections;

    void mark(const Hits& hits)
    {
        for (const osgUtil::LineSegmentIntersector::Intersection& hit : hits) {
            if (dynamic_cast<const osgTessLOD::TessLODDrawable*>(hit.drawable.get()) == nullptr) { continue; }
            const osg::Vec3d p = hit.getWorldIntersectPoint();
            std::cout << "met the surface at " << p.x() << " " << p.y() << " " << p.z() << std::endl;
            _marker->setMatrix(osg::Matrixd::translate(p));
            _marker->setNodeMask(~0U);
            return;
        }
        std::cout << "missed the surface" << std::endl;
    }

    osg::ref_ptr<osg::MatrixTransform> _marker;
    int _frames = 0; // the first one's events come before its view
};

} // namespace

int main(int argc, char** argv)
{
    const osg::ref_ptr<osg::Node> model = argc > 1 ? osgDB::readRefNodeFile(argv[1]) : nullptr;
    if (!model) {
        std::cerr << "usage: picking FILE.tlod\n";
        return 1;
    }
    const float radius = 0.02F * model->getBound().radius();
    const osg::ref_ptr<osg::ShapeDrawable> ball = new osg::ShapeDrawable(new osg::Sphere(osg::Vec3(), radius));
    ball->setColor(osg::Vec4(1.0F, 0.2F, 0.1F, 1.0F));
    const osg::ref_ptr<osg::MatrixTransform> marker = new osg::MatrixTransform;
    marker->addChild(ball);
    marker->setNodeMask(0); // until something is met

    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    scene->addChild(model);
    scene->addChild(marker);
    osgViewer::Viewer viewer;
    viewer.setUpViewInWindow(50, 50, 1024, 768);
    viewer.setSceneData(scene);
    viewer.addEventHandler(new Picker(marker));
    return viewer.run();
}
