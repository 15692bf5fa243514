#include "bag_survey.hpp"

#include <field_msgs/FieldMeasurement.h>

#include <algorithm>
#include <cmath>

#include "field_core/errors.hpp"
#include "field_ros/bag_input.hpp"
#include "field_ros/bag_trajectory.hpp"
#include "field_ros/bag_transforms.hpp"
#include "field_ros/convert.hpp"
#include "field_ros/message_check.hpp"

namespace {

using field_core::DataError;

class Collector {
 public:
  Collector(const BagSurveyOptions& options, const field_ros::BagInput& input)
      : options_(options),
        truth_(field_ros::read_bag_trajectory(input, options.truth_topic)),
        placement_(input) {}

  void add(const field_msgs::FieldMeasurement& m) {
    const auto stamp = field_ros::from_ros(m.header.stamp);
    auto pose = field_core::pose_at(truth_, stamp);
    if (!pose || m.names.size() != m.values.size()) return;
    const std::string frame = field_ros::tf2_frame(m.header.frame_id);
    if (!frame.empty() && frame != options_.base_frame) {
      const auto place = placement_(options_.base_frame, frame, stamp);
      if (!place) {
        throw DataError(options_.bag + ": tf does not know frame '" + frame + "' in '" +
                        options_.base_frame + "'; give --base-frame, or add /tf_static");
      }
      pose = *pose * *place;
    }
    for (std::size_t i = 0; i < m.names.size(); ++i) {
      if (std::isfinite(m.values[i]) && wanted(m.names[i])) {
        survey_.add(m.names[i], pose->translation(), m.values[i]);
      }
    }
  }

  gp_localize::Survey build() const { return survey_.build(); }

 private:
  bool wanted(const std::string& name) const {
    const auto& all = options_.fields;
    return all.empty() || std::find(all.begin(), all.end(), name) != all.end();
  }

  const BagSurveyOptions& options_;
  field_core::Trajectory truth_;
  field_ros::BagTransforms placement_;
  gp_localize::SurveyBuilder survey_;
};

}  // namespace

gp_localize::Survey read_bag_survey(const BagSurveyOptions& options) {
  const field_ros::BagInput input(options.bag);
  input.require(options.field_topic, {"field_msgs/FieldMeasurement"});
  Collector collector(options, input);
  input.read({options.field_topic}, [&](const rosbag::MessageInstance& instance, double) {
    const auto message = instance.instantiate<field_msgs::FieldMeasurement>();
    if (!message) {
      throw DataError(options.bag + ": topic '" + options.field_topic +
                      "': its messages have another md5sum than this program's; try rosbag fix");
    }
    collector.add(*message);
  });
  const gp_localize::Survey survey = collector.build();
  if (survey.empty()) {
    throw DataError(options.bag + ": no measurement on '" + options.field_topic +
                    "' has truth on '" + options.truth_topic + "' at its stamp");
  }
  for (const std::string& name : options.fields) {
    if (!survey.count(name)) {
      throw DataError(options.bag + ": field '" + name + "' is not on '" + options.field_topic +
                      "'");
    }
  }
  return survey;
}
