#include "lab/map_command.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <pwd.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include "lab/interrupt.hpp"
#include "lab/medium.hpp"
#include "lab/process.hpp"

namespace swarmtalk::lab {
namespace {

constexpr int kWaitMs = 200;  // for a signal that came just before poll()

bool has(const char* variable) {
  const char* const value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

/// A browser is no program for root: it gets the user who typed sudo.
void open_in_browser(const std::string& address) {
  if (!has("DISPLAY") && !has("WAYLAND_DISPLAY")) return;
  if (find_program("xdg-open").empty()) return;
  std::vector<std::string> command{"xdg-open", address};
  SpawnOptions options;
  options.detached = true;
  options.output_file = "/dev/null";
  if (geteuid() == 0) {
    const char* const name = std::getenv("SUDO_USER");
    const passwd* const user = name != nullptr ? getpwnam(name) : nullptr;
    if (user == nullptr || user->pw_uid == 0) return;
    const std::string id = std::to_string(user->pw_uid);
    command.insert(command.begin(), {"setpriv", "--reuid=" + id,
                                     "--regid=" + std::to_string(user->pw_gid), "--init-groups"});
    options.environment = {std::string("HOME=") + user->pw_dir, "XDG_RUNTIME_DIR=/run/user/" + id};
  }
  spawn(command, options);
}

/// Of swarmtalk-view, if nobody says another one.
constexpr std::uint16_t kUsualPort = 8080;

bool is_free(std::uint16_t port) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return true;  // swarmtalk-view will say what is wrong
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool can = bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
                   listen(fd, 1) == 0;
  close(fd);
  return can;
}

/// Prints what comes, until its end, and passes on a termination that only this process got.
/// The first line names the page.
void pass_on(int from, pid_t child) {
  std::string first;
  bool has_opened = false;
  for (;;) {
    pollfd polled{from, POLLIN, 0};
    const int ready = poll(&polled, 1, kWaitMs);
    if (interrupted() != 0) kill(child, interrupted());
    if (ready <= 0) continue;
    std::array<char, 512> text{};
    const ssize_t count = read(from, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return;
    std::fwrite(text.data(), 1, static_cast<std::size_t>(count), stdout);
    std::fflush(stdout);
    if (has_opened) continue;
    first.append(text.data(), static_cast<std::size_t>(count));
    const std::size_t end = first.find('\n');
    if (end == std::string::npos) continue;
    has_opened = true;
    const std::size_t begin = first.find("http://");
    if (begin < end)
      open_in_browser(first.substr(begin, first.find_first_of(" \n", begin) - begin));
  }
}

}  // namespace

std::string find_view() {
  const std::filesystem::path here = own_folder();
  for (const auto& path : {here / "swarmtalk-view", here / "../view/swarmtalk-view"}) {
    std::error_code unknown;
    const bool is_file = std::filesystem::is_regular_file(path, unknown);
    if (is_file && access(path.c_str(), X_OK) == 0) return path.lexically_normal();
  }
  return find_program("swarmtalk-view");
}

int show_map(const State& state, const Robot& robot, const std::vector<std::string>& options) {
  if (medium_named(state.medium).is_elsewhere()) {
    throw std::runtime_error("robots of --medium " + state.medium +
                             " are in a virtual machine, where no browser comes; look with "
                             "`swarmtalk-lab exec " +
                             std::to_string(robot.number) + " -- swarmtalk-cli top`");
  }
  const std::string view = find_view();
  if (view.empty()) {
    throw std::runtime_error(
        "swarmtalk-view is missing: install the package of that name, or build the target of that "
        "name in this build folder");
  }
  std::array<int, 2> pipe_fds{};
  if (pipe2(pipe_fds.data(), O_CLOEXEC) != 0) throw std::runtime_error("pipe: out of descriptors");
  std::vector<std::string> command{view, "--socket", robot.socket};
  command.insert(command.end(), options.begin(), options.end());
  if (options.empty() && !is_free(kUsualPort)) command.insert(command.end(), {"--port", "0"});
  SpawnOptions spawn_options;
  spawn_options.output_fd = pipe_fds[1];
  spawn_options.keeps_errors = true;
  spawn_options.dies_with_parent = true;
  const pid_t child = spawn(command, spawn_options);
  close(pipe_fds[1]);
  pass_on(pipe_fds[0], child);
  close(pipe_fds[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return exit_code(status);
}

}  // namespace swarmtalk::lab
