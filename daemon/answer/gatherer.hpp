// Gatherer: when to report and what: this robot's own record, and those of robots farther from who
// looks, gathered into one message. Joins LookTree and AirBudget; pure, so that a test can run a
// hundred of them in virtual time. Its owner tells what came, and asks for a report when it is due.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <string>

#include "daemon/answer/air_budget.hpp"
#include "daemon/answer/look_tree.hpp"
#include "report/report.hpp"

namespace swarmtalk::daemon {

class Gatherer {
 public:
  using Time = std::chrono::steady_clock::time_point;

  static constexpr std::size_t kMostGathered = 256;  // records of other robots that wait
  static constexpr auto kOldestRecord = std::chrono::seconds(60);

  explicit Gatherer(std::uint32_t seed) : random_(seed) {}

  /// Somebody on this robot looks.
  void on_look(std::uint16_t self, const report::Look& look, std::size_t neighbours, Time now);

  /// @param bytes  that the message had
  void on_report(std::uint16_t self, std::uint16_t sender, const report::Report& report,
                 std::size_t bytes, std::size_t neighbours, Time now);

  /// When report() should be asked for next. None: nobody looks.
  std::optional<Time> due() const { return due_; }

  bool is_wanted(std::uint16_t self, Time now) { return tree_.is_wanted(self, now); }

  /// @param body  our own record @param most_bytes  of the message
  /// @return none: it is too early still, or nobody looks any more; due() has changed
  std::optional<std::string> report(std::uint16_t self, const std::string& body,
                                    std::size_t neighbours, std::size_t most_bytes, Time now);

  std::size_t gathered() const { return gathered_.size(); }

 private:
  struct Gathered {
    std::string body;
    Time said_at{};
    std::uint64_t turn = 0;  // those that wait longest go first
    bool is_waiting = false;
  };

  void plan(std::size_t neighbours, Time now);
  void gather(std::uint16_t self, const report::Record& record, Time now);
  void add_gathered(report::Report& report, std::size_t most_bytes, Time now);
  void forget_old(Time now);

  LookTree tree_;
  AirBudget budget_;
  std::map<std::uint16_t, Gathered> gathered_;  // by the robot that it is of
  std::uint64_t turns_ = 0;
  std::optional<Time> due_;
  std::optional<Time> reported_at_;
  std::mt19937 random_;
};

}  // namespace swarmtalk::daemon
