// Where sensors sit on the robot, from /tf_static and /tf of a bag.
#pragma once

#include <tf2/buffer_core.h>

#include <memory>
#include <optional>
#include <string>

#include "field_core/se2.hpp"
#include "field_core/stamp.hpp"
#include "field_ros/bag_input.hpp"

namespace field_ros {

/// Pose of `frame` in `base` at a time, projected onto the plane; nullopt if tf does not know it.
std::optional<field_core::SE2> lookup_placement(const tf2::BufferCore& buffer,
                                                const std::string& base, const std::string& frame,
                                                field_core::Stamp stamp);

/// Reads the transforms of the bag at the first question only: most bags need none.
class BagTransforms {
 public:
  explicit BagTransforms(const BagInput& input) : input_(input) {}
  std::optional<field_core::SE2> operator()(const std::string& base, const std::string& frame,
                                            field_core::Stamp stamp);

 private:
  void load();

  const BagInput& input_;
  std::unique_ptr<tf2::BufferCore> buffer_;
};

}  // namespace field_ros
