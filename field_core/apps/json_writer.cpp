#include "json_writer.hpp"

#include <cmath>
#include <cstdio>

#include "field_core/csv.hpp"

namespace field_eval {
namespace {

std::string number_text(double value) {
  return std::isfinite(value) ? field_core::format_number(value) : "null";
}

std::string quoted(const std::string& value) {
  std::string text = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') {
      text += '\\';
      text += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\u%04x", c);
      text += escape;
    } else {
      text += c;
    }
  }
  return text + "\"";
}

}  // namespace

void JsonWriter::item(const std::string& key) {
  text_ += (first_ ? "\n" : ",\n") + std::string(2 * static_cast<std::size_t>(depth_), ' ');
  if (!key.empty()) text_ += quoted(key) + ": ";
  first_ = false;
}

void JsonWriter::number(const std::string& key, double value) {
  item(key);
  text_ += number_text(value);
}

void JsonWriter::numbers(const std::string& key, const std::vector<double>& values) {
  item(key);
  text_ += '[';
  for (std::size_t i = 0; i < values.size(); ++i) {
    text_ += (i == 0 ? "" : ", ") + number_text(values[i]);
  }
  text_ += ']';
}

void JsonWriter::text(const std::string& key, const std::string& value) {
  item(key);
  text_ += quoted(value);
}

void JsonWriter::begin_list(const std::string& key) {
  item(key);
  text_ += '[';
  ++depth_;
  first_ = true;
}

void JsonWriter::begin_object() {
  item("");
  text_ += '{';
  ++depth_;
  first_ = true;
}

void JsonWriter::end_object() {
  --depth_;
  text_ += "\n" + std::string(2 * static_cast<std::size_t>(depth_), ' ') + "}";
  first_ = false;
}

void JsonWriter::end_list() {
  --depth_;
  text_ += "\n" + std::string(2 * static_cast<std::size_t>(depth_), ' ') + "]";
  first_ = false;
}

std::string JsonWriter::finish() { return text_ + "\n}\n"; }

}  // namespace field_eval
