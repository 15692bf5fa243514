// Strict loading of Params structs (field_core/params.hpp) from a ParamTree.
//
//   ParamTree tree = ParamTree::from_yaml_file("config.yaml");
//   NodeParams node;
//   gp_localize::GpLocalizeParams params;
//   load_params(tree, node, params);   // several structs share one tree
//
// Errors are DataErrors of one line: "config.yaml:12: parameter 'fields/light/noise_stddev': -1 is
// not allowed; it must be > 0 [field unit]". Refused are: unknown keys (with the nearest known
// one), missing required keys, wrong types (an integer is a number too; "400" in quotes is not),
// values that are not finite or out of range, wrong lengths of lists, and what the structs' own
// validate() refuses.
#pragma once

#include <Eigen/Core>
#include <map>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "field_core/errors.hpp"
#include "field_core/params.hpp"
#include "field_ros/param_tree.hpp"

namespace field_ros {

/// "> 0", "0 to 1", ...; empty if every number is allowed.
std::string describe_range(const field_core::Range& range);

/// The known name nearest to a misspelt one (edit distance at most 1/3 of its length), or "".
std::string nearest_name(const std::string& name, const std::set<std::string>& known);

namespace detail {

template <class T, class = void>
struct HasValidate : std::false_type {};
template <class T>
struct HasValidate<T, std::void_t<decltype(std::declval<const T&>().validate())>> : std::true_type {
};

/// Visitor: collects the keys of structs and refuses the members of a map that are none of them.
class KeyChecker {
 public:
  KeyChecker(const ParamTree& tree, const ParamNode& node, std::string prefix)
      : tree_(tree), node_(node), prefix_(std::move(prefix)) {}

  KeyChecker& required(const char*) { return *this; }
  template <class Number>
  void number(const char* key, Number&, field_core::Range, const char*, const char*) {
    known_.insert(key);
  }
  template <class... Args>
  void flag(const char* key, Args&&...) {
    known_.insert(key);
  }
  template <class... Args>
  void text(const char* key, Args&&...) {
    known_.insert(key);
  }
  void numbers(const char* key, std::vector<double>&, field_core::Size, field_core::Range,
               const char*, const char*) {
    known_.insert(key);
  }
  template <class... Args>
  void points(const char* key, Args&&...) {
    known_.insert(key);
  }
  template <class... Args>
  void texts(const char* key, Args&&...) {
    known_.insert(key);
  }
  template <class E>
  void choice(const char* key, E&, const field_core::Choices<E>&, const char*) {
    known_.insert(key);
  }

  template <class Struct>
  void group(const char* key, Struct&, const char*) {
    known_.insert(key);
    if (const ParamNode* node = node_.find(key)) check<Struct>(*node, prefix_ + key + "/");
  }
  template <class Struct>
  void dictionary(const char* key, std::map<std::string, Struct>&, const char*) {
    known_.insert(key);
    const ParamNode* node = node_.find(key);
    if (!node) return;
    for (const auto& entry : node->members) {
      check<Struct>(entry.second, prefix_ + key + "/" + entry.first + "/");
    }
  }

  template <class Struct>
  void list(const char* key, std::vector<Struct>&, const char*) {
    known_.insert(key);
    const ParamNode* node = node_.find(key);
    if (!node) return;
    for (std::size_t i = 0; i < node->items.size(); ++i) {
      check<Struct>(node->items[i], prefix_ + key + "/" + std::to_string(i + 1) + "/");
    }
  }

  /// @throws DataError naming the first unknown key
  void finish() const;

 private:
  template <class Struct>
  void check(const ParamNode& node, const std::string& prefix) const {
    KeyChecker nested(tree_, node, prefix);
    Struct scratch;
    scratch.visit(nested);
    nested.finish();
  }

  const ParamTree& tree_;
  const ParamNode& node_;
  std::string prefix_;
  std::set<std::string> known_;
};

/// Visitor: writes the values of the tree into a struct.
class Loader {
 public:
  Loader(const ParamTree& tree, const ParamNode& node, std::string prefix)
      : tree_(tree), node_(node), prefix_(std::move(prefix)) {}

