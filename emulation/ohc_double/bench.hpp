// Bench: an OhcDouble with virtual robots under it, which report what happens as JSON lines. The
// program drives it by a pseudo terminal or by commands; tests use it directly.
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "emulation/ohc_double/kilobot_double.hpp"
#include "emulation/ohc_double/ohc_double.hpp"

namespace swarmtalk::ohc_double {

class Bench {
 public:
  using Json = nlohmann::ordered_json;
  struct Settings {
    unsigned robots = 1;
    double loss = 0;
    std::uint64_t seed = 1;
    std::uint64_t boot_ns = kBootNs;
  };

  /// @param report  called with each event
  Bench(const Settings& settings, std::function<void(const Json&)> report);

  /// Bytes on the line one after another, from now on or from the end of those before.
  void send(std::span<const std::uint8_t> bytes);
  /// One byte that is complete at a time (not before now).
  void put(std::uint8_t byte, std::uint64_t time_ns);
  void wait_until(std::uint64_t time_ns);
  std::uint64_t now_ns() const { return now_ns_; }

  /// Counters, LED and all robots' states.
  Json state() const;

  const OhcDouble& ohc() const { return ohc_; }
  const std::vector<KilobotDouble>& robots() const { return robots_; }

 private:
  void report_robot(std::size_t robot, std::uint64_t time_ns);

  std::function<void(const Json&)> report_;
  OhcDouble ohc_;
  std::vector<KilobotDouble> robots_;
  std::vector<KilobotDouble::State> reported_;
  std::uint64_t now_ns_ = 0;
};

}  // namespace swarmtalk::ohc_double
