#include "field_map_display.hpp"

#include <OgreManualObject.h>
#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/editable_enum_property.h>
#include <rviz/properties/enum_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/int_property.h>

#include <algorithm>
#include <pluginlib/class_list_macros.hpp>

#include "legend.hpp"
#include "texture.hpp"

namespace field_rviz_plugins {
namespace {

// A topic carries one message per field and drawing.
constexpr int kQueue = 200;

void draw_quad(Ogre::ManualObject& quad, const Ogre::Material& material, float width,
               float height) {
  quad.clear();
  quad.begin(material.getName(), Ogre::RenderOperation::OT_TRIANGLE_STRIP, material.getGroup());
  for (const auto& [x, y] : {std::pair(0.0F, 0.0F), {1.0F, 0.0F}, {0.0F, 1.0F}, {1.0F, 1.0F}}) {
    quad.position(x * width, y * height, 0.0F);
    quad.textureCoord(x, y);  // the picture's first row is the map's lowest
    quad.normal(0.0F, 0.0F, 1.0F);
  }
  quad.end();
}

}  // namespace

FieldMapDisplay::FieldMapDisplay() {
  static int count = 0;
  name_ = "FieldMapDisplay" + std::to_string(count++);
  make_properties();
}

void FieldMapDisplay::make_properties() {
  using namespace rviz;
  field_ = new EditableEnumProperty("Field", "", "Name of the field; empty: the first that comes.",
                                    this, SLOT(redraw()));
  connect(field_, &EditableEnumProperty::requestOptions, this, &FieldMapDisplay::list_fields);
  quantity_ =
      new EnumProperty("Quantity", "Mean", "What is shown of the field.", this, SLOT(redraw()));
  quantity_->addOption("Mean", static_cast<int>(Quantity::mean));
  quantity_->addOption("Standard deviation", static_cast<int>(Quantity::stddev));
  colours_ = new EnumProperty("Colours", "Sequential",
                              "Sequential (viridis), or diverging about zero for signed fields.",
                              this, SLOT(redraw()));
  colours_->addOption("Sequential", static_cast<int>(ColourMap::sequential));
  colours_->addOption("Diverging", static_cast<int>(ColourMap::diverging));
  automatic_range_ =
      new BoolProperty("Automatic Range", true,
                       "Colours span the values of the better known cells.", this, SLOT(redraw()));
  low_ = new FloatProperty("Low", 0.0F, "Value of the first colour.", this, SLOT(redraw()));
  high_ = new FloatProperty("High", 1.0F, "Value of the last colour.", this, SLOT(redraw()));
  opacity_ = new FloatProperty("Opacity", 0.9F, "Of the best known cell.", this, SLOT(redraw()));
  fade_ =
      new FloatProperty("Fade Unknown", 0.8F, "How much of its opacity the least known cell loses.",
                        this, SLOT(redraw()));
  for (FloatProperty* share : {opacity_, fade_}) {
    share->setMin(0.0F);
    share->setMax(1.0F);
  }
  smooth_ =
      new BoolProperty("Smooth", true, "Mix the colours between cells.", this, SLOT(redraw()));
  height_ = new FloatProperty("Height", -0.02F, "z of the picture in the map frame [m].", this,
                              SLOT(redraw()));
  legend_ =
      new BoolProperty("Legend", true, "Colour bar with the field's unit.", this, SLOT(redraw()));
  left_ = new IntProperty("Legend Left", 10, "From the window's left [pixels].", legend_,
                          SLOT(redraw()), this);
  top_ = new IntProperty("Legend Top", 10, "From the window's top [pixels].", legend_,
                         SLOT(redraw()), this);
}

FieldMapDisplay::~FieldMapDisplay() {
  if (!quad_) return;
  scene_manager_->destroyManualObject(quad_);
  Ogre::MaterialManager::getSingleton().remove(material_);
  remove_texture(texture_);
}

void FieldMapDisplay::onInitialize() {
  MFDClass::onInitialize();
  queue_size_property_->setInt(kQueue);
  material_ = make_flat_material(name_ + "Material");
  quad_ = scene_manager_->createManualObject(name_ + "Quad");
  scene_node_->attachObject(quad_);
  overlay_ = std::make_unique<LegendOverlay>(name_ + "Legend");
  overlay_->hide();
}

void FieldMapDisplay::onEnable() {
  MFDClass::onEnable();
  redraw();
}

void FieldMapDisplay::onDisable() {
  MFDClass::onDisable();
  if (overlay_) overlay_->hide();
}

void FieldMapDisplay::reset() {
  MFDClass::reset();
  maps_.clear();
  redraw();
}

void FieldMapDisplay::processMessage(const field_msgs::FieldMap::ConstPtr& message) {
  if (!is_complete(*message)) {
    setStatus(rviz::StatusProperty::Error, "Message",
              QString("The map of '%1' has not width * height means and variances")
                  .arg(QString::fromStdString(message->name)));
    return;
  }
  maps_[message->name] = message;
  if (shown() == message) redraw();
}

field_msgs::FieldMap::ConstPtr FieldMapDisplay::shown() const {
  const std::string wanted = field_->getStdString();
  const auto found = wanted.empty() ? maps_.begin() : maps_.find(wanted);
  return found == maps_.end() ? nullptr : found->second;
}

ImageOptions FieldMapDisplay::options() const {
  ImageOptions options;
  options.quantity = static_cast<Quantity>(quantity_->getOptionInt());
  options.colours = static_cast<ColourMap>(colours_->getOptionInt());
  options.automatic_range = automatic_range_->getBool();
  options.low = low_->getFloat();
  options.high = high_->getFloat();
  options.opacity = opacity_->getFloat();
  options.fade_unknown = fade_->getFloat();
  return options;
}

void FieldMapDisplay::redraw() {
  if (!quad_) return;
  low_->setHidden(automatic_range_->getBool());
  high_->setHidden(automatic_range_->getBool());
  const auto map = shown();
  if (!map) {
    quad_->clear();
    overlay_->hide();
    if (!maps_.empty()) {
      setStatus(rviz::StatusProperty::Warn, "Field", "No map of this name comes on the topic");
    }
    return;
  }
  const FieldImage image = draw(*map, options());
  show_picture(*map, image);
  show_legend(*map, image);
  setStatus(rviz::StatusProperty::Ok, "Field",
            QString::fromStdString(map->name + " [" + map->unit + "]"));
  context_->queueRender();
}

void FieldMapDisplay::show_picture(const field_msgs::FieldMap& map, const FieldImage& image) {
  texture_ = set_texture(*material_, texture_, name_ + "Texture", image.rgba.data(), image.width,
                         image.height);
  set_smooth(*material_, smooth_->getBool());
  draw_quad(*quad_, *material_, map.info.resolution * static_cast<float>(image.width),
            map.info.resolution * static_cast<float>(image.height));
  place();
}

void FieldMapDisplay::show_legend(const field_msgs::FieldMap& map, const FieldImage& image) {
  if (!legend_->getBool() || !isEnabled()) return overlay_->hide();
  const bool mean = options().quantity == Quantity::mean;
  overlay_->show(draw_legend(map.name + (mean ? "" : " (std. dev.)"), map.unit, options().colours,
                             image.low, image.high),
                 left_->getInt(), top_->getInt());
}

void FieldMapDisplay::place() {
  const auto map = shown();
  if (!map) return;
  geometry_msgs::Pose origin = map->info.origin;
  origin.position.z += height_->getFloat();
  Ogre::Vector3 position;
  Ogre::Quaternion orientation;
  const bool known = context_->getFrameManager()->transform(map->header.frame_id, ros::Time(),
                                                            origin, position, orientation);
  if (!known) {
    setStatus(rviz::StatusProperty::Error, "Transform",
              QString("No transform from '%1' to the fixed frame '%2'")
                  .arg(QString::fromStdString(map->header.frame_id), fixed_frame_));
    return;
  }
  setStatus(rviz::StatusProperty::Ok, "Transform", "OK");
  scene_node_->setPosition(position);
  scene_node_->setOrientation(orientation);
}

void FieldMapDisplay::update(float, float) { place(); }

void FieldMapDisplay::list_fields(rviz::EditableEnumProperty* property) {
  property->clearOptions();
  for (const auto& map : maps_) property->addOptionStd(map.first);
}

}  // namespace field_rviz_plugins

PLUGINLIB_EXPORT_CLASS(field_rviz_plugins::FieldMapDisplay, rviz::Display)
