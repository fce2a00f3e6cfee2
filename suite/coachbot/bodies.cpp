// swarmtalk-suite-bodies SCENARIO FOLDER SWARMTALK-LAB COMMAND...: the simulated bodies of a lab's
// robots, in real time, for as long as COMMAND runs. Each robot's body takes commands at the socket
// FOLDER/body-INDEX (platforms/coachbot/body_port.hpp); where it is, the robot's daemon is told, as
// by a tracking system. Bodies stop at each other. Writes poses and contacts to
// FOLDER/bodies.jsonl.
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <deque>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "platforms/coachbot/body_port.hpp"
#include "platforms/coachbot/daemon_robot.hpp"
#include "platforms/recorder.hpp"
#include "sim/body.hpp"
#include "suite/coachbot/medium_port.hpp"
#include "suite/sim/program_main.hpp"
#include "suite/sim/scenario.hpp"

namespace {

using namespace swarmtalk;

constexpr uint64_t kPoseUs = 250000;  // between two poses of a moving robot in the log
// A busy machine may keep all programs waiting for seconds. Nobody could have stopped a body then,
// so none moves farther than in this time.
constexpr uint64_t kLongestStepUs = 2 * sim::kTickUs;

/// Sockets of a lab's daemons by robot, from `swarmtalk-lab status --json`.
std::vector<std::string> daemon_sockets(const std::string& lab_tool) {
  const std::string command = "'" + lab_tool + "' status --json";
  std::FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("cannot run " + command);
  std::string text;
  std::array<char, 4096> buffer;
  for (size_t n = 0; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
    text.append(buffer.data(), n);
  }
  if (pclose(pipe) != 0) throw std::runtime_error(command + " fails; run this with swarmtalk-lab");
  std::vector<std::string> sockets;
  for (size_t begin = 0, end = 0; (end = text.find('\n', begin)) != std::string::npos;
       begin = end + 1) {
    const auto robot = nlohmann::json::parse(text.substr(begin, end - begin));
    sockets.push_back(robot.at("socket").get<std::string>());
  }
  return sockets;
}

class Bodies {
 public:
  Bodies(const suite::Scenario& scenario, const std::string& folder,
         const std::vector<std::string>& daemons, std::FILE* log)
      : recorder_(log), noise_(sim::mix(scenario.seed + 1)) {
    if (daemons.size() != scenario.robots.size()) {
      throw std::runtime_error("the lab has " + std::to_string(daemons.size()) +
                               " robots, the scenario " + std::to_string(scenario.robots.size()));
    }
    for (size_t i = 0; i < daemons.size(); ++i) {
      const suite::Placement& place = scenario.robots[i];
      sites_.emplace_back(daemons[i], listen(folder + "/body-" + std::to_string(i)));
      Site& site = sites_.back();
      site.body = sim::Body(config_, place.x_mm, place.y_mm, place.theta_rad, noise_);
      tell(static_cast<uint32_t>(i));
    }
  }
  ~Bodies() {
    for (const Site& site : sites_) close(site.fd);
  }
  Bodies(const Bodies&) = delete;
  Bodies& operator=(const Bodies&) = delete;

  /// Takes commands and moves all bodies on to `now_us`.
  void step(uint64_t now_us, double seconds) {
    for (uint32_t i = 0; i < sites_.size(); ++i) {
      Site& site = sites_[i];
      take_commands(site, now_us);
      if (now_us - site.told_us >= platforms::kBodyStopsUs) site.body.drive(0, 0);
      if (site.body.is_driving()) {
        site.body.advance(config_, seconds, noise_);
        bool touches = false;
        for (const Site& other : sites_) {
          if (&other != &site) {
            touches |= sim::push_apart(site.body, other.body, config_.diameter_mm);
          }
        }
        site.contacts += touches;
        tell(i);
        write_pose(i, now_us);
      }
      (void)site.client.process();  // it reconnects by itself; a robot without daemon hears nothing
    }
  }

  /// @param stood_still_us  time in which this program was kept waiting and no body moved
  void finish(uint64_t now_us, uint64_t stood_still_us) {
    for (uint32_t i = 0; i < sites_.size(); ++i) {
      recorder_.event(now_us, i,
                      "\"event\":\"body\",\"contacts\":%u,\"refused\":%u,\"stood_still_ms\":%llu",
                      sites_[i].contacts, sites_[i].refused + (i == 0 ? medium_.refused() : 0),
                      static_cast<unsigned long long>(stood_still_us / 1000));
    }
  }

