// SerialDevice: one serial device, opened for ourselves alone, raw, 8N1, without flow control.
// Never blocks. Knows nothing of what is sent; ReconnectingPort opens it again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace swarmtalk::kilobot_bridge {

/// Why a device could not be opened. `text` is one sentence with the remedy, without the path.
struct OpenProblem {
  enum class Kind : std::uint8_t {
    kNone,
    kAbsent,  // not plugged in now
    kBusy,    // another program has it
    kWrong    // no permission, or no serial device: waiting does not help
  };
  Kind kind = Kind::kNone;
  std::string text;
};

class SerialDevice {
 public:
  SerialDevice() = default;
  ~SerialDevice() { close(); }
  SerialDevice(const SerialDevice&) = delete;
  SerialDevice& operator=(const SerialDevice&) = delete;

  /// Opens exactly `path`, exclusively (TIOCEXCL against other users' programs, a lock against
  /// those that lock, as we do); what waits in its buffers is thrown away.
  OpenProblem open(const std::string& path, unsigned baud);
  void close();
  bool is_open() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }

  /// @return bytes taken, 0 when it is full; -1: the device is gone (errno)
  std::ptrdiff_t write(std::span<const std::uint8_t> bytes);
  /// @return bytes read, 0 when none wait; -1: the device is gone (errno)
  std::ptrdiff_t read(std::span<std::uint8_t> bytes);
  /// Whether the kernel and, where it can tell, the device have nothing left to transmit.
  bool is_drained() const;
  /// Throws away what is not transmitted yet, so that closing does not wait for it.
  void discard_output();

 private:
  int descriptor_ = -1;
};

}  // namespace swarmtalk::kilobot_bridge
