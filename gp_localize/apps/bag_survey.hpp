// Measurements of a bag at the places where the robot really was.
#pragma once

#include <string>
#include <vector>

#include "gp_localize/survey.hpp"

struct BagSurveyOptions {
  std::string bag;
  std::string truth_topic = "/ground_truth";
  std::string field_topic = "/field";
  std::string base_frame = "base_link";
  std::vector<std::string> fields;  ///< empty: all
};

/// Every reading of the field topic that has truth at its stamp, at the place of its sensor.
/// @throws DataError naming bag and topic
gp_localize::Survey read_bag_survey(const BagSurveyOptions& options);
