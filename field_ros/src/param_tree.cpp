#include "field_ros/param_tree.hpp"

#include <XmlRpcValue.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>

#include "field_core/errors.hpp"

namespace field_ros {
namespace {

using field_core::DataError;
using Kind = ParamNode::Kind;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool looks_decimal(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789+-.eE") == std::string::npos &&
         text.find_first_of("0123456789") != std::string::npos;
}

// The type that YAML gives to a scalar without quotes.
void resolve_plain(const std::string& text, ParamNode& node) {
  const std::string t = lower(text);
  if (t.empty() || t == "~" || t == "null") return;
  if (t == "true" || t == "yes" || t == "on" || t == "false" || t == "no" || t == "off") {
    node.kind = Kind::boolean;
    node.boolean = t == "true" || t == "yes" || t == "on";
    return;
  }
  node.kind = Kind::real;
  if (t == ".nan") {
    node.real = std::numeric_limits<double>::quiet_NaN();
  } else if (t == ".inf" || t == "+.inf" || t == "-.inf") {
    node.real = (t[0] == '-' ? -1.0 : 1.0) * std::numeric_limits<double>::infinity();
  } else {
    char* end = nullptr;
    errno = 0;
    const long long integer = std::strtoll(text.c_str(), &end, 10);
    if (looks_decimal(text) && *end == '\0' && errno == 0) {
      node.kind = Kind::integer;
      node.integer = integer;
      node.real = static_cast<double>(integer);
      return;
    }
    node.real = std::strtod(text.c_str(), &end);
    if (!looks_decimal(text) || *end != '\0') node.kind = Kind::text;
  }
}

ParamNode convert(const YAML::Node& yaml, const std::string& name) {
  ParamNode node;
  node.line = yaml.Mark().line + 1;
  if (yaml.IsScalar()) {
    node.text = yaml.Scalar();
    if (yaml.Tag() == "!") {
      node.kind = Kind::text;  // quoted
    } else {
      resolve_plain(node.text, node);
    }
  } else if (yaml.IsSequence()) {
    node.kind = Kind::list;
    for (const auto& item : yaml) node.items.push_back(convert(item, name));
  } else if (yaml.IsMap()) {
    node.kind = Kind::map;
    for (const auto& member : yaml) {
      const int line = member.first.Mark().line + 1;
      if (!member.first.IsScalar()) {
        throw DataError(name + ":" + std::to_string(line) + ": a key must be plain text");
      }
      const std::string& key = member.first.Scalar();
      if (const ParamNode* first = node.find(key)) {
        throw DataError(name + ":" + std::to_string(line) + ": parameter '" + key +
                        "' is given twice (first in line " + std::to_string(first->line) +
                        "); remove one");
      }
      node.members.emplace_back(key, convert(member.second, name));
      node.members.back().second.line = line;
    }
  }
  return node;
}

ParamNode convert(XmlRpc::XmlRpcValue& value) {
  ParamNode node;
  std::ostringstream text;
  text.precision(17);
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      node.kind = Kind::boolean;
      node.boolean = static_cast<bool&>(value);
      text << (node.boolean ? "true" : "false");
      break;
    case XmlRpc::XmlRpcValue::TypeInt:
      node.kind = Kind::integer;
      node.integer = static_cast<int&>(value);
      node.real = static_cast<double>(node.integer);
      text << node.integer;
      break;
    case XmlRpc::XmlRpcValue::TypeDouble:
      node.kind = Kind::real;
      node.real = static_cast<double&>(value);
      text << node.real;
      break;
    case XmlRpc::XmlRpcValue::TypeString:
      node.kind = Kind::text;
      text << static_cast<std::string&>(value);
      break;
    case XmlRpc::XmlRpcValue::TypeArray:
      node.kind = Kind::list;
      for (int i = 0; i < value.size(); ++i) node.items.push_back(convert(value[i]));
      break;
    case XmlRpc::XmlRpcValue::TypeStruct:
      node.kind = Kind::map;
      for (auto& member : value) node.members.emplace_back(member.first, convert(member.second));
      break;
    default:
      break;
  }
  node.text = text.str();
  return node;
}

void emit(const ParamNode& node, YAML::Emitter& out) {
  switch (node.kind) {
    case Kind::list:
      out << YAML::Flow << YAML::BeginSeq;
      for (const auto& item : node.items) emit(item, out);
      out << YAML::EndSeq;
      break;
    case Kind::map:
      out << YAML::BeginMap;
      for (const auto& member : node.members) {
        out << YAML::Key << member.first << YAML::Value;
        emit(member.second, out);
      }
      out << YAML::EndMap;
      break;
    case Kind::text:
      out << YAML::DoubleQuoted << node.text;
      break;
    case Kind::null:
      out << YAML::Null;
      break;
    default:
      out << node.text;
  }
}

}  // namespace

