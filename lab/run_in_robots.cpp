#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <string>

#include "lab/interrupt.hpp"
#include "lab/lab.hpp"
#include "lab/medium.hpp"

namespace swarmtalk::lab {
namespace {

/// Output of one robot's command, cut into lines with the robot's number in front.
struct Stream {
  int fd = -1;
  std::string prefix;
  std::string partial;

  void take(const char* bytes, std::size_t size) {
    partial.append(bytes, size);
    std::size_t begin = 0;
    for (std::size_t end = 0; (end = partial.find('\n', begin)) != std::string::npos;) {
      print(partial.substr(begin, end - begin));
      begin = end + 1;
    }
    partial.erase(0, begin);
  }

  void finish() {
    if (!partial.empty()) print(partial);
    close(fd);
    fd = -1;
  }

  void print(const std::string& line) const {
    std::printf("%s%s\n", prefix.c_str(), line.c_str());
    std::fflush(stdout);
  }
};

void copy_until_closed(std::vector<Stream>& streams, const std::vector<pid_t>& children) {
  std::vector<pollfd> polls(streams.size());
  for (;;) {
    std::size_t open_count = 0;
    for (std::size_t i = 0; i < streams.size(); ++i) {
      polls[i] = {streams[i].fd, POLLIN, 0};
      if (streams[i].fd >= 0) ++open_count;
    }
    if (open_count == 0) return;
    if (poll(polls.data(), polls.size(), -1) < 0) {
      // A terminal's Ctrl-C reaches the commands by itself; a second one does no harm.
      if (interrupted() != 0) {
        for (const pid_t child : children) kill(child, interrupted());
      }
      continue;
    }
    for (std::size_t i = 0; i < streams.size(); ++i) {
      if (streams[i].fd < 0 || polls[i].revents == 0) continue;
      char buffer[4096];
      const ssize_t n = read(streams[i].fd, buffer, sizeof buffer);
      if (n > 0) {
        streams[i].take(buffer, static_cast<std::size_t>(n));
      } else if (n == 0 || errno != EINTR) {
        streams[i].finish();
      }
    }
  }
}

}  // namespace

int run_in_robots(const State& state, const std::vector<Robot>& robots,
                  const std::vector<std::string>& command, bool with_prefix) {
  if (robots.size() == 1) {
    SpawnOptions options;
    options.network_namespace = robots[0].network_namespace;
    options.environment = environment_of(state, robots[0]);
    execute(medium_named(state.medium).as_robot(state, robots[0], command), options);
  }
  std::vector<Stream> streams;
  std::vector<pid_t> children;
  const std::size_t width = std::to_string(robots.back().number).size();
  for (const Robot& robot : robots) {
    int fds[2];
    if (pipe2(fds, O_CLOEXEC) != 0) throw std::runtime_error("out of file descriptors");
    SpawnOptions options;
    options.network_namespace = robot.network_namespace;
    options.environment = environment_of(state, robot);
    options.output_fd = fds[1];
    options.dies_with_parent = true;
    const auto words = medium_named(state.medium).as_robot(state, robot, command);
    children.push_back(spawn(words, options));
    close(fds[1]);
    const std::string number = std::to_string(robot.number);
    const std::string padding(width > number.size() ? width - number.size() : 0, ' ');
    const std::string prefix = with_prefix ? "robot " + padding + number + " | " : "";
    streams.push_back({fds[0], prefix, {}});
  }
  copy_until_closed(streams, children);
  int result = 0;
  for (const pid_t child : children) {
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (result == 0) result = exit_code(status);
  }
  return result;
}

}  // namespace swarmtalk::lab
