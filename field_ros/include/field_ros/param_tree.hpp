// Parameters as a tree, from a YAML file or from rosparam: the one form that the strict loader
// reads.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace XmlRpc {
class XmlRpcValue;
}

namespace field_ros {

/// One value of the tree, with the line it came from (0: unknown).
struct ParamNode {
  enum class Kind { null, boolean, integer, real, text, list, map };

  Kind kind = Kind::null;
  int line = 0;
  bool boolean = false;
  long long integer = 0;
  double real = 0.0;
  std::string text;                                        ///< of a scalar: as written
  std::vector<ParamNode> items;                            ///< of a list
  std::vector<std::pair<std::string, ParamNode>> members;  ///< of a map, in the order of the source

  const ParamNode* find(const std::string& key) const;
  /// "a list", "the text 'abc'", ... for messages.
  std::string describe() const;
};

/// A tree and the name of its source, which every message starts with.
class ParamTree {
 public:
  /// @throws DataError: unreadable file, YAML syntax, a key named twice, a root that is no map
  static ParamTree from_yaml_file(const std::string& path);
  static ParamTree from_yaml_text(const std::string& text, const std::string& name);
  /// @throws DataError if the value is neither a struct nor empty
  static ParamTree from_rosparam(XmlRpc::XmlRpcValue value, const std::string& name);

  const ParamNode& root() const { return root_; }
  const std::string& name() const { return name_; }
  /// The parameters as YAML (the file's text, or written from rosparam).
  const std::string& yaml() const { return yaml_; }

  /// "config.yaml:12" for a key such as "fields/light/mean"; of its nearest parent that exists.
  std::string locate(const std::string& key) const;

 private:
  std::string name_;
  std::string yaml_;
  ParamNode root_;
};

}  // namespace field_ros
