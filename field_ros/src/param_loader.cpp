#include "field_ros/param_loader.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "field_core/csv.hpp"

namespace field_ros {
namespace {

using field_core::DataError;
using field_core::format_number;
using field_core::Range;
using Kind = ParamNode::Kind;

// Insertions, deletions, substitutions and swaps of neighbours (optimal string alignment).
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      const std::size_t substituted = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, substituted});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

bool inside(double value, const Range& range) {
  return (range.open_low ? value > range.low : value >= range.low) && value <= range.high;
}

std::string join(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string unit_suffix(const char* unit) {
  const std::string text = unit;
  return text.empty() || text == "1" ? "" : " [" + text + "]";
}

// 100000, not the shorter 1e+05.
std::string plain_number(double value) {
  const bool whole = std::abs(value) < 1e15 && value == std::floor(value);
  return whole ? std::to_string(static_cast<long long>(value)) : format_number(value);
}

}  // namespace

std::string describe_range(const Range& range) {
  const bool low = std::isfinite(range.low), high = std::isfinite(range.high);
  if (low && high) {
    return (range.open_low ? "above " : "") + plain_number(range.low) + " to " +
           plain_number(range.high);
  }
  if (low) return (range.open_low ? "> " : ">= ") + plain_number(range.low);
  if (high) return "<= " + plain_number(range.high);
  return "";
}

