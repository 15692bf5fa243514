// A small picture in a corner of rviz's window.
#pragma once

#include <OgreMaterial.h>
#include <OgreTexture.h>

#include <QImage>
#include <string>

namespace Ogre {
class Overlay;
class PanelOverlayElement;
}  // namespace Ogre

namespace field_rviz_plugins {

class LegendOverlay {
 public:
  /// @param name unique in the process
  explicit LegendOverlay(const std::string& name);
  ~LegendOverlay();
  LegendOverlay(const LegendOverlay&) = delete;
  LegendOverlay& operator=(const LegendOverlay&) = delete;

  /// @param left, top place of the picture's corner in the window [pixels]
  void show(const QImage& picture, int left, int top);
  void hide();

 private:
  std::string name_;
  Ogre::Overlay* overlay_ = nullptr;
  Ogre::PanelOverlayElement* panel_ = nullptr;
  Ogre::MaterialPtr material_;
  Ogre::TexturePtr texture_;
};

}  // namespace field_rviz_plugins
