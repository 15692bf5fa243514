// Strict parameters: every way to be wrong is refused with the line and the key.
#include <XmlRpcValue.h>
#include <gtest/gtest.h>

#include "field_ros/node_params.hpp"
#include "field_ros/param_doc.hpp"
#include "field_ros/param_loader.hpp"
#include "test_support.hpp"

namespace {

using field_core::ParameterError;
using field_ros::load_params;
using field_ros::ParamTree;
using field_ros_test::error_of;

struct Inner {
  double width = 0.5;
  std::vector<double> scales = {1.0, 2.0};
  template <class Visitor>
  void visit(Visitor& v) {
    v.required("width").number("width", width, field_core::positive(), "m", "outer width");
    v.numbers("scales", scales, {2, 2}, field_core::positive(), "m", "two of them");
  }
  void validate() const {
    if (width > 100.0) throw ParameterError("width", "is wider than the world");
  }
};

enum class Shape { round, square };

struct Outer {
  int count = 10;
  bool fast = false;
  std::string label = "none";
  Shape shape = Shape::round;
  std::vector<Eigen::Vector2d> points;
  std::vector<std::string> robots = {"robot1"};
  Inner inner;
  std::map<std::string, Inner> fields;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("count", count, {1, 1000}, "1", "how many");
    v.flag("fast", fast, "quick and coarse");
    v.text("label", label, "a name");
    v.choice("shape", shape, {{"round", Shape::round}, {"square", Shape::square}}, "outline");
    v.points("points", points, "m", "places");
    v.texts("robots", robots, "names");
    v.group("inner", inner, "nested");
    v.dictionary("fields", fields, "by name");
  }
};

struct NeedsFields {
  std::map<std::string, Inner> fields;
  template <class Visitor>
  void visit(Visitor& v) {
    v.required("fields").dictionary("fields", fields, "by name");
  }
};

Outer load(const std::string& yaml) {
  const ParamTree tree = ParamTree::from_yaml_text(yaml, "config.yaml");
  Outer outer;
  field_ros::NodeParams node;
  load_params(tree, node, outer);
  return outer;
}

std::string refusal(const std::string& yaml) {
  return error_of([&yaml] { load(yaml); });
}

TEST(Params, LoadsEveryKindOfValue) {
  const Outer p = load(
      "count: 3\nfast: true\nlabel: abc\nshape: square\npoints: [[1, 2], [3.5, -4]]\n"
      "robots: [a, b]\ninner: {width: 2, scales: [3, 4.5]}\n"
      "fields:\n  light: {width: 1}\n  wifi: {width: 1e-2}\nodom_frame_id: wheel\n");
  EXPECT_EQ(3, p.count);
  EXPECT_TRUE(p.fast);
  EXPECT_EQ("abc", p.label);
  EXPECT_EQ(Shape::square, p.shape);
  ASSERT_EQ(2u, p.points.size());
  EXPECT_EQ(Eigen::Vector2d(3.5, -4.0), p.points[1]);
  EXPECT_EQ((std::vector<std::string>{"a", "b"}), p.robots);
  EXPECT_EQ(2.0, p.inner.width);  // an integer is a number
  EXPECT_EQ((std::vector<double>{3.0, 4.5}), p.inner.scales);
  ASSERT_EQ(2u, p.fields.size());
  EXPECT_EQ(0.01, p.fields.at("wifi").width);
}

TEST(Params, KeepsDefaultsOfWhatIsLeftOut) {
  const Outer p = load("");
  EXPECT_EQ(10, p.count);
  EXPECT_EQ(Shape::round, p.shape);
  EXPECT_EQ(0.5, p.inner.width);
}

TEST(Params, RefusalsNameLineKeyValueAndWhatIsAllowed) {
  EXPECT_EQ("config.yaml:3: parameter 'fields/light/width': -1 is not allowed; it must be > 0 [m]",
            refusal("fields:\n  light:\n    width: -1\n"));
  EXPECT_EQ("config.yaml:1: parameter 'count': 1.5 is not a whole number; it must be 1 to 1000",
            refusal("count: 1.5\n"));
  EXPECT_EQ("config.yaml:1: parameter 'count': 1001 is not allowed; it must be 1 to 1000",
            refusal("count: 1001\n"));
  EXPECT_EQ(
      "config.yaml:2: parameter 'shape': the text 'oval' is not allowed; it must be one of "
      "round, square",
      refusal("count: 1\nshape: oval\n"));
  EXPECT_EQ(
      "config.yaml:1: parameter 'inner/width': is missing; it has no default, give it a value",
      refusal("inner: {scales: [1, 2]}\n"));
}

