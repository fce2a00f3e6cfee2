// AirBudget: how often this robot may report, so that the reports that any robot hears and sends
// take at most 1 % of its air at 6 Mb/s, forged ones and questions included. The rule: let S be the
// air of one round as a robot hears it (each reporter's last report, and its own). It tells S in
// its reports, and reports at most once in max(S of its own, S of those it hears) / 1 %. Then what
// a robot B hears in a second is at most S(B) / (S(B) / 1 %). Reads no clock.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>

namespace swarmtalk::daemon {

class AirBudget {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::microseconds;

  static constexpr std::uint64_t kShareDivisor = 100;  // 1 %
  static constexpr std::size_t kMostReporters = 256;
  static constexpr auto kForgetAfter = std::chrono::seconds(150);
  static constexpr auto kLeastPeriod = std::chrono::seconds(1);
  static constexpr std::int64_t kMostSavedUs = 20'000;  // of air that was not used

  /// Air of a message of so many bytes in a frame of its own: 802.11 at 6 Mb/s, long preamble, mean
  /// backoff, 36 bytes of 802.11 and LLC, 44 of our frame and packet headers with a pose.
  static std::uint32_t air_us(std::size_t message_bytes);

  /// A report has come. @param told_us  the round that its sender tells
  void heard(std::uint16_t sender, std::uint32_t air_us, std::uint32_t told_us, Time now);
  void sent(std::uint32_t air_us, Time now);

  /// Air of a round here. Those that are near and have not reported yet count as we do.
  std::uint32_t round_us(std::size_t neighbours, Time now);

  /// Least time between two reports of ours.
  Duration period(std::size_t neighbours, Time now);

  /// Whether the air of the last seconds leaves room for so much more.
  bool has_room(std::uint32_t air_us, Time now);

 private:
  struct Reporter {
    std::uint32_t air_us = 0;
    std::uint32_t told_us = 0;
    Time at{};
  };

  void forget_old(Time now);
  void use(std::uint32_t air_us, Time now);

  std::map<std::uint16_t, Reporter> reporters_;
  std::uint32_t own_us_ = 0;
  std::int64_t saved_us_ = kMostSavedUs;
  Time saved_at_{};
};

}  // namespace swarmtalk::daemon
