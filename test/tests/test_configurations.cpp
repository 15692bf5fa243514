// Every shipped configuration is one that its node accepts, and the default file is what it says.
// Paths are relative to this package.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <vector>

#include "field_ros/node_params.hpp"
#include "field_ros/param_doc.hpp"
#include "field_ros/param_loader.hpp"
#include "gmrf_slap/params.hpp"
#include "gp_localize/params.hpp"
#include "vector_field_slam/params.hpp"

namespace {

namespace fs = std::filesystem;

std::vector<std::string> configurations(const std::string& folder, const std::string& ending) {
  std::vector<std::string> paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string path = entry.path().string();
    if (path.size() > ending.size() && path.substr(path.size() - ending.size()) == ending) {
      paths.push_back(path);
    }
  }
  return paths;
}

template <class Params>
Params load(const std::string& path) {
  field_ros::NodeParams node;
  Params params;
  field_ros::load_params(field_ros::ParamTree::from_yaml_file(path), node, params);
  return params;
}

TEST(Configurations, AreAcceptedByGpLocalize) {
  std::size_t count = 0;
  for (const char* folder : {"../config/bags", "../config/recordings"}) {
    for (const std::string& path : configurations(folder, ".gp_localize.yaml")) {
      ++count;
      gp_localize::GpLocalizeParams p;
      ASSERT_NO_THROW(p = load<gp_localize::GpLocalizeParams>(path)) << path;
      const auto& region = p.support.region;
      EXPECT_TRUE(p.initial_pose_x > region[0] && p.initial_pose_x < region[2] &&
                  p.initial_pose_y > region[1] && p.initial_pose_y < region[3])
          << path << ": the start is outside the support";
    }
  }
  EXPECT_GE(count, 6u);
}

TEST(Configurations, AreAcceptedByVectorFieldSlam) {
  std::size_t count = 0;
  for (const char* folder : {"../config/bags", "../config/recordings"}) {
    for (const std::string& path : configurations(folder, ".vector_field_slam.yaml")) {
      ++count;
      EXPECT_NO_THROW(load<vector_field_slam::VectorFieldSlamParams>(path)) << path;
    }
  }
  EXPECT_GE(count, 1u);
}

TEST(Configurations, AreAcceptedByGmrfSlap) {
  std::size_t count = 0;
  for (const char* folder : {"../config/bags", "../config/recordings"}) {
    for (const std::string& path : configurations(folder, ".gmrf_slap.yaml")) {
      ++count;
      gmrf_slap::GmrfSlapParams p;
      ASSERT_NO_THROW(p = load<gmrf_slap::GmrfSlapParams>(path)) << path;
      const auto& grid = p.grid;
      EXPECT_TRUE(p.initial_pose_x > grid.origin[0] && p.initial_pose_y > grid.origin[1] &&
                  p.initial_pose_x < grid.origin[0] + grid.spacing * (grid.size[0] - 1) &&
                  p.initial_pose_y < grid.origin[1] + grid.spacing * (grid.size[1] - 1))
          << path << ": the start is outside the grid";
    }
  }
  EXPECT_GE(count, 2u);
}

/// The values of a tree by path, as text.
void flatten(const field_ros::ParamNode& node, const std::string& prefix,
             std::map<std::string, const field_ros::ParamNode*>& values) {
  for (const auto& [key, value] : node.members) {
    values[prefix + key] = &value;
    flatten(value, prefix + key + "/", values);
  }
}

template <class Params>
void expect_every_key_with_its_default(const std::string& file) {
  const auto shipped = field_ros::ParamTree::from_yaml_file(file);
  ASSERT_NO_THROW(load<Params>(file));
  const auto docs = field_ros::document_params<Params, field_ros::NodeParams>();
  std::map<std::string, const field_ros::ParamNode*> values;
  flatten(shipped.root(), "", values);
  for (const auto& doc : docs) {
    // Entries of dictionaries and lists.
    if (doc.path.find("NAME") != std::string::npos) continue;
    if (doc.path.find("NUMBER") != std::string::npos) continue;
    const auto found = values.find(doc.path);
    ASSERT_TRUE(found != values.end()) << doc.path << " is missing from " << file;
    if (doc.kind != field_ros::ParamDoc::Kind::value) continue;
    const auto expected =
        field_ros::ParamTree::from_yaml_text("value: " + doc.default_value, "default");
    const field_ros::ParamNode &a = *found->second, &b = *expected.root().find("value");
    const auto number = [](const field_ros::ParamNode& n) {
      return n.kind == field_ros::ParamNode::Kind::integer ? static_cast<double>(n.integer)
                                                           : n.real;
    };
    EXPECT_EQ(number(a), number(b)) << doc.path;
    EXPECT_EQ(a.boolean, b.boolean) << doc.path;
    EXPECT_EQ(a.items.size(), b.items.size()) << doc.path;
    if (b.kind == field_ros::ParamNode::Kind::text) {
      EXPECT_EQ(a.text, b.text) << doc.path;
    }
    for (std::size_t i = 0; i < std::min(a.items.size(), b.items.size()); ++i) {
      EXPECT_EQ(number(a.items[i]), number(b.items[i])) << doc.path;
    }
  }
}

TEST(Configurations, DefaultFilesNameEveryKeyWithItsDefault) {
  expect_every_key_with_its_default<gp_localize::GpLocalizeParams>("../config/gp_localize.yaml");
  expect_every_key_with_its_default<vector_field_slam::VectorFieldSlamParams>(
      "../config/vector_field_slam.yaml");
  expect_every_key_with_its_default<gmrf_slap::GmrfSlapParams>("../config/gmrf_slap.yaml");
}

}  // namespace
