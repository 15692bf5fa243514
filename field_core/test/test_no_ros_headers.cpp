// field_core knows nothing of ROS: every header it includes is its own, the standard library's, or
// of one of the few libraries listed here.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <string>

namespace {

TEST(Includes, OnlyLibrariesWithoutRos) {
  const std::set<std::string> folders = {"field_core", "Eigen", "CLI", "gtest", "sys"};
  const std::regex include(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  const std::regex ros(R"((ros|rosbag|roscpp|tf|tf2|ros_.*)\.h(pp)?)");
  std::size_t files = 0;
  for (const char* root : {"include", "src", "apps", "test"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
      const auto ending = entry.path().extension();
      if (ending != ".hpp" && ending != ".cpp" && ending != ".h") continue;
      ++files;
      std::ifstream in(entry.path());
      for (std::string line; std::getline(in, line);) {
        std::smatch match;
        if (!std::regex_search(line, match, include)) continue;
        const std::string header = match[1];
        const auto slash = header.find('/');
        if (slash == std::string::npos) {
          EXPECT_FALSE(std::regex_match(header, ros)) << entry.path() << " includes " << header;
        } else {
          EXPECT_TRUE(folders.count(header.substr(0, slash)))
              << entry.path() << " includes " << header << ", which is not on the list";
        }
      }
    }
  }
  EXPECT_GT(files, 30u) << "the test did not find the sources; run it in field_core's folder";
}

}  // namespace
