// Pictures on flat surfaces: what the map and its legend share of Ogre.
#pragma once

#include <OgreMaterial.h>
#include <OgreTexture.h>

#include <cstdint>
#include <string>

namespace field_rviz_plugins {

/// Unlit, seen from both sides, transparent where the picture is.
Ogre::MaterialPtr make_flat_material(const std::string& name);

/// Shows a picture (rows of red, green, blue, alpha bytes, the upper one first) on the material.
/// The old texture is kept if the size is the same. @returns the texture in use
Ogre::TexturePtr set_texture(Ogre::Material& material, Ogre::TexturePtr old,
                             const std::string& name, const std::uint8_t* rgba, int width,
                             int height);
/// Between cells colours are mixed, or each cell is one square.
void set_smooth(Ogre::Material& material, bool smooth);
void remove_texture(Ogre::TexturePtr& texture);

}  // namespace field_rviz_plugins
