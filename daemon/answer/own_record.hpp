// OwnRecord: what this robot says of itself in a report: its pose, whom it hears, its channels and
// what they lost; its programs and the values that they have set only for who wants details. Where
// there is more than a record holds, neighbours, channels and values take turns. On the daemon's
// thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/hub/hub.hpp"
#include "daemon/pose/pose_keeper.hpp"
#include "report/report.hpp"

namespace swarmtalk::daemon {

class OwnRecord {
 public:
  using Time = std::chrono::steady_clock::time_point;

  static constexpr std::size_t kMostHearings = 16;
  static constexpr std::size_t kMostChannels = 10;
  static constexpr std::size_t kMostHearingsInDetail = 10;  // which leaves room for values
  static constexpr std::size_t kMostChannelsInDetail = 6;
  static constexpr std::size_t kMostPrograms = 6;
  static constexpr std::size_t kMostValues = 64;         // that are known
  static constexpr std::size_t kMostValuesInDetail = 5;  // of one record
  static constexpr std::size_t kMostNameBytes = 20;
  static constexpr unsigned kNameEvery = 4;

  /// Both outlive it. @param programs  names of the programs that are served
  OwnRecord(const Hub& hub, const PoseKeeper& poses,
            std::function<std::vector<std::string>()> programs)
      : hub_(hub), poses_(poses), programs_(std::move(programs)) {}

  /// What the robot is called; empty: nothing. Told in one of kNameEvery records, and in details.
  void set_name(std::string name) { name_ = std::move(name); }

  std::string body(bool with_details, Time now);

  /// Programs are about to be asked for their values: those that are not told again are gone with
  /// the next question.
  void begin_values();
  void forget_values();
  void note_value(std::string_view key, std::string_view text);

  /// Robots that are heard now, on all links.
  std::size_t neighbours(Time now) const;

 private:
  void add_place(report::Facts& facts, Time now) const;
  void add_hearings(report::Facts& facts, std::size_t most, Time now);
  void add_channels(report::Facts& facts, std::size_t most, Time now);
  void add_details(report::Facts& facts);

  const Hub& hub_;
  const PoseKeeper& poses_;
  std::function<std::vector<std::string>()> programs_;
  std::string name_;
  unsigned records_ = 0;
  std::size_t first_hearing_ = 0;
  std::size_t first_channel_ = 0;
  std::size_t first_value_ = 0;
  std::map<std::string, std::string> values_;      // of the question before, and of this one
  std::map<std::string, std::string> told_again_;  // of this one
  std::map<std::uint16_t, std::uint64_t> received_before_;
  Time counted_at_{};
};

}  // namespace swarmtalk::daemon
