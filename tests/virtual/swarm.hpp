// A swarm of whole robots in one process, on a clock that the test turns: each has the daemon's
// parts (configuration, hub, stations, sessions), and programs with the client library. Nothing
// waits for the machine's time, and one seed gives one course of things. See docs/testing.md.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <swarmtalk/client.hpp>

#include "daemon/robot.hpp"
#include "tests/support/turned_clock.hpp"
#include "tests/virtual/air.hpp"
#include "tests/virtual/course.hpp"
#include "tests/virtual/machine.hpp"
#include "tests/virtual/virtual_log.hpp"

namespace swarmtalk::test {

/// A program of a robot. While time passes the swarm runs its client whenever that has something to
/// do; while one of its calls waits, the daemons run, and no program.
class VirtualProgram {
 public:
  VirtualProgram(int programs, const std::string& name, const std::string& socket);
  VirtualProgram(const VirtualProgram&) = delete;
  VirtualProgram& operator=(const VirtualProgram&) = delete;

  /// What comes on this channel is kept in heard(), from now on.
  void subscribe(const std::string& channel, const Policy& policy = {});
  /// How this channel's messages are sent; by default as advertise() does.
  void advertise(const std::string& channel, const Sending& sending = {});
  /// @throws Error  it was refused
  void send(const std::string& channel, const std::string& text,
            std::optional<std::uint32_t> ttl = {});

  /// "TEXT" of each message, in the order of their coming; "lost N" before one where N are missing.
  const std::vector<std::string>& heard() const { return heard_; }
  /// What the daemon has said of messages sent: how many have left, and how many never will.
  int sent() const { return sent_; }
  int failed() const { return failed_; }
  Client& client() { return client_; }

  /// Whether it runs: a program that does not reads nothing, as in a long computation.
  void set_running(bool is_running);

 private:
  int programs_;
  Client client_;
  std::vector<Subscriber> subscribers_;
  std::map<std::string, Publisher> publishers_;
  std::vector<std::string> heard_;
  int sent_ = 0;
  int failed_ = 0;
};

class Swarm;

class VirtualRobot {
 public:
  VirtualRobot(Swarm& swarm, int number, std::string configuration);

  /// Made when it is asked for first.
  VirtualProgram& program(const std::string& name);
  bool has_program(const std::string& name) const { return programs_.contains(name); }
  /// The program ends: its client says farewell.
  void end_program(const std::string& name) { programs_.erase(name); }
  void end_programs() { programs_.clear(); }
  /// It ends as by SIGKILL: what its socket has taken is there, and nothing more comes.
  void kill_program(const std::string& name);

  /// Of this link, as a program asks for it: "frames_sent".
  std::uint64_t counter(const std::string& name, const std::string& link = "air");

  /// The daemon ends, and starts.
  void stop();
  void start();
  /// Whether the daemon runs: one that does not stands still, as after SIGSTOP. What comes waits.
  void set_running(bool is_running) { machine_.set_running(is_running); }
  /// Sets its wall clock, forward or back.
  void step_wall_clock(std::chrono::nanoseconds step) {
    test::step_wall_clock(step, machine_.io());
  }
  /// What stands in its file from now on: it is read at the next start or reload.
  void configure(const std::string& configuration) { configuration_ = configuration; }
  /// What is done with them is of its machine.
  /// REQUIRES that it has started
  daemon::Robot& parts() {
    enter(machine_.io());
    return *robot_;
  }
  bool has_started() const { return robot_ != nullptr; }
  /// How often a timer has woken it.
  std::uint64_t wakeups() { return calls_of(machine_.io()); }
  Machine& machine() { return machine_; }
  std::string socket_path() const;

 private:
  Swarm& swarm_;
  int number_;
  std::string configuration_;
  Machine machine_;
  std::unique_ptr<daemon::Robot> robot_;
  std::map<std::string, std::unique_ptr<VirtualProgram>> programs_;
  std::vector<std::unique_ptr<VirtualProgram>> killed_;  // until the swarm ends: they do nothing
};

/// One at a time in a process.
class Swarm {
 public:
  /// @param seed  of all chance: the robots', the air's and that of cut streams
  explicit Swarm(std::uint64_t seed = 1);
  ~Swarm();
  Swarm(const Swarm&) = delete;
  Swarm& operator=(const Swarm&) = delete;

  /// Adds a robot with node id `number`, one link "air", and starts it.
  /// @param configuration  sections besides, and keys of [links.air] before the first of them; or,
  ///   if it begins with "[links.", all links of the robot: each, of any type, is on the air of
  ///   its name
  VirtualRobot& add(int number, Place place = {}, const std::string& configuration = "");
  VirtualRobot& robot(int number) { return *robots_.at(number); }

  /// Lets the time pass.
  void advance(std::chrono::nanoseconds duration);

  /// From now on this share of the reads and writes of programs' streams ends after 1 to `bytes`,
  /// drawn for each; the others are whole.
  void cut_streams(std::size_t bytes, double share = 1);

  /// The air of the links of this name, made when it is asked for first.
  Air& air(const std::string& link = "air");
  /// Lines of the daemons' logs of level warning and above.
  int warnings() const { return log_.warnings(); }
  /// All frames and all lines of the log until now, as a number.
  std::uint64_t course() const { return course_.value(); }
  /// Neither a robot's nor held.
  boost::asio::io_context& io() { return world_.io(); }
  /// An epoll instance, of all clients.
  int programs() const { return programs_; }
  /// One of all machines.
  int machines() const { return machines_; }
  /// Daemons run until `is_done`, and no program. @return false: it was not within `limit`, which
  ///   has passed
  bool run_daemons(const std::function<bool()>& is_done, std::chrono::nanoseconds limit);

  /// The one that there is; null: none.
  static Swarm* present();
  /// For ipc/stream.hpp: @return 0, or an errno of connect()
  int connect(int fd, const std::string& path);
  /// The stream that was connected last with this path breaks off.
  void cut_off(const std::string& path);
  /// @return how many of them are read or written
  std::size_t piece_of(std::size_t bytes);

 private:
  bool run_machines();
  bool run_program();

  int machines_;
  Machine world_;  // the air's, and the waits of programs
  Course course_;
  VirtualLog log_{course_};
  int programs_;
  std::mt19937 chance_;
  std::uint64_t seed_;
  std::size_t longest_piece_ = SIZE_MAX;
  double cut_share_ = 1;
  Places places_;
  std::map<std::string, Air> airs_;  // by the names of their links
  std::map<int, std::unique_ptr<VirtualRobot>> robots_;
  std::map<std::string, int> streams_;  // the programs' ends, by path
};

}  // namespace swarmtalk::test
