#include "plot.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"
#include "report.hpp"
#include "subprocess.hpp"

namespace field_eval {
namespace {

using field_core::DataError;

constexpr const char* kScript = "plot_trajectory_errors.py";

// Installed, the script lies beside the program; in a build tree it is still in the sources.
std::string script_path() {
  std::error_code ignored;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
  for (const auto& folder :
       {program.parent_path(), std::filesystem::path(FIELD_EVAL_SOURCE_SCRIPTS)}) {
    if (std::filesystem::exists(folder / kScript, ignored)) return (folder / kScript).string();
  }
  throw DataError(std::string("cannot plot: ") + kScript + " is not beside " + program.string() +
                  "; install field_core again");
}

// A file of its own name that is gone when the object is.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& content) {
    path_ = (std::filesystem::temp_directory_path() / "field_eval.XXXXXX").string();
    const int fd = ::mkstemp(path_.data());
    if (fd < 0) throw DataError("cannot write '" + path_ + "': " + std::strerror(errno));
    ::close(fd);
    field_core::write_file_atomically(path_, content);
  }
  ~TemporaryFile() { ::unlink(path_.c_str()); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace

void plot(const Evaluation& evaluation, const PlotOptions& options) {
  const TemporaryFile data(plot_data(evaluation));
  // Debian's own python3, which has matplotlib, whatever python3 comes first on PATH.
  std::vector<std::string> command = {"/usr/bin/python3", script_path(), "--data",
                                      data.path(),        "--output",    options.output};
  if (!options.map.empty()) command.insert(command.end(), {"--map", options.map});
  if (!options.map_unit.empty()) command.insert(command.end(), {"--map-unit", options.map_unit});
  if (!options.title.empty()) command.insert(command.end(), {"--title", options.title});
  const auto result = run(command);
  if (result.exit_code == 127) {
    throw DataError("cannot plot: no /usr/bin/python3; install python3-matplotlib");
  }
  if (result.exit_code != 0) throw DataError("cannot plot: " + last_line(result.errors));
}

}  // namespace field_eval