const ParamNode* ParamNode::find(const std::string& key) const {
  for (const auto& member : members) {
    if (member.first == key) return &member.second;
  }
  return nullptr;
}

std::string ParamNode::describe() const {
  switch (kind) {
    case Kind::null:
      return "nothing";
    case Kind::list:
      return "a list";
    case Kind::map:
      return "a group of parameters";
    case Kind::text:
      return "the text '" + text + "'";
    default:
      return text;
  }
}

ParamTree ParamTree::from_yaml_text(const std::string& text, const std::string& name) {
  ParamTree tree;
  tree.name_ = name;
  tree.yaml_ = text;
  try {
    const YAML::Node yaml = YAML::Load(text);
    if (yaml.IsNull()) {
      tree.root_.kind = Kind::map;
      return tree;
    }
    tree.root_ = convert(yaml, name);
  } catch (const YAML::Exception& e) {
    throw DataError(name + ":" + std::to_string(e.mark.line + 1) + ": not valid YAML: " + e.msg +
                    "; check indentation, brackets and colons there");
  }
  if (tree.root_.kind != Kind::map) {
    throw DataError(name + ": holds " + tree.root_.describe() + "; write 'key: value' lines");
  }
  return tree;
}

ParamTree ParamTree::from_yaml_file(const std::string& path) {
  errno = 0;
  std::ifstream file(path);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) {
    // An empty file also ends here: it reads no character.
    if (file.is_open() && text.str().empty() && errno == 0) return from_yaml_text("", path);
    throw DataError(path + ": cannot be read: " + std::strerror(errno ? errno : EIO) +
                    "; check the path of the configuration");
  }
  return from_yaml_text(text.str(), path);
}

ParamTree ParamTree::from_rosparam(XmlRpc::XmlRpcValue value, const std::string& name) {
  ParamTree tree;
  tree.name_ = name;
  tree.root_ = convert(value);
  if (tree.root_.kind == Kind::null) tree.root_.kind = Kind::map;
  if (tree.root_.kind != Kind::map) {
    throw DataError(name + ": holds " + tree.root_.describe() +
                    "; load a YAML of 'key: value' lines there");
  }
  YAML::Emitter out;
  emit(tree.root_, out);
  tree.yaml_ = out.c_str();
  return tree;
}

namespace {

/// Entry of a list by its number, counted from 1; nullptr if there is none.
const ParamNode* entry(const ParamNode& list, const std::string& number) {
  for (std::size_t i = 0; i < list.items.size(); ++i) {
    if (std::to_string(i + 1) == number) return &list.items[i];
  }
  return nullptr;
}

}  // namespace

std::string ParamTree::locate(const std::string& key) const {
  const ParamNode* node = &root_;
  int line = 0;
  std::istringstream parts(key);
  for (std::string part; node && std::getline(parts, part, '/');) {
    node = node->kind == ParamNode::Kind::list ? entry(*node, part) : node->find(part);
    if (node && node->line > 0) line = node->line;
  }
  return line > 0 ? name_ + ":" + std::to_string(line) : name_;
}

}  // namespace field_ros