  Loader& required(const char* key) {
    required_ = key;
    return *this;
  }
  void number(const char* key, int& value, field_core::Range range, const char* unit, const char*);
  void number(const char* key, double& value, field_core::Range range, const char* unit,
              const char*);
  void flag(const char* key, bool& value, const char*);
  void text(const char* key, std::string& value, const char*);
  void numbers(const char* key, std::vector<double>& value, field_core::Size size,
               field_core::Range range, const char* unit, const char*);
  void points(const char* key, std::vector<Eigen::Vector2d>& value, const char* unit, const char*);
  void texts(const char* key, std::vector<std::string>& value, const char*);
  template <class E>
  void choice(const char* key, E& value, const field_core::Choices<E>& choices, const char*) {
    std::vector<std::string> names;
    for (const auto& c : choices) names.emplace_back(c.first);
    const int index = choose(key, names);
    if (index >= 0) value = choices[static_cast<std::size_t>(index)].second;
  }
  template <class Struct>
  void group(const char* key, Struct& value, const char*) {
    if (const ParamNode* node = take_map(key)) load(value, *node, prefix_ + key + "/");
  }
  template <class Struct>
  void dictionary(const char* key, std::map<std::string, Struct>& value, const char*) {
    const ParamNode* node = take_map(key, true);
    if (!node) return;
    value.clear();
    for (const auto& entry : node->members) {
      const std::string name = prefix_ + key + "/" + entry.first;
      require_map(name, entry.second);
      load(value[entry.first], entry.second, name + "/");
    }
  }

  template <class Struct>
  void list(const char* key, std::vector<Struct>& value, const char*) {
    const ParamNode* node = take_list(key);
    if (!node) return;
    std::vector<Struct> loaded(node->items.size());
    for (std::size_t i = 0; i < loaded.size(); ++i) {
      const std::string name = prefix_ + key + "/" + std::to_string(i + 1);
      require_map(name, node->items[i]);
      load(loaded[i], node->items[i], name + "/");
    }
    value = std::move(loaded);
  }

  /// Loads a struct with all that is nested in it, then asks its validate().
  template <class Struct>
  void load(Struct& value, const ParamNode& node, const std::string& prefix) const {
    Loader nested(tree_, node, prefix);
    value.visit(nested);
    if constexpr (HasValidate<Struct>::value) {
      try {
        value.validate();
      } catch (const field_core::ParameterError& e) {
        rethrow(e, prefix);
      }
    }
  }

 private:
  /// The node of a key; nullptr if it is not given. @throws DataError if it is required then
  const ParamNode* take(const char* key);
  const ParamNode* take_map(const char* key, bool needs_entries = false);
  const ParamNode* take_list(const char* key);
  void require_map(const std::string& key, const ParamNode& node) const;
  int choose(const char* key, const std::vector<std::string>& names);
  double finite_number(const std::string& key, const ParamNode& node,
                       const field_core::Range& range, const char* unit) const;
  [[noreturn]] void fail(const std::string& key, const ParamNode* node,
                         const std::string& problem) const;
  [[noreturn]] void rethrow(const field_core::ParameterError& e, const std::string& prefix) const;

  const ParamTree& tree_;
  const ParamNode& node_;
  std::string prefix_;
  std::string required_;
};

}  // namespace detail

/// A ParameterError thrown later (by the estimator's constructor, ...) as a DataError with the line
/// of its key.
[[noreturn]] void rethrow_with_location(const ParamTree& tree, const field_core::ParameterError& e);

/// Loads structs that share one tree. @throws DataError as above
template <class... Structs>
void load_params(const ParamTree& tree, Structs&... structs) {
  detail::KeyChecker keys(tree, tree.root(), "");
  // Unknown keys first: a misspelt required key is then called misspelt, not missing.
  (Structs(structs).visit(keys), ...);
  keys.finish();
  const detail::Loader loader(tree, tree.root(), "");
  (loader.load(structs, tree.root(), ""), ...);
}

}  // namespace field_ros
