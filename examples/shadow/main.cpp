// SPDX-License-Identifier: MIT
// shadow FILE.tlod: a model above a floor of ordinary geometry, with the shadow that osgShadow makes of it.
#include <osg/Geometry>
#include <osg/LightSource>
#include <osgDB/ReadFile>
#include <osgShadow/ShadowMap>
#include <osgShadow/ShadowedScene>
#include <osgViewer/Viewer>

#include <iostream>

namespace {

constexpr unsigned kReceives = 1;
constexpr unsigned kCasts = 2;

/// A square below the model.
osg::ref_ptr<osg::Geometry> makeFloor(const osg::BoundingSphere& model)
{
    const float size = 3.0F * model.radius();
    const osg::Vec3 corner = model.center() + osg::Vec3(-0.5F * size, -0.5F * size, -model.radius());
    osg::ref_ptr<osg::Geometry> floor =
        osg::createTexturedQuadGeometry(corner, osg::Vec3(size, 0.0F, 0.0F), osg::Vec3(0.0F, size, 0.0F));
    floor->setNodeMask(kReceives);
    return floor;
}

} // namespace

int main(int argc, char** argv)
{
    // The plugin does what the example "minimal" does by hand.
    const osg::ref_ptr<osgDB::Options> options = new osgDB::Options("errorPixels=2");
    const osg::ref_ptr<osg::Node> model = argc > 1 ? osgDB::readRefNodeFile(argv[1], options) : nullptr;
    if (!model) {
        std::cerr << "usage: shadow FILE.tlod\n";
        return 1;
    }
    model->setNodeMask(kReceives | kCasts);
    const osg::BoundingSphere bounds = model->getBound();

    // The model's levels are those of the viewer's own view in the shadow, too: the surface that casts it is the one seen.
    const osg::ref_ptr<osgShadow::ShadowMap> shadow = new osgShadow::ShadowMap;
    shadow->setTextureSize(osg::Vec2s(2048, 2048));
    const osg::ref_ptr<osgShadow::ShadowedScene> scene = new osgShadow::ShadowedScene(shadow);
    scene->setReceivesShadowTraversalMask(kReceives);
    scene->setCastsShadowTraversalMask(kCasts);

    const osg::ref_ptr<osg::LightSource> lamp = new osg::LightSource;
    const osg::Vec3 place = bounds.center() + osg::Vec3(0.8F, -1.0F, 2.5F) * bounds.radius();
    lamp->getLight()->setPosition(osg::Vec4(place, 1.0F));
    lamp->getLight()->setDiffuse(osg::Vec4(0.9F, 0.9F, 0.85F, 1.0F));
    scene->addChild(lamp);
    shadow->setLight(lamp);
    scene->addChild(model);
    scene->addChild(makeFloor(bounds));

    osgViewer::Viewer viewer;
    viewer.setUpViewInWindow(50, 50, 1024, 768);
    viewer.setLightingMode(osg::View::NO_LIGHT); // the lamp is the only one
    viewer.setSceneData(scene);
    return viewer.run();
}