 private:
  struct Site {
    Site(const std::string& daemon, int body_fd)
        : client(Client::connected("swarmtalk-suite-bodies", options(daemon))), fd(body_fd) {}
    static ClientOptions options(const std::string& daemon) {
      ClientOptions result;
      result.socket_path = daemon;
      return result;
    }
    Client client;
    int fd;
    sim::Body body;
    uint64_t told_us = 0;
    uint64_t pose_us = 0;
    uint32_t contacts = 0;
    uint32_t refused = 0;  // commands that are none
  };

  static int listen(const std::string& path) {
    const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const sockaddr_un address = platforms::body_address(path);
    if (fd < 0 || bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error("cannot listen at " + path + ": " + std::strerror(errno));
    }
    return fd;
  }

  void take_commands(Site& site, uint64_t now_us) {
    char text[64];
    for (ssize_t n = 0; (n = recv(site.fd, text, sizeof text - 1, 0)) >= 0;) {
      text[n] = 0;
      int a = 0, b = 0, c = 0;
      if (std::sscanf(text, "vel %d %d", &a, &b) == 2 && std::abs(a) <= 100 && std::abs(b) <= 100) {
        site.body.drive(a / 100.0, b / 100.0);
        site.told_us = now_us;
      } else if (std::sscanf(text, "led %d %d %d", &a, &b, &c) != 3) {
        ++site.refused;
      }
    }
  }

  void tell(uint32_t index) {
    Site& site = sites_[index];
    medium_.put(index, site.body.x_mm, site.body.y_mm);
    site.client.set_fixed_pose(static_cast<float>(site.body.x_mm / 1000),
                               static_cast<float>(site.body.y_mm / 1000),
                               static_cast<float>(site.body.theta_rad));
  }

  void write_pose(uint32_t index, uint64_t now_us) {
    Site& site = sites_[index];
    if (now_us - site.pose_us < kPoseUs) return;
    site.pose_us = now_us;
    recorder_.pose(now_us, index, site.body.x_mm, site.body.y_mm, site.body.theta_rad);
  }

  platforms::Recorder recorder_;
  sim::Random noise_;
  sim::BodyConfig config_ = sim::coachbot_body();
  suite::MediumPort medium_;
  std::deque<Site> sites_;
};

/// An interrupt that comes before it is another program ends it, too.
pid_t start(char** command) {
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGINT);
  sigaddset(&ending, SIGTERM);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setsigdefault(&attributes, &ending);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  pid_t child = -1;
  const int error = posix_spawnp(&child, command[0], nullptr, &attributes, command, environ);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) throw std::runtime_error(std::string(command[0]) + ": " + std::strerror(error));
  return child;
}

/// @return exit code of the command
int run(const std::string& scenario_path, const std::string& folder, const std::string& lab_tool,
        char** command) {
  const suite::Scenario scenario = suite::read_scenario(scenario_path);
  suite::LogFile log(folder + "/bodies.jsonl");
  Bodies bodies(scenario, folder, daemon_sockets(lab_tool), log.get());
  const pid_t child = start(command);
  uint64_t last_us = platforms::DaemonRobot::time_us();
  uint64_t stood_still_us = 0;
  int status = 0;
  for (bool is_told = false; waitpid(child, &status, WNOHANG) == 0;) {
    if (suite::stopped != 0 && !is_told) kill(child, SIGINT);
    is_told = suite::stopped != 0;
    std::this_thread::sleep_for(std::chrono::microseconds(sim::kTickUs));
    const uint64_t now_us = platforms::DaemonRobot::time_us();
    const uint64_t moved_us = std::min(now_us - last_us, kLongestStepUs);
    stood_still_us += now_us - last_us - moved_us;
    bodies.step(now_us, static_cast<double>(moved_us) * 1e-6);
    last_us = now_us;
  }
  bodies.finish(last_us, stood_still_us);
  log.finish();
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr,
                 "usage: swarmtalk-suite-bodies SCENARIO FOLDER SWARMTALK-LAB COMMAND...\n");
    return 2;
  }
  return suite::program_main("swarmtalk-suite-bodies",
                             [argv] { return run(argv[1], argv[2], argv[3], argv + 4); });
}
