// The medium of Wi-Fi broadcasts in virtual time: 802.11's distributed coordination (carrier sense,
// DIFS, backoff, no answer and so no second try), air time, range, interference, capture by who was
// first, losses. Knows nothing of what is in a frame. Who calls it moves its clock: the lab with
// the wall clock, tests and calibrations as fast as they like. Single-threaded; everything follows
// from the seed and the calls.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sim/body.hpp"
#include "sim/event_queue.hpp"
#include "sim/grid.hpp"
#include "sim/interference.hpp"
#include "sim/random.hpp"
#include "sim/wifi_air_config.hpp"
#include "sim/wifi_backoff.hpp"
#include "sim/wifi_power.hpp"

namespace swarmtalk::sim {

/// How long a broadcast keeps the air busy: preamble, the 36 bytes of MAC, LLC and FCS, payload.
/// Source: IEEE 802.11-2020, 17.4.3.
/// @param payload_bytes  behind the Ethernet header
uint32_t wifi_air_time_us(const WifiRate& rate, std::size_t payload_bytes);

class WifiAir {
 public:
  struct Hooks {
    /// A frame arrives. @return false: the receiver does not take it (lost_receiver)
    std::function<bool(uint32_t from, uint32_t to, std::span<const uint8_t> frame)> deliver;
    /// A frame has left the air, and all who receive it have it. May be empty.
    std::function<void(uint32_t from, uint64_t at_us)> ended;
  };

  /// @param config  its rate is one of wifi_rates()
  WifiAir(const WifiAirConfig& config, uint64_t seed, Hooks hooks);

  /// @return the new station's number, from 0
  uint32_t add(double x_mm, double y_mm);
  uint32_t size() const { return static_cast<uint32_t>(stations_.size()); }
  void move(uint32_t station, double x_mm, double y_mm);
  const Body& body(uint32_t station) const { return stations_[station].body; }

  /// Loss of this direction alone, in place of WifiAirConfig::loss. @param loss  0..1; none: as all
  void set_link_loss(uint32_t from, uint32_t to, std::optional<double> loss);
  std::optional<double> link_loss(uint32_t from, uint32_t to) const;
  const std::map<std::pair<uint32_t, uint32_t>, double>& link_losses() const { return link_loss_; }

  /// Stations of different groups neither hear nor disturb each other. All begin in group 0.
  void set_group(uint32_t station, uint32_t group) { stations_[station].group = group; }
  uint32_t group(uint32_t station) const { return stations_[station].group; }
  Interference& interference() { return interference_; }

  /// Whether `to` receives `from` where they stand now, with nobody else on the air.
  bool is_in_range(uint32_t from, uint32_t to) const;
  /// How much more power arrives than is needed, at the rate in use.
  double margin_db(uint32_t from, uint32_t to) const;

  /// A station wants to send this frame. Moves the clock on to `at_us`.
  /// @param frame  with WifiAirConfig::header_bytes in front; copied
  /// @param at_us  not before now_us()
  /// @return false: its queue is full, and the frame is dropped and counted
  bool offer(uint32_t station, std::span<const uint8_t> frame, uint64_t at_us);

  /// Moves the clock on to `end_us`, with all that happens until then.
  void run(uint64_t end_us);
  uint64_t now_us() const { return now_us_; }

  /// When something happens next, if that is before `end_us`.
  std::optional<uint64_t> next_event_us(uint64_t end_us);

  const WifiAirConfig& config() const { return config_; }
  const WifiAirCounters& counters() const { return total_; }
  const WifiAirCounters& counters(uint32_t station) const { return stations_[station].counters; }

 private:
  enum Kind : uint32_t { kAccess, kDetect, kEnd };
  static constexpr unsigned kKindBits = 2;
  static constexpr uint32_t kNobody = UINT32_MAX;
  static constexpr uint64_t kNever = UINT64_MAX;
  using Loss = uint64_t WifiAirCounters::*;  // nullptr: none so far

  /// A frame on the air, as one station has it in the ear.
  struct Signal {
    uint32_t from;
    bool is_in_range;
    double power;
    uint64_t start_us;
    Loss loss;
  };

  struct Station {
    Body body;
    uint32_t group = 0;
    std::deque<std::vector<uint8_t>> queue;  // the first is on the air while is_sending
    std::vector<uint32_t> reached;           // whom the frame on the air reaches
    std::vector<Signal> signals;
    uint32_t locked_on = kNobody;  // whose frame it reads
    bool is_sending = false;
    bool is_busy = false;  // the air, as far as it can tell
    WifiBackoff backoff;
    uint64_t access_us = kNever;  // when it sends
    WifiAirCounters counters;
  };

  void push(uint64_t at_us, uint32_t station, Kind kind);
  void access(uint32_t index);
  void transmit(uint32_t index);
  void begin_signal(uint32_t from, uint32_t to, double power, bool is_in_range);
  void detect(uint32_t index);
  void end_transmission(uint32_t index);
  void end_signal(uint32_t from, uint32_t to);
  Loss loss_of_read(uint32_t from, const Station& receiver, uint32_t to, const Signal& signal);
  void look_at_carrier(uint32_t index);
  void plan_access(uint32_t index);
  void count(uint32_t station, Loss what, uint64_t by = 1);
  bool are_parted(const Station& a, const Station& b) const;
  double signal_to_noise(const Station& station, const Signal& signal) const;

  WifiAirConfig config_;
  WifiRate rate_;
  Hooks hooks_;
  Random random_;
  WifiPower power_;
  WifiSpaces spaces_;
  Grid grid_;
  EventQueue queue_;
  std::size_t waiting_events_ = 0;
  std::vector<Station> stations_;
  std::map<std::pair<uint32_t, uint32_t>, double> link_loss_;
  Interference interference_;
  WifiAirCounters total_;
  uint64_t now_us_ = 0;
};

}  // namespace swarmtalk::sim
