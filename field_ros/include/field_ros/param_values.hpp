// The values of loaded Params structs, to tell in what two configurations differ.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "field_ros/param_doc.hpp"

namespace field_ros {

/// Value as YAML by path ("fields/light/mean"); defaults included, whether written or not.
using ParamValues = std::map<std::string, std::string>;

namespace detail {

/// Visitor: lists the values.
class ValueLister {
 public:
  explicit ValueLister(ParamValues& values, std::string prefix = "")
      : values_(values), prefix_(std::move(prefix)) {}

  ValueLister& required(const char*) { return *this; }
  void number(const char* key, int& v, field_core::Range, const char*, const char*) {
    set(key, std::to_string(v));
  }
  void number(const char* key, double& v, field_core::Range, const char*, const char*) {
    set(key, yaml_number(v));
  }
  void flag(const char* key, bool& v, const char*) { set(key, v ? "true" : "false"); }
  void text(const char* key, std::string& v, const char*) { set(key, yaml_texts({v})); }
  void numbers(const char* key, std::vector<double>& v, field_core::Size, field_core::Range,
               const char*, const char*) {
    set(key, yaml_list(v));
  }
  void points(const char* key, std::vector<Eigen::Vector2d>& v, const char*, const char*) {
    set(key, yaml_points(v));
  }
  void texts(const char* key, std::vector<std::string>& v, const char*) {
    set(key, "[" + yaml_texts(v) + "]");
  }
  template <class E>
  void choice(const char* key, E& v, const field_core::Choices<E>& choices, const char*) {
    for (const auto& c : choices) {
      if (c.second == v) set(key, c.first);
    }
  }
  template <class Struct>
  void group(const char* key, Struct& v, const char*) {
    nest(key, v);
  }
  template <class Struct>
  void dictionary(const char* key, std::map<std::string, Struct>& v, const char*) {
    for (auto& [name, entry] : v) nest(std::string(key) + "/" + name, entry);
  }
  template <class Struct>
  void list(const char* key, std::vector<Struct>& v, const char*) {
    for (std::size_t i = 0; i < v.size(); ++i) nest(key + ("/" + std::to_string(i + 1)), v[i]);
  }

 private:
  void set(const char* key, const std::string& value) { values_[prefix_ + key] = value; }
  template <class Struct>
  void nest(const std::string& key, Struct& value) {
    ValueLister nested(values_, prefix_ + key + "/");
    value.visit(nested);
  }

  ParamValues& values_;
  std::string prefix_;
};

}  // namespace detail

template <class Struct>
ParamValues param_values(Struct params) {
  ParamValues values;
  detail::ValueLister lister(values);
  params.visit(lister);
  return values;
}

/// True for a parameter that says where the robot starts or how it moves (amcl's initial_*,
/// odom_alpha* and update_min_*): a map surveyed with one value of it is good for any other; or
/// that is one of, or in one of the groups, `free`.
bool may_differ_from_state(const std::string& path, const std::vector<std::string>& free = {});

/// "particles: 400 in the state, 100 here; ...", at most a few of them; "" if the values agree in
/// all that a state depends on.
std::string describe_differences(const ParamValues& state, const ParamValues& here,
                                 const std::vector<std::string>& free = {});

}  // namespace field_ros
