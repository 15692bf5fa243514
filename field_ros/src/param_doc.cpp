#include "field_ros/param_doc.hpp"

#include "field_ros/param_loader.hpp"

namespace field_ros {
namespace detail {

// YAML 1.1, which rosparam reads, takes 1e-08 for text: a number has a point before its exponent.
std::string yaml_number(double value) {
  std::string text = field_core::format_number(value);
  const std::size_t exponent = text.find('e');
  if (exponent != std::string::npos && text.find('.') == std::string::npos) {
    text.insert(exponent, ".0");
  }
  return text;
}

std::string yaml_list(const std::vector<double>& values) {
  std::string text;
  for (const double v : values) text += (text.empty() ? "" : ", ") + yaml_number(v);
  return "[" + text + "]";
}

std::string yaml_points(const std::vector<Eigen::Vector2d>& points) {
  std::string text;
  for (const auto& p : points) text += (text.empty() ? "" : ", ") + yaml_list({p.x(), p.y()});
  return "[" + text + "]";
}

std::string yaml_texts(const std::vector<std::string>& texts) {
  std::string out;
  for (const auto& text : texts) {
    out += out.empty() ? "\"" : ", \"";
    for (const char c : text)
      out += (c == '"' || c == '\\') ? std::string("\\") + c : std::string(1, c);
    out += "\"";
  }
  return out;
}

std::string allowed_numbers(const field_core::Range& range, const field_core::Size& size) {
  std::string text = describe_range(range);
  if (size.low == 1 && size.high == 1) return text;
  if (size.low == size.high) {
    return std::to_string(size.low) + " numbers" + (text.empty() ? "" : ", each " + text);
  }
  return text.empty() ? text : "each " + text;
}

ParamDoc& Documenter::add(const char* key, const char* type, const std::string& value,
                          const char* unit, const std::string& allowed, const char* doc) {
  ParamDoc entry;
  entry.depth = depth_;
  entry.required = required_ == key;
  entry.key = key;
  entry.path = prefix_ + key;
  entry.type = type;
  entry.default_value = value;
  entry.unit = std::string(unit) == "1" ? "" : unit;
  entry.allowed = allowed;
  entry.doc = doc;
  required_.clear();
  docs_.push_back(std::move(entry));
  return docs_.back();
}

}  // namespace detail

namespace {

std::string facts(const ParamDoc& doc) {
  std::string text;
  const auto append = [&text](const std::string& fact) {
    if (!fact.empty()) text += (text.empty() ? "" : "; ") + fact;
  };
  append(doc.unit);
  append(doc.allowed);
  if (doc.required) append("required");
  return text.empty() ? "" : " [" + text + "]";
}

}  // namespace

std::string commented_yaml(const std::vector<ParamDoc>& docs) {
  std::string out;
  int commented_below = -1;  // depth of the dictionary or list whose entries are only shown
  for (const ParamDoc& doc : docs) {
    if (commented_below >= 0 && doc.depth <= commented_below) commented_below = -1;
    const bool shown_only = commented_below >= 0;
    // Below a dictionary there is the level of the user's name.
    const std::string indent(2 * (doc.depth + (shown_only ? 1 : 0)), ' ');
    const bool off = shown_only || doc.required;
    if (!shown_only) out += indent + "# " + doc.doc + facts(doc) + "\n";
    out += off ? "# " + indent + doc.key + ":" : indent + doc.key + ":";
    const bool many = doc.kind == ParamDoc::Kind::dictionary || doc.kind == ParamDoc::Kind::list;
    if (doc.kind != ParamDoc::Kind::group && !(off && many)) {
      out += " " + doc.default_value;
    }
    if (shown_only) out += "  # " + doc.doc + facts(doc);
    out += "\n";
    if (many && !shown_only) {
      commented_below = doc.depth;
      const bool named = doc.kind == ParamDoc::Kind::dictionary;
      out += "# " + std::string(2 * (doc.depth + 1), ' ') + (named ? "NAME:\n" : "-\n");
    }
  }
  return out;
}

std::string markdown_table(const std::vector<ParamDoc>& docs) {
  std::string out = "| parameter | default | unit | allowed | meaning |\n|---|---|---|---|---|\n";
  for (const ParamDoc& doc : docs) {
    const bool value = doc.kind == ParamDoc::Kind::value;
    out += "| `" + doc.path + "` | " +
           (doc.required ? "required"
            : value      ? "`" + doc.default_value + "`"
                         : "") +
           " | " + doc.unit + " | " + doc.allowed + " | " + doc.doc + " |\n";
  }
  return out;
}

}  // namespace field_ros
