// Port: where one robot's frames enter and leave the medium. Whole frames, never waited for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace swarmtalk::lab::radio {

/// Longest frame of a port: of an MTU of 1500, with an Ethernet header and a VLAN tag.
inline constexpr std::size_t kMaxFrameBytes = 1518;

class Port {
 public:
  virtual ~Port() = default;

  /// Readable while frames wait.
  virtual int descriptor() const = 0;

  /// The next frame that the robot sends. @return its bytes; 0: none waits
  virtual std::size_t read(std::span<std::uint8_t> buffer) = 0;

  /// The robot receives this frame. @return false: its end is switched off, full or gone
  virtual bool write(std::span<const std::uint8_t> frame) = 0;

  /// Frames that the kernel had no more room for before they were read here.
  virtual std::uint64_t dropped_frames() const = 0;

  /// Nothing will come from it any more, as read() has found.
  virtual bool is_gone() const { return false; }
};

}  // namespace swarmtalk::lab::radio
