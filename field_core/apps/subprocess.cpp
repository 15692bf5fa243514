#include "subprocess.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <regex>
#include <sstream>

#include "field_core/errors.hpp"

namespace field_eval {
namespace {

using Pipe = std::array<int, 2>;

Pipe make_pipe() {
  Pipe ends;
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw field_core::DataError(std::string("cannot start a program: ") + std::strerror(errno));
  }
  return ends;
}

// Appends what there is to read; false at the end.
bool drain(int fd, std::string& text) {
  char buffer[1 << 16];
  const ssize_t n = ::read(fd, buffer, sizeof buffer);
  if (n > 0) text.append(buffer, static_cast<std::size_t>(n));
  return n > 0 || (n < 0 && errno == EINTR);
}

// Both pipes at once: a program that fills one while we read the other would wait for ever.
void collect(int output, int errors, ProcessResult& result) {
  std::array<pollfd, 2> polled = {pollfd{output, POLLIN, 0}, pollfd{errors, POLLIN, 0}};
  std::array<std::string*, 2> texts = {&result.output, &result.errors};
  while (polled[0].fd >= 0 || polled[1].fd >= 0) {
    if (::poll(polled.data(), polled.size(), -1) < 0 && errno != EINTR) break;
    for (std::size_t i = 0; i < polled.size(); ++i) {
      if (polled[i].fd >= 0 && polled[i].revents != 0 && !drain(polled[i].fd, *texts[i])) {
        polled[i].fd = -1;  // poll ignores it from now on
      }
    }
  }
}

}  // namespace

ProcessResult run(const std::vector<std::string>& arguments) {
  std::vector<char*> argv;
  for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const Pipe output = make_pipe(), errors = make_pipe();
  const pid_t child = ::fork();
  if (child < 0) {
    throw field_core::DataError(std::string("cannot start ") + arguments[0] + ": " +
                                std::strerror(errno));
  }
  if (child == 0) {
    ::dup2(output[1], STDOUT_FILENO);
    ::dup2(errors[1], STDERR_FILENO);
    ::execvp(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(output[1]);
  ::close(errors[1]);
  ProcessResult result;
  collect(output[0], errors[0], result);
  ::close(output[0]);
  ::close(errors[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

std::string last_line(const std::string& text) {
  static const std::regex colour("\x1b\\[[0-9;]*m");
  std::istringstream in(std::regex_replace(text, colour, ""));
  std::string last;
  for (std::string line; std::getline(in, line);) {
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  }
  return last;
}

}  // namespace field_eval
