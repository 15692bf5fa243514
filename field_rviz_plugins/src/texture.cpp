#include "texture.hpp"

#include <OgreHardwarePixelBuffer.h>
#include <OgreMaterialManager.h>
#include <OgreResourceGroupManager.h>
#include <OgreTechnique.h>
#include <OgreTextureManager.h>

namespace field_rviz_plugins {
namespace {

const Ogre::String& kGroup = Ogre::ResourceGroupManager::DEFAULT_RESOURCE_GROUP_NAME;

Ogre::TextureUnitState& unit_of(Ogre::Material& material) {
  Ogre::Pass* pass = material.getTechnique(0)->getPass(0);
  return pass->getNumTextureUnitStates() > 0 ? *pass->getTextureUnitState(0)
                                             : *pass->createTextureUnitState();
}

}  // namespace

Ogre::MaterialPtr make_flat_material(const std::string& name) {
  Ogre::MaterialPtr material = Ogre::MaterialManager::getSingleton().create(name, kGroup);
  material->setReceiveShadows(false);
  material->setCullingMode(Ogre::CULL_NONE);
  Ogre::Technique* technique = material->getTechnique(0);
  technique->setLightingEnabled(false);
  technique->setSceneBlending(Ogre::SBT_TRANSPARENT_ALPHA);
  technique->setDepthWriteEnabled(false);
  return material;
}

Ogre::TexturePtr set_texture(Ogre::Material& material, Ogre::TexturePtr old,
                             const std::string& name, const std::uint8_t* rgba, int width,
                             int height) {
  const auto w = static_cast<std::uint32_t>(width), h = static_cast<std::uint32_t>(height);
  Ogre::TexturePtr texture = old;
  if (!texture || texture->getWidth() != w || texture->getHeight() != h) {
    remove_texture(texture);
    texture = Ogre::TextureManager::getSingleton().createManual(
        name, kGroup, Ogre::TEX_TYPE_2D, w, h, 0, Ogre::PF_BYTE_RGBA, Ogre::TU_DEFAULT);
    unit_of(material).setTextureName(texture->getName());
    unit_of(material).setTextureAddressingMode(Ogre::TextureUnitState::TAM_CLAMP);
  }
  auto* bytes = const_cast<std::uint8_t*>(rgba);  // PixelBox has no const form; it is only read
  texture->getBuffer()->blitFromMemory(Ogre::PixelBox(w, h, 1, Ogre::PF_BYTE_RGBA, bytes));
  return texture;
}

void set_smooth(Ogre::Material& material, bool smooth) {
  unit_of(material).setTextureFiltering(smooth ? Ogre::TFO_BILINEAR : Ogre::TFO_NONE);
}

void remove_texture(Ogre::TexturePtr& texture) {
  if (texture) Ogre::TextureManager::getSingleton().remove(texture);
  texture.reset();
}

}  // namespace field_rviz_plugins
