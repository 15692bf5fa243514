// Whole files: reading, and writing that leaves the old file or the new one, never a part.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"

namespace field_core {
namespace {

struct Descriptor {
  explicit Descriptor(int fd) : fd(fd) {}
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int fd;
};

DataError system_error(const char* what, const std::string& path, const char* remedy) {
  return DataError(std::string(what) + " '" + path + "': " + std::strerror(errno) + "; " + remedy);
}

bool write_all(int fd, const std::string& content) {
  std::size_t done = 0;
  while (done < content.size()) {
    const ssize_t n = ::write(fd, content.data() + done, content.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return true;
}

constexpr const char* kWriteRemedy = "check that the folder exists, may be written and has space";

void write_in_place(const std::string& path, const std::string& content) {
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (file.fd < 0 || !write_all(file.fd, content)) {
    throw system_error("cannot write", path, kWriteRemedy);
  }
}

mode_t permissions_of(const std::string& path) {
  struct stat info;
  if (::stat(path.c_str(), &info) == 0) return info.st_mode & 0777;
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return 0666 & ~mask;
}

// After a rename the folder's entry must reach the disk as well; some file systems cannot sync
// folders.
void sync_folder(const std::string& path) {
  auto folder = std::filesystem::path(path).parent_path();
  const Descriptor descriptor(
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor.fd >= 0) (void)::fsync(descriptor.fd);
}

}  // namespace

std::string read_file(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.fd < 0) throw system_error("cannot read", path, "check the path");
  std::string content;
  char buffer[1 << 16];
  for (;;) {
    const ssize_t n = ::read(file.fd, buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw system_error("cannot read", path, "check the path");
    if (n == 0) return content;
    content.append(buffer, static_cast<std::size_t>(n));
  }
}

void write_file_atomically(const std::string& path, const std::string& content) {
  std::error_code ignored;
  const auto status = std::filesystem::status(path, ignored);
  if (std::filesystem::is_directory(status)) {
    throw DataError("cannot write '" + path + "': it is a folder; name a file");
  }
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    return write_in_place(path, content);
  }
  // A link keeps pointing at its file: the file behind it is replaced.
  const auto resolved = std::filesystem::canonical(path, ignored);
  const std::string target = ignored ? path : resolved.string();
  std::string temporary = target + ".XXXXXX";
  Descriptor file(::mkostemp(temporary.data(), O_CLOEXEC));
  if (file.fd < 0) throw system_error("cannot write", path, kWriteRemedy);
  const bool written = write_all(file.fd, content) &&
                       ::fchmod(file.fd, permissions_of(target)) == 0 && ::fsync(file.fd) == 0 &&
                       ::rename(temporary.c_str(), target.c_str()) == 0;
  if (!written) {
    const auto error = system_error("cannot write", path, kWriteRemedy);
    ::unlink(temporary.c_str());
    throw error;
  }
  sync_folder(target);
}

}  // namespace field_core
