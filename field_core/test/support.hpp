// Helpers shared by the tests of field_core.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace field_core {
namespace test {

/// Error of central_differences for functions whose third derivatives are of order 1: step^2 of
/// truncation and epsilon / step of rounding, 1e-10 each, with room for values up to 100.
constexpr double kDifferenceError = 1e-8;

/// d f / d x by central differences.
template <class Function>
Eigen::Matrix3d central_differences(Function f, const Eigen::Vector3d& x) {
  constexpr double step = 1e-5;
  Eigen::Matrix3d jacobian;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(i);
    jacobian.col(i) = (f(x + d) - f(x - d)) / (2.0 * step);
  }
  return jacobian;
}

/// A folder of its own that is gone with the object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string path = (std::filesystem::temp_directory_path() / "field_core.XXXXXX").string();
    if (!::mkdtemp(path.data())) throw std::runtime_error("no temporary folder");
    path_ = path;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::string file(const std::string& name) const { return (path_ / name).string(); }
  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(file(name), std::ios::binary) << content;
    return file(name);
  }
  std::size_t count() const {
    const std::filesystem::directory_iterator entries(path_);
    return static_cast<std::size_t>(std::distance(begin(entries), end(entries)));
  }

 private:
  std::filesystem::path path_;
};

inline std::string content_of(const std::string& path) {
  std::ostringstream out;
  out << std::ifstream(path, std::ios::binary).rdbuf();
  return out.str();
}

/// Expects an Error whose one-line text contains all the parts.
template <class Error, class Function>
void expect_error(Function function, std::initializer_list<std::string> parts) {
  try {
    function();
    ADD_FAILURE() << "no error was raised";
  } catch (const Error& error) {
    const std::string text = error.what();
    for (const auto& part : parts) {
      EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' is not in: " << text;
    }
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  }
}

}  // namespace test
}  // namespace field_core
