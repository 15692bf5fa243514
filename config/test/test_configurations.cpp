// Every shipped configuration is one that its node accepts, and the default file is what it says.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <vector>

#include "field_ros/node_params.hpp"
#include "field_ros/param_doc.hpp"
#include "field_ros/param_loader.hpp"
#include "gp_localize/params.hpp"

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

struct Loaded {
  field_ros::NodeParams node;
  gp_localize::GpLocalizeParams estimator;
};

Loaded load(const std::string& path) {
  Loaded loaded;
  field_ros::load_params(field_ros::ParamTree::from_yaml_file(path), loaded.node, loaded.estimator);
  return loaded;
}

TEST(Configurations, AreAcceptedByGpLocalize) {
  std::size_t count = 0;
  for (const char* folder : {"bags", "recordings"}) {
    for (const std::string& path : configurations(folder, ".gp_localize.yaml")) {
      ++count;
      Loaded loaded;
      ASSERT_NO_THROW(loaded = load(path)) << path;
      const auto& p = loaded.estimator;
      const auto& region = p.support.region;
      EXPECT_TRUE(p.initial_pose_x > region[0] && p.initial_pose_x < region[2] &&
                  p.initial_pose_y > region[1] && p.initial_pose_y < region[3])
          << path << ": the start is outside the support";
    }
  }
  EXPECT_GE(count, 6u);
}

/// The values of a tree by path, as text.
void flatten(const field_ros::ParamNode& node, const std::string& prefix,
             std::map<std::string, const field_ros::ParamNode*>& values) {
  for (const auto& [key, value] : node.members) {
    values[prefix + key] = &value;
    flatten(value, prefix + key + "/", values);
  }
}

TEST(Configurations, DefaultFileNamesEveryKeyWithItsDefault) {
  const auto shipped = field_ros::ParamTree::from_yaml_file("gp_localize.yaml");
  ASSERT_NO_THROW(load("gp_localize.yaml"));
  const auto docs =
      field_ros::document_params<gp_localize::GpLocalizeParams, field_ros::NodeParams>();
  std::map<std::string, const field_ros::ParamNode*> values;
  flatten(shipped.root(), "", values);
  for (const auto& doc : docs) {
    if (doc.path.find("NAME") != std::string::npos) continue;  // entries of dictionaries
    const auto found = values.find(doc.path);
    ASSERT_TRUE(found != values.end()) << doc.path << " is missing from gp_localize.yaml";
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

}  // namespace