std::string nearest_name(const std::string& name, const std::set<std::string>& known) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(1, name.size() / 3) + 1;
  for (const auto& candidate : known) {
    const std::size_t distance = edit_distance(name, candidate);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

void rethrow_with_location(const ParamTree& tree, const field_core::ParameterError& e) {
  throw DataError(tree.locate(e.key) + ": " + e.what());
}

namespace detail {

void KeyChecker::finish() const {
  for (const auto& member : node_.members) {
    if (known_.count(member.first)) continue;
    const std::string key = prefix_ + member.first;
    const std::string nearest = nearest_name(member.first, known_);
    std::string advice = "did you mean '" + nearest + "'?";
    if (nearest.empty()) {
      advice = "known here: " + join(std::vector<std::string>(known_.begin(), known_.end()));
    }
    throw DataError(tree_.locate(key) + ": parameter '" + key + "': is unknown; " + advice);
  }
}

void Loader::fail(const std::string& key, const ParamNode*, const std::string& problem) const {
  throw DataError(tree_.locate(key) + ": parameter '" + key + "': " + problem);
}

void Loader::rethrow(const field_core::ParameterError& e, const std::string& prefix) const {
  // A nested struct knows its keys, not where it is nested.
  if (e.key.compare(0, prefix.size(), prefix) == 0) rethrow_with_location(tree_, e);
  const std::string text = e.what(), start = "parameter '" + e.key + "': ";
  rethrow_with_location(tree_, {prefix + e.key, text.substr(std::min(start.size(), text.size()))});
}

const ParamNode* Loader::take(const char* key) {
  const bool required = required_ == key;
  required_.clear();
  const ParamNode* node = node_.find(key);
  if (node && node->kind == Kind::null) {
    fail(prefix_ + key, node, "has no value; write one, or remove the key");
  }
  if (!node && required)
    fail(prefix_ + key, nullptr, "is missing; it has no default, give it a value");
  return node;
}

void Loader::require_map(const std::string& key, const ParamNode& node) const {
  if (node.kind == Kind::map) return;
  fail(key, &node, node.describe() + " is not allowed; it must be a group of parameters");
}

const ParamNode* Loader::take_map(const char* key, bool needs_entries) {
  const bool required = required_ == key;
  const ParamNode* node = take(key);
  if (!node) return nullptr;
  require_map(prefix_ + key, *node);
  if (needs_entries && required && node->members.empty()) {
    fail(prefix_ + key, node, "is empty; it needs at least one entry");
  }
  return node;
}

const ParamNode* Loader::take_list(const char* key) {
  const bool required = required_ == key;
  const ParamNode* node = take(key);
  if (!node) return nullptr;
  if (node->kind != Kind::list || (required && node->items.empty())) {
    fail(prefix_ + key, node,
         (node->kind == Kind::list ? "an empty list" : node->describe()) +
             " is not allowed; it must be a list of groups: [{...}, {...}]");
  }
  return node;
}

double Loader::finite_number(const std::string& key, const ParamNode& node, const Range& range,
                             const char* unit) const {
  const std::string limits = describe_range(range);
  const std::string allowed = "it must be " + (limits.empty() ? "a finite number" : limits);
  if (node.kind == Kind::text && !node.text.empty() &&
      node.text.find_first_not_of("0123456789+-.eE") == std::string::npos) {
    fail(key, &node,
         node.describe() +
             " is not a number; remove the quotes (rosparam takes 1e-3 for "
             "text: write 1.0e-3)");
  }
  if (node.kind != Kind::integer && node.kind != Kind::real) {
    fail(key, &node, node.describe() + " is not a number; " + allowed + unit_suffix(unit));
  }
  if (!std::isfinite(node.real) || !inside(node.real, range)) {
    fail(key, &node, node.text + " is not allowed; " + allowed + unit_suffix(unit));
  }
  return node.real;
}

void Loader::number(const char* key, double& value, Range range, const char* unit, const char*) {
  if (const ParamNode* node = take(key)) value = finite_number(prefix_ + key, *node, range, unit);
}

void Loader::number(const char* key, int& value, Range range, const char* unit, const char*) {
  const ParamNode* node = take(key);
  if (!node) return;
  range.low = std::max<double>(range.low, std::numeric_limits<int>::min());
  range.high = std::min<double>(range.high, std::numeric_limits<int>::max());
  if (node->kind == Kind::real) {
    fail(prefix_ + key, node,
         node->text + " is not a whole number; it must be " + describe_range(range));
  }
  value = static_cast<int>(finite_number(prefix_ + key, *node, range, unit));
}

void Loader::flag(const char* key, bool& value, const char*) {
  const ParamNode* node = take(key);
  if (!node) return;
  if (node->kind != Kind::boolean) {
    fail(prefix_ + key, node, node->describe() + " is not allowed; it must be true or false");
  }
  value = node->boolean;
}

void Loader::text(const char* key, std::string& value, const char*) {
  const ParamNode* node = take(key);
  if (!node) return;
  if (node->kind != Kind::text) {
    fail(prefix_ + key, node, node->describe() + " is not text; put it in quotes");
  }
  value = node->text;
}

void Loader::numbers(const char* key, std::vector<double>& value, field_core::Size size,
                     Range range, const char* unit, const char*) {
  const ParamNode* node = take(key);
  if (!node) return;
  const std::string name = prefix_ + key;
  if (node->kind != Kind::list) {
    fail(name, node,
         node->describe() + " is not allowed; it must be a list of numbers: [1.0, 2.0]");
  }
  const std::size_t n = node->items.size();
  if (n < size.low || n > size.high) {
    const std::string count = size.low == size.high ? std::to_string(size.low)
                              : n < size.low        ? "at least " + std::to_string(size.low)
                                                    : "at most " + std::to_string(size.high);
    fail(name, node, "has " + std::to_string(n) + " numbers; it must have " + count);
  }
  std::vector<double> loaded;
  for (const auto& item : node->items) loaded.push_back(finite_number(name, item, range, unit));
  value = std::move(loaded);
}

void Loader::points(const char* key, std::vector<Eigen::Vector2d>& value, const char* unit,
                    const char*) {
  const ParamNode* node = take(key);
  if (!node) return;
  const std::string name = prefix_ + key;
  if (node->kind != Kind::list) {
    fail(name, node,
         node->describe() + " is not allowed; it must be a list of points: [[x, y], ...]");
  }
  std::vector<Eigen::Vector2d> loaded;
  for (const auto& item : node->items) {
    if (item.kind != Kind::list || item.items.size() != 2) {
      fail(name, &item, "point " + std::to_string(loaded.size() + 1) + " is not a pair [x, y]");
    }
    loaded.emplace_back(finite_number(name, item.items[0], {}, unit),
                        finite_number(name, item.items[1], {}, unit));
  }
  value = std::move(loaded);
}

void Loader::texts(const char* key, std::vector<std::string>& value, const char*) {
  const ParamNode* node = take(key);
  if (!node) return;
  if (node->kind != Kind::list) {
    fail(prefix_ + key, node, node->describe() + " is not allowed; it must be a list: [a, b]");
  }
  std::vector<std::string> loaded;
  for (const auto& item : node->items) {
    if (item.kind != Kind::text) {
      fail(prefix_ + key, &item, item.describe() + " is not text; put it in quotes");
    }
    loaded.push_back(item.text);
  }
  value = std::move(loaded);
}

int Loader::choose(const char* key, const std::vector<std::string>& names) {
  const ParamNode* node = take(key);
  if (!node) return -1;
  const auto it = std::find(names.begin(), names.end(), node->text);
  if (node->kind != Kind::text || it == names.end()) {
    fail(prefix_ + key, node,
         node->describe() + " is not allowed; it must be one of " + join(names));
  }
  return static_cast<int>(it - names.begin());
}

}  // namespace detail
}  // namespace field_ros
