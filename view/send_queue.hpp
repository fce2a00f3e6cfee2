// SendQueue: what waits to be written to one browser. State is kept once, the newest wins; events
// (messages, log lines) wait in order up to a limit, and the oldest is dropped and counted. So a
// browser that reads slowly holds a bounded amount of memory and delays nobody.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace swarmtalk::view {

/// One WebSocket message. Its bytes are shared by all the connections it goes to.
struct Outgoing {
  std::shared_ptr<const std::string> bytes;
  bool is_binary = false;
};

class SendQueue {
 public:
  static constexpr std::size_t kMostEvents = 512;
  static constexpr std::size_t kMostEventBytes = std::size_t{1} << 20;
  static constexpr std::size_t kStates = 9;

  /// @param kind  0 to kStates - 1: replaces the state of this kind that still waits
  void put_state(std::size_t kind, Outgoing state) {
    if (states_[kind]) ++states_replaced_;
    states_[kind] = std::move(state);
  }

  void put_event(Outgoing event) {
    event_bytes_ += event.bytes->size();
    events_.push_back(std::move(event));
    while (events_.size() > kMostEvents || (event_bytes_ > kMostEventBytes && events_.size() > 1)) {
      event_bytes_ -= events_.front().bytes->size();
      events_.pop_front();
      ++events_dropped_;
    }
  }

  /// What is to be written next: events in turn with states, so that neither starves the other.
  std::optional<Outgoing> take() {
    is_events_turn_ = !is_events_turn_;
    if (is_events_turn_ && !events_.empty()) return take_event();
    for (std::optional<Outgoing>& state : states_) {
      if (state) return std::exchange(state, std::nullopt);
    }
    if (!events_.empty()) return take_event();
    return std::nullopt;
  }

  std::uint64_t events_dropped() const { return events_dropped_; }
  std::uint64_t states_replaced() const { return states_replaced_; }

 private:
  Outgoing take_event() {
    Outgoing first = std::move(events_.front());
    events_.pop_front();
    event_bytes_ -= first.bytes->size();
    return first;
  }

  std::array<std::optional<Outgoing>, kStates> states_;
  std::deque<Outgoing> events_;
  std::size_t event_bytes_ = 0;
  std::uint64_t events_dropped_ = 0;
  std::uint64_t states_replaced_ = 0;
  bool is_events_turn_ = false;
};

}  // namespace swarmtalk::view
