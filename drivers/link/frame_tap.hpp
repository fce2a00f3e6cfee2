// FrameTap: hears every frame that a link receives or sends, for captures. A link without one does
// nothing for it.
#pragma once

#include <cstdint>
#include <span>

namespace swarmtalk::drivers {

class FrameTap {
 public:
  virtual ~FrameTap() = default;

  /// A frame has come and is about to be read.
  virtual void before_received() = 0;
  /// It has been read, and what it carried was handed up. @param datagram  with the medium's header
  /// of `header_bytes` in front of the air frame. Valid during the call only.
  virtual void received(std::span<const std::uint8_t> datagram, std::size_t header_bytes) = 0;
  /// A frame was built and is about to be sent. @param frame  air frame
  virtual void sent(std::span<const std::uint8_t> frame) = 0;
};

/// A link that can be tapped.
class Tappable {
 public:
  virtual ~Tappable() = default;
  /// @param tap  kept by reference until the next call; null: none
  virtual void set_tap(FrameTap* tap) = 0;
};

}  // namespace swarmtalk::drivers
