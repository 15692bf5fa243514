// Strict reading of small CSV tables (all of the suite's logs) and whole-file writing.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "field_core/stamp.hpp"

namespace field_core {

/// A CSV file with a header line: cells as text, with the line each row came from.
class CsvTable {
 public:
  /// @throws DataError: unreadable, empty, no header, a column named twice, a row with another
  /// number
  ///         of cells (named by line)
  static CsvTable read(const std::string& path);
  /// The same for text already in memory; `name` stands for the file in errors. Cells may be quoted
  /// ("a,b", a doubled quote is one quote); line ends LF or CRLF; a UTF-8 mark and blank lines are
  /// skipped; blanks around a cell do not count.
  static CsvTable parse(const std::string& text, const std::string& name);

  const std::string& path() const { return path_; }
  const std::vector<std::string>& columns() const { return columns_; }
  std::size_t rows() const { return cells_.size(); }
  /// @throws DataError naming file, column and the columns that exist
  std::size_t column(const std::string& name) const;
  bool has_column(const std::string& name) const;

  const std::string& text(std::size_t row, std::size_t column) const { return cells_[row][column]; }
  bool empty(std::size_t row, std::size_t column) const { return cells_[row][column].empty(); }
  /// A finite number. @throws DataError "file:line: column 'x_m': 'nan' is not a finite number;
  /// ..."
  double number(std::size_t row, std::size_t column) const;
  Stamp stamp(std::size_t row, std::size_t column) const;
  std::size_t line(std::size_t row) const { return lines_[row]; }

 private:
  std::string path_;
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> cells_;
  std::vector<std::size_t> lines_;
};

/// Whole content of a file. @throws DataError naming the path and the system's reason
std::string read_file(const std::string& path);

/// A finite number that fills the whole text, whatever the locale; nullopt otherwise.
std::optional<double> parse_number(const std::string& text);

/// Shortest text that reads back as the same double.
std::string format_number(double value);

/// Writes a file whole or not at all: to a temporary name beside it, synced, then renamed. A path
/// that names a pipe or device (/dev/stdout) is written to, never replaced.
/// @throws DataError naming the path and the system's reason
void write_file_atomically(const std::string& path, const std::string& content);

}  // namespace field_core
