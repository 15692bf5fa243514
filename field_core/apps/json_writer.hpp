// Writes JSON: numbers exactly (shortest text that reads back the same), null for what is not
// finite.
#pragma once

#include <string>
#include <vector>

namespace field_eval {

/// One object from construction to finish(); keys in the order of the calls.
class JsonWriter {
 public:
  void number(const std::string& key, double value);
  void numbers(const std::string& key, const std::vector<double>& values);
  void text(const std::string& key, const std::string& value);
  void begin_list(const std::string& key);
  void begin_object();  ///< inside a list
  void end_object();
  void end_list();
  std::string finish();

 private:
  void item(const std::string& key);

  std::string text_ = "{";
  int depth_ = 1;
  bool first_ = true;
};

}  // namespace field_eval
