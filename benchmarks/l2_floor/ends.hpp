// The two ways from one interface to another that are compared: a bare packet socket with blocking
// send() and recv(), one frame per message, which no daemon can beat at low rates; and the
// RawL2Link of drivers/ on an event loop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "benchmarks/l2_floor/samples.hpp"

namespace swarmtalk::l2_floor {

class Sender {
 public:
  virtual ~Sender() = default;
  /// Sends one message, stamped now.
  virtual void send(std::size_t message_bytes) = 0;
  /// Returns at that time, not before; a link's event loop runs meanwhile.
  virtual void wait_until(std::int64_t time_ns) = 0;
};

class Receiver {
 public:
  virtual ~Receiver() = default;
  /// Hands messages to `on_message` until it returns false, or none has come for five seconds.
  virtual void receive(const std::function<bool(std::span<const std::uint8_t>)>& on_message) = 0;
};

std::unique_ptr<Sender> open_bare_sender(const std::string& interface);
std::unique_ptr<Receiver> open_bare_receiver(const std::string& interface);
std::unique_ptr<Sender> open_link_sender(const std::string& interface);
std::unique_ptr<Receiver> open_link_receiver(const std::string& interface);

}  // namespace swarmtalk::l2_floor
