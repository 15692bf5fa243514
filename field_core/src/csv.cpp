#include "field_core/csv.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "field_core/errors.hpp"

namespace field_core {
namespace {

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string at(const std::string& name, std::size_t line) {
  return name + ":" + std::to_string(line) + ": ";
}

// A quoted cell that starts at `i` (on the quote); leaves `i` on the comma or end behind it.
std::string quoted_cell(const std::string& line, std::size_t& i, const std::string& where) {
  std::string cell;
  for (++i; i < line.size(); ++i) {
    if (line[i] != '"') {
      cell += line[i];
    } else if (i + 1 < line.size() && line[i + 1] == '"') {
      cell += line[i++];
    } else {
      const auto end = std::min(line.find(',', i), line.size());
      if (!trimmed(line.substr(i + 1, end - i - 1)).empty()) break;
      i = end;
      return cell;
    }
  }
  throw DataError(where +
                  "a quoted cell does not end at a comma; close the quotes on the same line");
}

std::vector<std::string> split(const std::string& line, const std::string& where) {
  std::vector<std::string> cells;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    const auto first = line.find_first_not_of(" \t", i);
    if (first != std::string::npos && line[first] == '"') {
      i = first;
      cells.push_back(quoted_cell(line, i, where));
    } else {
      const auto end = std::min(line.find(',', i), line.size());
      cells.push_back(trimmed(line.substr(i, end - i)));
      i = end;
    }
  }
  return cells;
}

void check_header(const std::vector<std::string>& columns, const std::string& where) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].empty()) {
      throw DataError(where + "column " + std::to_string(i + 1) +
                      " has no name; the first line must name every column");
    }
    if (std::find(columns.begin(), columns.begin() + i, columns[i]) != columns.begin() + i) {
      throw DataError(where + "column '" + columns[i] + "' is named twice; rename one");
    }
  }
}

}  // namespace

CsvTable CsvTable::read(const std::string& path) { return parse(read_file(path), path); }

CsvTable CsvTable::parse(const std::string& text, const std::string& name) {
  if (text.find('\0') != std::string::npos) {
    throw DataError(name + ": holds binary data; a CSV text file is needed");
  }
  CsvTable table;
  table.path_ = name;
  std::size_t begin = text.compare(0, 3, "\xEF\xBB\xBF") == 0 ? 3 : 0;
  for (std::size_t line = 1; begin < text.size(); ++line) {
    const auto end = std::min(text.find('\n', begin), text.size());
    const std::string content = trimmed(text.substr(begin, end - begin));
    begin = end + 1;
    if (content.empty()) continue;
    auto cells = split(content, at(name, line));
    if (table.columns_.empty()) {
      check_header(cells, at(name, line));
      table.columns_ = std::move(cells);
    } else if (cells.size() != table.columns_.size()) {
      throw DataError(at(name, line) + std::to_string(cells.size()) +
                      " cells, but the header names " + std::to_string(table.columns_.size()) +
                      " columns; give every row one cell per column");
    } else {
      table.cells_.push_back(std::move(cells));
      table.lines_.push_back(line);
    }
  }
  if (table.columns_.empty()) {
    throw DataError(name + ": is empty; a first line that names the columns is needed");
  }
  return table;
}

bool CsvTable::has_column(const std::string& name) const {
  return std::find(columns_.begin(), columns_.end(), name) != columns_.end();
}

std::size_t CsvTable::column(const std::string& name) const {
  const auto it = std::find(columns_.begin(), columns_.end(), name);
  if (it != columns_.end()) return static_cast<std::size_t>(it - columns_.begin());
  std::string there;
  for (const auto& c : columns_) there += (there.empty() ? "" : ",") + c;
  throw DataError(path_ + ": no column '" + name + "'; the header names " + there);
}

double CsvTable::number(std::size_t row, std::size_t column) const {
  const std::string& cell = text(row, column);
  if (const auto value = parse_number(cell)) return *value;
  throw DataError(at(path_, line(row)) + "column '" + columns_[column] + "': '" + cell +
                  "' is not a finite number; correct it or remove the row");
}

Stamp CsvTable::stamp(std::size_t row, std::size_t column) const {
  try {
    return parse_stamp(text(row, column));
  } catch (const DataError& error) {
    throw DataError(at(path_, line(row)) + "column '" + columns_[column] + "': " + error.what());
  }
}

std::optional<double> parse_number(const std::string& text) {
  const char* first = text.data();
  const char* last = first + text.size();
  // from_chars takes no plus; "+-1" stays wrong.
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') ++first;
  double value = 0.0;
  const auto result = std::from_chars(first, last, value);
  if (result.ec != std::errc() || result.ptr != last || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::string format_number(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

}  // namespace field_core
