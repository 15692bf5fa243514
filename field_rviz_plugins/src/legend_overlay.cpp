#include "legend_overlay.hpp"

#include <OgreMaterialManager.h>
#include <OgreTechnique.h>
#include <Overlay/OgreOverlay.h>
#include <Overlay/OgreOverlayManager.h>
#include <Overlay/OgrePanelOverlayElement.h>

#include "texture.hpp"

namespace field_rviz_plugins {

LegendOverlay::LegendOverlay(const std::string& name) : name_(name) {
  material_ = make_flat_material(name + "Material");
  auto& overlays = Ogre::OverlayManager::getSingleton();
  overlay_ = overlays.create(name + "Overlay");
  panel_ = static_cast<Ogre::PanelOverlayElement*>(
      overlays.createOverlayElement("Panel", name + "Panel"));
  panel_->setMetricsMode(Ogre::GMM_PIXELS);
  panel_->setMaterialName(material_->getName(), material_->getGroup());
  overlay_->add2D(panel_);
}

LegendOverlay::~LegendOverlay() {
  auto& overlays = Ogre::OverlayManager::getSingleton();
  overlays.destroy(overlay_);
  overlays.destroyOverlayElement(panel_);
  Ogre::MaterialManager::getSingleton().remove(material_);
  remove_texture(texture_);
}

void LegendOverlay::show(const QImage& picture, int left, int top) {
  const QImage rgba = picture.convertToFormat(QImage::Format_RGBA8888);
  texture_ = set_texture(*material_, texture_, name_ + "Texture", rgba.constBits(), rgba.width(),
                         rgba.height());
  panel_->setDimensions(static_cast<float>(rgba.width()), static_cast<float>(rgba.height()));
  panel_->setPosition(static_cast<float>(left), static_cast<float>(top));
  overlay_->show();
}

void LegendOverlay::hide() { overlay_->hide(); }

}  // namespace field_rviz_plugins
