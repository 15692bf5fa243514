#include "field_ros/bag_transforms.hpp"

#include <tf2/exceptions.h>
#include <tf2_msgs/TFMessage.h>

#include "field_ros/convert.hpp"
#include "field_ros/message_check.hpp"

namespace field_ros {

std::optional<field_core::SE2> lookup_placement(const tf2::BufferCore& buffer,
                                                const std::string& base, const std::string& frame,
                                                field_core::Stamp stamp) {
  try {
    return from_transform(buffer.lookupTransform(base, frame, to_ros(stamp)).transform);
  } catch (const tf2::TransformException&) {
    return std::nullopt;
  }
}

void BagTransforms::load() {
  ros::Duration length(10.0);
  {
    rosbag::View view(input_.bag());
    length += view.getEndTime() - view.getBeginTime();
  }
  buffer_ = std::make_unique<tf2::BufferCore>(length);
  input_.read({"/tf", "/tf_static"}, [this](const rosbag::MessageInstance& message, double) {
    const auto transforms = message.instantiate<tf2_msgs::TFMessage>();
    if (!transforms) return;
    for (auto transform : transforms->transforms) {
      transform.header.frame_id = tf2_frame(transform.header.frame_id);
      transform.child_frame_id = tf2_frame(transform.child_frame_id);
      // tf2 itself refuses what is not finite or not normalized, and says so.
      buffer_->setTransform(transform, "bag", message.getTopic() == "/tf_static");
    }
  });
}

std::optional<field_core::SE2> BagTransforms::operator()(const std::string& base,
                                                         const std::string& frame,
                                                         field_core::Stamp stamp) {
  if (!buffer_) load();
  return lookup_placement(*buffer_, base, frame, stamp);
}

}  // namespace field_ros