TEST(Params, UnknownKeysGetTheNearestName) {
  EXPECT_EQ("config.yaml:1: parameter 'cuont': is unknown; did you mean 'count'?",
            refusal("cuont: 3\n"));
  EXPECT_EQ("config.yaml:2: parameter 'inner/widht': is unknown; did you mean 'width'?",
            refusal("inner:\n  widht: 3\n"));
  EXPECT_NE(std::string::npos,
            refusal("fields: {a: {width: 1, zzzzzz: 1}}").find("known here: scales, width"));
  // Known to one of the structs that share the tree is known.
  EXPECT_NE(std::string::npos, refusal("odom_frame: x").find("did you mean 'odom_frame_id'?"));
}

TEST(Params, WrongTypesAreRefused) {
  for (const char* yaml : {"inner: {width: \"400\"}",
                           "inner: {width: true}",
                           "inner: {width: [1]}",
                           "inner: {width: .nan}",
                           "inner: {width: .inf}",
                           "inner: {width: }",
                           "inner: {width: abc}",
                           "inner: 3",
                           "fast: 1",
                           "label: 5",
                           "count: \"3\"",
                           "points: [[1, 2, 3]]",
                           "points: [1, 2]",
                           "robots: a",
                           "robots: [1]",
                           "inner: {width: 1, scales: [1]}",
                           "inner: {width: 1, scales: [1, 2, 3]}",
                           "inner: {width: 1, scales: [1, .nan]}",
                           "fields: [1]",
                           "fields: {light: 3}",
                           "count: 99999999999999999999"}) {
    EXPECT_EQ(0u, refusal(yaml).find("config.yaml:1: parameter '")) << yaml;
  }
}

TEST(Params, RulesBetweenFieldsGetTheLineToo) {
  EXPECT_EQ("config.yaml:2: parameter 'fields/light/width': is wider than the world",
            refusal("fields:\n  light: {width: 200}\n"));
  EXPECT_EQ(
      0u,
      refusal("count: 2\nodom_frame_id: map\n").find("config.yaml:2: parameter 'odom_frame_id'"));
}

TEST(Params, RequiredDictionaryNeedsAnEntry) {
  const ParamTree tree = ParamTree::from_yaml_text("fields: {}", "c");
  NeedsFields params;
  EXPECT_NE(std::string::npos,
            error_of([&] { load_params(tree, params); }).find("at least one entry"));
}

struct Row {
  std::vector<Inner> rows = {Inner{}};
  template <class Visitor>
  void visit(Visitor& v) {
    v.list("rows", rows, "one after the other");
  }
};

TEST(Params, ListsOfGroupsAreLoadedAndCheckedLikeGroups) {
  const auto load_rows = [](const std::string& yaml) {
    Row p;
    load_params(ParamTree::from_yaml_text(yaml, "c.yaml"), p);
    return p.rows;
  };
  EXPECT_EQ(1u, load_rows("{}").size());
  EXPECT_EQ(0u, load_rows("rows: []").size());
  const auto rows = load_rows("rows: [{width: 3}, {width: 4, scales: [5, 6]}]");
  ASSERT_EQ(2u, rows.size());
  EXPECT_EQ(3.0, rows[0].width);
  EXPECT_EQ(6.0, rows[1].scales[1]);
  const auto refused = [&](const std::string& yaml) { return error_of([&] { load_rows(yaml); }); };
  EXPECT_EQ("c.yaml:3: parameter 'rows/2/width': -1 is not allowed; it must be > 0 [m]",
            refused("rows:\n- {width: 3}\n- {width: -1}"));
  EXPECT_EQ("c.yaml:3: parameter 'rows/2/widht': is unknown; did you mean 'width'?",
            refused("rows:\n- {width: 3}\n- {widht: 1}"));
  EXPECT_EQ("c.yaml:3: parameter 'rows/2/width': is wider than the world",
            refused("rows:\n- {width: 3}\n- {width: 101}"));
  EXPECT_NE(std::string::npos,
            refused("rows: {width: 3}").find("a list of groups: [{...}, {...}]"));
  EXPECT_NE(std::string::npos, refused("rows: [3]").find("'rows/1': 3 is not allowed"));
  const auto docs = field_ros::document_params<Row>();
  EXPECT_NE(std::string::npos,
            field_ros::commented_yaml(docs).find("rows: []\n#   -\n#     width"));
  EXPECT_NE(std::string::npos, field_ros::markdown_table(docs).find("`rows/NUMBER/width`"));
}

