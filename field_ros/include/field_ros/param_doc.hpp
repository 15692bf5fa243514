// Documentation of Params structs, from the same declaration that loads and checks them.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "field_core/csv.hpp"
#include "field_core/params.hpp"

namespace field_ros {

/// One key; groups, dictionaries and lists come before what they hold, which is one level deeper.
struct ParamDoc {
  enum class Kind { value, group, dictionary, list };
  Kind kind = Kind::value;
  int depth = 0;
  bool required = false;
  std::string key;
  std::string path;           ///< "support/size"; "fields/NAME/...", "hyperparameters/NUMBER/..."
  std::string type;           ///< "number", "whole number", "text", ...
  std::string default_value;  ///< as YAML
  std::string unit;
  std::string allowed;
  std::string doc;
};

/// The parameters as a YAML file with their defaults, each under a comment; required ones and the
/// entries of dictionaries are commented out.
std::string commented_yaml(const std::vector<ParamDoc>& docs);
/// The parameters as a table for a README.
std::string markdown_table(const std::vector<ParamDoc>& docs);

namespace detail {

std::string yaml_number(double value);
std::string yaml_list(const std::vector<double>& values);
std::string yaml_points(const std::vector<Eigen::Vector2d>& points);
std::string yaml_texts(const std::vector<std::string>& texts);
std::string allowed_numbers(const field_core::Range& range, const field_core::Size& size);

/// Visitor: collects ParamDocs.
class Documenter {
 public:
  explicit Documenter(std::vector<ParamDoc>& docs, int depth = 0, std::string prefix = "")
      : docs_(docs), depth_(depth), prefix_(std::move(prefix)) {}

  Documenter& required(const char* key) {
    required_ = key;
    return *this;
  }
  void number(const char* key, int& v, field_core::Range r, const char* unit, const char* doc) {
    add(key, "whole number", std::to_string(v), unit, allowed_numbers(r, {1, 1}), doc);
  }
  void number(const char* key, double& v, field_core::Range r, const char* unit, const char* doc) {
    add(key, "number", yaml_number(v), unit, allowed_numbers(r, {1, 1}), doc);
  }
  void flag(const char* key, bool& v, const char* doc) {
    add(key, "flag", v ? "true" : "false", "", "true, false", doc);
  }
  void text(const char* key, std::string& v, const char* doc) {
    add(key, "text", yaml_texts({v}), "", "", doc);
  }
  void numbers(const char* key, std::vector<double>& v, field_core::Size size, field_core::Range r,
               const char* unit, const char* doc) {
    add(key, "list", yaml_list(v), unit, allowed_numbers(r, size), doc);
  }
  void points(const char* key, std::vector<Eigen::Vector2d>& v, const char* unit, const char* doc) {
    add(key, "list of [x, y]", yaml_points(v), unit, "", doc);
  }
  void texts(const char* key, std::vector<std::string>& v, const char* doc) {
    add(key, "list of text", "[" + yaml_texts(v) + "]", "", "", doc);
  }
  template <class E>
  void choice(const char* key, E& v, const field_core::Choices<E>& choices, const char* doc) {
    std::string value, allowed;
    for (const auto& c : choices) {
      allowed += (allowed.empty() ? "" : ", ") + std::string(c.first);
      if (c.second == v) value = c.first;
    }
    add(key, "choice", value, "", allowed, doc);
  }
  template <class Struct>
  void group(const char* key, Struct& v, const char* doc) {
    add(key, "group", "", "", "", doc).kind = ParamDoc::Kind::group;
    Documenter nested(docs_, depth_ + 1, prefix_ + key + "/");
    v.visit(nested);
  }
  template <class Struct>
  void dictionary(const char* key, std::map<std::string, Struct>&, const char* doc) {
    add(key, "by name", "{}", "", "", doc).kind = ParamDoc::Kind::dictionary;
    Documenter nested(docs_, depth_ + 1, prefix_ + key + "/NAME/");
    Struct defaults;
    defaults.visit(nested);
  }
  template <class Struct>
  void list(const char* key, std::vector<Struct>&, const char* doc) {
    add(key, "list of groups", "[]", "", "", doc).kind = ParamDoc::Kind::list;
    Documenter nested(docs_, depth_ + 1, prefix_ + key + "/NUMBER/");
    Struct defaults;
    defaults.visit(nested);
  }

 private:
  ParamDoc& add(const char* key, const char* type, const std::string& value, const char* unit,
                const std::string& allowed, const char* doc);

  std::vector<ParamDoc>& docs_;
  int depth_;
  std::string prefix_;
  std::string required_;
};

}  // namespace detail

template <class... Structs>
std::vector<ParamDoc> document_params() {
  std::vector<ParamDoc> docs;
  detail::Documenter documenter(docs);
  (Structs().visit(documenter), ...);
  return docs;
}

}  // namespace field_ros
