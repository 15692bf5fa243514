#include "field_ros/reconfigure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "field_core/csv.hpp"
#include "field_ros/param_loader.hpp"

namespace field_ros {
namespace {

using dynamic_reconfigure::Config;
using dynamic_reconfigure::ConfigDescription;
using field_core::ParameterError;
using field_core::Range;

constexpr double kDrawnInfinity = 1e9;

template <class List, class Value>
void append(List& list, const char* key, Value value) {
  typename List::value_type item;
  item.name = key;
  item.value = static_cast<decltype(item.value)>(value);
  list.push_back(item);
}

// Visitor: the values as a Config.
struct ToConfig {
  Config config;
  void number(const char* key, int& v, Range, const char*, const char*) {
    append(config.ints, key, v);
  }
  void number(const char* key, double& v, Range, const char*, const char*) {
    append(config.doubles, key, v);
  }
  void flag(const char* key, bool& v, const char*) { append(config.bools, key, v); }
};

// Visitor: the description, with the ends of the ranges.
struct Describer {
  ConfigDescription out;
  dynamic_reconfigure::Group group;

  void add(const char* key, const char* type, const std::string& doc) {
    dynamic_reconfigure::ParamDescription p;
    p.name = key;
    p.type = type;
    p.description = doc;
    group.parameters.push_back(p);
  }
  template <class List>
  void add_range(List& low, List& high, const char* key, const Range& range, double limit) {
    append(low, key, std::max(range.low, -limit));
    append(high, key, std::min(range.high, limit));
  }
  static std::string with_unit(const char* unit, const char* doc) {
    return std::string(unit) == "1" ? doc : std::string(doc) + " [" + unit + "]";
  }
  void number(const char* key, int&, Range range, const char* unit, const char* doc) {
    add(key, "int", with_unit(unit, doc));
    add_range(out.min.ints, out.max.ints, key, range, std::numeric_limits<int>::max());
  }
  void number(const char* key, double&, Range range, const char* unit, const char* doc) {
    add(key, "double", with_unit(unit, doc));
    add_range(out.min.doubles, out.max.doubles, key, range, kDrawnInfinity);
  }
  void flag(const char* key, bool&, const char* doc) {
    add(key, "bool", doc);
    append(out.min.bools, key, false);
    append(out.max.bools, key, true);
  }
};

// Visitor: takes the requested values; what no parameter has taken is refused.
struct Changer {
  const Config& request;
  std::set<std::string> taken, known;

  template <class List, class Value>
  bool find(const List& list, const char* key, Value& value) {
    known.insert(key);
    for (const auto& item : list) {
      if (item.name != key) continue;
      taken.insert(key);
      value = static_cast<Value>(item.value);
      return true;
    }
    return false;
  }
  template <class List, class Value>
  void change(const List& list, const char* key, Value& value, const Range& range) {
    Value wanted = value;
    if (!find(list, key, wanted)) return;
    const double v = static_cast<double>(wanted);
    const bool inside =
        std::isfinite(v) && v <= range.high && (range.open_low ? v > range.low : v >= range.low);
    if (!inside) {
      throw ParameterError(key, field_core::format_number(v) + " is not allowed; it must be " +
                                    describe_range(range));
    }
    value = wanted;
  }
  void number(const char* key, int& v, Range range, const char*, const char*) {
    change(request.ints, key, v, range);
  }
  void number(const char* key, double& v, Range range, const char*, const char*) {
    change(request.doubles, key, v, range);
  }
  void flag(const char* key, bool& v, const char*) { find(request.bools, key, v); }

  template <class List>
  void refuse_others(const List& list) const {
    for (const auto& item : list) {
      if (taken.count(item.name)) continue;
      const std::string nearest = nearest_name(item.name, known);
      throw ParameterError(item.name, known.count(item.name) ? "has another type"
                                      : nearest.empty()
                                          ? "cannot be changed while the node runs"
                                          : "is unknown; did you mean '" + nearest + "'?");
    }
  }
};

}  // namespace

ConfigDescription describe(const RuntimeParams& params) {
  RuntimeParams copy = params, defaults;
  Describer describer;
  copy.visit(describer);
  describer.group.name = "Default";
  describer.out.groups.push_back(describer.group);
  const Config values = to_config(defaults);
  describer.out.dflt = values;
  for (Config* config : {&describer.out.min, &describer.out.max}) config->groups = values.groups;
  return describer.out;
}

Config to_config(const RuntimeParams& params) {
  RuntimeParams copy = params;
  ToConfig visitor;
  copy.visit(visitor);
  dynamic_reconfigure::GroupState all;
  all.name = "Default";
  all.state = true;
  visitor.config.groups.push_back(all);
  return visitor.config;
}

RuntimeParams changed(RuntimeParams params, const Config& request) {
  Changer changer{request, {}, {}};
  params.visit(changer);
  changer.refuse_others(request.bools);
  changer.refuse_others(request.ints);
  changer.refuse_others(request.doubles);
  changer.refuse_others(request.strs);
  return params;
}

Reconfigure::Reconfigure(ros::NodeHandle& private_handle, const RuntimeParams& params,
                         std::function<void(const RuntimeParams&)> apply)
    : params_(params), apply_(std::move(apply)) {
  descriptions_ = private_handle.advertise<ConfigDescription>("parameter_descriptions", 1, true);
  updates_ = private_handle.advertise<Config>("parameter_updates", 1, true);
  descriptions_.publish(describe(params_));
  updates_.publish(to_config(params_));
  server_ = private_handle.advertiseService("set_parameters", &Reconfigure::on_request, this);
}

bool Reconfigure::on_request(dynamic_reconfigure::Reconfigure::Request& request,
                             dynamic_reconfigure::Reconfigure::Response& response) {
  try {
    params_ = changed(params_, request.config);
    apply_(params_);
    updates_.publish(to_config(params_));
  } catch (const ParameterError& e) {
    // The protocol has no place for a reason: the answer tells the unchanged values.
    ROS_WARN("set_parameters changes nothing: %s", e.what());
  }
  response.config = to_config(params_);
  return true;
}

}  // namespace field_ros