TEST(Params, BadFilesAreRefused) {
  EXPECT_NE(std::string::npos,
            refusal("count: 1\ncount: 2\n")
                .find("config.yaml:2: parameter 'count' is given twice (first in line 1)"));
  EXPECT_EQ(0u, refusal("count: [1\n").find("config.yaml:"));
  EXPECT_NE(std::string::npos, refusal("- 1\n").find("holds a list"));
  EXPECT_NE(std::string::npos, error_of([] {
                                 ParamTree::from_yaml_file("missing.yaml");
                               }).find("missing.yaml: cannot be read: No such file"));
  const field_ros_test::TemporaryDirectory directory;
  EXPECT_NE(std::string::npos,
            error_of([&] { ParamTree::from_yaml_file(directory / ""); }).find("cannot be read"));
  field_ros_test::write_file(directory / "empty.yaml", "");
  EXPECT_NO_THROW(ParamTree::from_yaml_file(directory / "empty.yaml"));
}

XmlRpc::XmlRpcValue rosparam() {
  XmlRpc::XmlRpcValue value;
  value["count"] = 3;
  value["fast"] = true;
  value["inner"]["width"] = 0.1;
  value["inner"]["scales"][0] = 1;
  value["inner"]["scales"][1] = 2.5;
  value["label"] = std::string("a \"b\"");
  return value;
}

TEST(Params, RosparamLoadsTheSameAndIsJustAsStrict) {
  Outer p;
  const ParamTree tree = ParamTree::from_rosparam(rosparam(), "/node");
  load_params(tree, p);
  EXPECT_EQ(3, p.count);
  EXPECT_EQ(0.1, p.inner.width);
  EXPECT_EQ((std::vector<double>{1.0, 2.5}), p.inner.scales);
  auto text = rosparam();
  text["inner"]["width"] = std::string("1e-3");
  const std::string message =
      error_of([&] { load_params(ParamTree::from_rosparam(text, "/node"), p); });
  EXPECT_EQ(0u, message.find("/node: parameter 'inner/width': the text '1e-3' is not a number;"));
  EXPECT_NO_THROW(ParamTree::from_rosparam(XmlRpc::XmlRpcValue(), "/node"));
}

TEST(Params, YamlOfRosparamReadsBackTheSame) {
  const ParamTree tree = ParamTree::from_rosparam(rosparam(), "/node");
  Outer p;
  load_params(ParamTree::from_yaml_text(tree.yaml(), "saved"), p);
  EXPECT_EQ(3, p.count);
  EXPECT_TRUE(p.fast);
  EXPECT_EQ(0.1, p.inner.width);
  EXPECT_EQ("a \"b\"", p.label);
}

TEST(Params, CommentedYamlIsAConfigurationWithTheDefaults) {
  const auto docs = field_ros::document_params<Outer, field_ros::NodeParams>();
  const std::string yaml = field_ros::commented_yaml(docs);
  EXPECT_NE(std::string::npos, yaml.find("# how many [1 to 1000]\ncount: 10\n"));
  EXPECT_NE(std::string::npos, yaml.find("  # outer width [m; > 0; required]\n#   width: 0.5\n"));
  EXPECT_NE(std::string::npos, yaml.find("#   NAME:\n#     width: 0.5  # outer width"));
  std::string filled = yaml;  // as a user would: take the comment mark off the required key
  filled.erase(filled.find("#   width"), 2);
  Outer p;
  field_ros::NodeParams node;
  load_params(ParamTree::from_yaml_text(filled, "printed"), p, node);
  EXPECT_EQ(10, p.count);
  EXPECT_EQ("map", node.global_frame_id);
  EXPECT_NE(std::string::npos, field_ros::markdown_table(docs).find(
                                   "| `fields/NAME/width` | required | m | > 0 | outer width |"));
}

TEST(Params, PrintedNumbersAreNumbersForRosparamToo) {  // 1e-08 is text in YAML 1.1
  EXPECT_EQ("1.0e-08", field_ros::detail::yaml_number(1e-8));
  EXPECT_EQ("1.5e-08", field_ros::detail::yaml_number(1.5e-8));
  EXPECT_EQ("0.5", field_ros::detail::yaml_number(0.5));
  EXPECT_EQ("-10", field_ros::detail::yaml_number(-10.0));
}

}  // namespace
