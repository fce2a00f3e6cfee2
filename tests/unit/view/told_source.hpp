// A source for viewers whose members say what is there, and which writes down what viewers ask for.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "view/source.hpp"

namespace swarmtalk::view {

inline constexpr Time kToldSourceNow{std::chrono::milliseconds(1'000'300)};

class ToldSource : public Source {
 public:
  Time now() const override { return kToldSourceNow; }
  std::uint64_t wall_ns() const override { return wall_ns_; }
  void set_watched(bool) override {}
  void want_details(std::uint32_t robot) override { wanted_.push_back(robot); }
  Status questions() const override { return questions_; }
  Status open_channel(const std::string& name) override {
    if (const auto found = refused_.find(name); found != refused_.end()) return found->second;
    ++open_[name];
    return Status();
  }
  void close_channel(const std::string& name) override {
    if (--open_[name] == 0) open_.erase(name);
  }
  std::optional<std::uint16_t> number_of(const std::string& name) const override {
    const auto found = numbers_.find(name);
    return found == numbers_.end() ? std::nullopt : std::optional(found->second);
  }
  const LeftOut& left_out() const override { return left_out_; }
  Status publish(const std::string& channel, const std::string& payload) override {
    if (publishes_) sent_.emplace_back(channel, payload);
    return publishes_;
  }
  std::optional<Time> lost_daemon_at() const override { return lost_daemon_at_; }
  std::string daemon_name() const override { return "swarmtalkd 1"; }
  const DaemonStatus& status() const override { return status_; }
  Swarm& known() { return swarm_; }
  Traffic& heard() { return traffic_; }
  using Source::take_harvest;
  using Source::take_line;
  using Source::take_message;

  // What is there.
  std::uint64_t wall_ns_ = 0;
  Status questions_, publishes_;
  std::map<std::string, Status> refused_;
  std::map<std::string, std::uint16_t> numbers_;
  LeftOut left_out_;
  std::optional<Time> lost_daemon_at_;
  DaemonStatus status_;
  // What was asked for.
  std::map<std::string, int> open_;  // and not closed since
  std::vector<std::pair<std::string, std::string>> sent_;
  std::vector<std::uint32_t> wanted_;
};

}  // namespace swarmtalk::view
