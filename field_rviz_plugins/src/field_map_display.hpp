// rviz display of field_msgs/FieldMap.
#pragma once

#include <field_msgs/FieldMap.h>
#include <rviz/message_filter_display.h>

#include <map>
#include <memory>
#include <string>

#include "field_rviz_plugins/field_image.hpp"
#include "legend_overlay.hpp"

namespace Ogre {
class ManualObject;
}
namespace rviz {
class BoolProperty;
class EditableEnumProperty;
class EnumProperty;
class FloatProperty;
class IntProperty;
}  // namespace rviz

namespace field_rviz_plugins {

/// One field of a topic, on which the maps of all fields come, as a flat picture at z = Height with
/// a legend.
class FieldMapDisplay : public rviz::MessageFilterDisplay<field_msgs::FieldMap> {
  Q_OBJECT

 public:
  FieldMapDisplay();
  ~FieldMapDisplay() override;

  void reset() override;

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;
  void update(float wall_dt, float ros_dt) override;

 private Q_SLOTS:
  void redraw();
  void list_fields(rviz::EditableEnumProperty* property);

 private:
  void processMessage(const field_msgs::FieldMap::ConstPtr& message) override;
  void make_properties();
  ImageOptions options() const;
  /// The map to show; nullptr: none has come.
  field_msgs::FieldMap::ConstPtr shown() const;
  void show_picture(const field_msgs::FieldMap& map, const FieldImage& image);
  void show_legend(const field_msgs::FieldMap& map, const FieldImage& image);
  void place();

  rviz::EditableEnumProperty* field_;
  rviz::EnumProperty *quantity_, *colours_;
  rviz::BoolProperty *automatic_range_, *smooth_, *legend_;
  rviz::FloatProperty *low_, *high_, *opacity_, *fade_, *height_;
  rviz::IntProperty *left_, *top_;

  std::map<std::string, field_msgs::FieldMap::ConstPtr> maps_;
  std::string name_;  // of this display's Ogre objects
  Ogre::ManualObject* quad_ = nullptr;
  Ogre::MaterialPtr material_;
  Ogre::TexturePtr texture_;
  std::unique_ptr<LegendOverlay> overlay_;
};

}  // namespace field_rviz_plugins
