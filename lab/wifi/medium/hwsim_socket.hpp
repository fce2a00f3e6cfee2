// The kernel's simulated radios, mac80211_hwsim, by generic netlink: once registered, every frame
// that one of them transmits comes here, and what is handed back is what a radio receives. One
// thread. Numbers of commands and attributes are those of the kernel's interface since 3.0.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "lab/wifi/medium/air.hpp"

namespace swarmtalk::wifi {

/// What the kernel has to be told of one transmission.
struct Ticket {
  Address transmitter{};
  std::uint32_t flags = 0;
  std::uint64_t cookie = 0;
};

class HwsimSocket {
 public:
  using OnFrame = std::function<void(const Frame& frame, const Ticket& ticket)>;

  /// Throws std::runtime_error with one line when the kernel has no such radios, or does not want
  /// this process (not root) or another one is registered.
  HwsimSocket();
  ~HwsimSocket();
  HwsimSocket(const HwsimSocket&) = delete;
  HwsimSocket& operator=(const HwsimSocket&) = delete;

  int fd() const;

  /// Reads what waits; `on_frame` for each frame, whose bytes are valid during the call.
  void read(const OnFrame& on_frame, Air& air);

  /// A radio receives the frame.
  void deliver(const Frame& frame, const Address& receiver, int rate_index, int signal_dbm);

  /// Tells the transmitter's driver what became of its frame.
  void report(const Ticket& ticket, const Outcome& outcome, int signal_dbm);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace swarmtalk::wifi
