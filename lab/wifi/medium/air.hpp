// The air of a Wi-Fi guest: where its radios are, which of their frames arrive where, and what has
// become of every frame. Knows nothing of netlink; the loop in main.cpp feeds it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lab/wifi/medium/reception.hpp"

namespace swarmtalk::wifi {

/// Six bytes; a radio of mac80211_hwsim is known by its second address, 42:00:00:00:NN:00.
using Address = std::array<std::uint8_t, 6>;

/// One of the rates that a transmitter tries, in order.
struct Attempt {
  int rate_index = -1;  // rate_of(); negative: none
  int tries = 0;
};

struct Frame {
  Address transmitter{};                // the radio
  std::span<const std::uint8_t> bytes;  // 802.11, from frame control on, without check sequence
  std::uint32_t frequency_mhz = 0;
  std::array<Attempt, 4> attempts{};
  bool wants_no_ack = false;
};

struct Reception {
  std::size_t radio = 0;  // index
  int signal_dbm = 0;
  int rate_index = 0;
};

/// What became of one frame.
struct Outcome {
  std::vector<Reception> receptions;
  std::array<Attempt, 4> used{};  // tries that were made
  bool is_acknowledged = false;
};

/// Frames from one radio to another: those that were for it or for all.
struct PairCounters {
  std::uint64_t data_arrived = 0;
  std::uint64_t data_lost_weak = 0;  // by distance and rate
  std::uint64_t data_lost_set = 0;   // by what somebody set
  std::uint64_t other_arrived = 0;   // management and control
  std::uint64_t other_lost = 0;
};

class Air {
 public:
  static constexpr std::size_t kMaxRadios = 64;

  explicit Air(std::uint64_t seed) : random_(seed) {}

  /// @return false: too many, or the name or address is there already
  bool add(const std::string& name, const Address& address, double x_m, double y_m);

  /// A line of a person or program: `place NAME X Y`, `power NAME DBM`, `loss FROM TO SHARE` (of
  /// all frames, beside those lost by distance), `counters`.
  /// @return one line of JSON; {"error": "..."} for a line that is none of these
  std::string command(std::string_view line);

  /// Decides about one frame and counts it.
  /// A frame for one radio is tried as often as asked for, until that radio has it; its
  /// acknowledgement is never lost. Other radios hear the try that ended it or none: for monitors.
  Outcome transmit(const Frame& frame);

  const Address& address(std::size_t radio) const { return radios_[radio].address; }

  /// Counts a frame that the kernel did not take: its radio is off or on another channel.
  void refused() { ++refused_; }

  /// Counts frames that were lost on the way from the kernel, because they came too fast.
  void overrun() { ++overruns_; }

 private:
  struct Radio {
    std::string name;
    Address address{};
    double x_m = 0;
    double y_m = 0;
    double power_dbm = 20;
    std::uint64_t frames_sent = 0;
    std::uint64_t unacknowledged = 0;
  };

  struct Pair {
    double share_lost = 0;
    PairCounters counters;
  };

  Pair& pair(std::size_t from, std::size_t to) { return pairs_[from * kMaxRadios + to]; }
  std::size_t find(std::string_view name) const;
  std::size_t find(const Address& address) const;
  double signal(std::size_t from, std::size_t to, std::uint32_t frequency_mhz) const;
  bool draw(double chance);
  /// One try from radio to radio. @return whether it arrives, with the cause in `was_set` if not
  bool arrives(std::size_t from, std::size_t to, Rate rate, const Frame& frame, bool& was_set);
  void count(std::size_t from, std::size_t to, bool is_data, bool arrived, bool was_set);
  void send_to_all(std::size_t from, const Frame& frame, Outcome& outcome);
  void send_to_one(std::size_t from, std::size_t to, const Frame& frame, Outcome& outcome);
  std::string counters_json();

  std::mt19937_64 random_;
  std::vector<Radio> radios_;
  std::vector<Pair> pairs_ = std::vector<Pair>(kMaxRadios * kMaxRadios);
  std::uint64_t refused_ = 0;
  std::uint64_t overruns_ = 0;
  std::uint64_t strangers_ = 0;  // frames of radios that nobody named
};

}  // namespace swarmtalk::wifi
