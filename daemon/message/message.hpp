// Message: one message on its way to local subscribers. It exists once, however many queues it
// waits in: queues hold counted references. Blocks come from a pool and keep their memory, so that
// in steady state a message allocates nothing. Single-threaded: the counts are plain integers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "daemon/message/gateway_origin.hpp"
#include "daemon/message/loss.hpp"
#include "frame/air_frame.hpp"

namespace swarmtalk::daemon {

/// Where a message came from and how, without its bytes.
struct MessageHead {
  std::uint16_t channel = 0;
  std::uint16_t sender = 0;  // node id of the origin
  std::uint32_t epoch = 0;
  std::uint32_t number = 0;                                     // per sender and channel
  float distance_m = std::numeric_limits<float>::quiet_NaN();   // NaN: unknown
  float bearing_rad = std::numeric_limits<float>::quiet_NaN();  // NaN: unknown
  std::optional<frame::FramePose> sender_pose;                  // of the last transmitter
  std::uint16_t transmitter = 0;  // the last, node id; 0: the origin itself, or not known
  std::uint8_t hops = 0;
  std::uint8_t ttl = 0;
  std::optional<std::uint32_t> buffering_delay_us;  // timestamped channels; until received_at_ns
  std::uint64_t received_at_ns = 0;                 // CLOCK_MONOTONIC
  bool is_time_known = true;    // false: that is when it was read, the kernel's stamp is of no use
  DropTotals drops;             // of the station, until the message came
  bool has_wide_number = true;  // 32 bits: a gap is a loss. Narrow ones come back too soon
  bool crossed_gateway = false;
  std::optional<GatewayOrigin> origin;  // of one that crossed, where its link's packets can tell
};

struct Message : MessageHead {
  std::string payload;
  bool is_local = false;  // of a program on this robot
};

class MessagePool;

/// Counted reference to a pooled message. Must not outlive its pool.
class MessageRef {
 public:
  MessageRef() = default;
  MessageRef(const MessageRef& other) : block_(other.block_) {
    if (block_ != nullptr) ++block_->uses;
  }
  MessageRef(MessageRef&& other) noexcept : block_(std::exchange(other.block_, nullptr)) {}
  MessageRef& operator=(MessageRef other) noexcept {
    std::swap(block_, other.block_);
    return *this;
  }
  ~MessageRef() { reset(); }

  void reset();
  explicit operator bool() const { return block_ != nullptr; }
  Message& operator*() const { return block_->message; }
  Message* operator->() const { return &block_->message; }

 private:
  friend class MessagePool;
  struct Block {
    Message message;
    MessagePool* pool = nullptr;
    std::size_t uses = 0;
  };
  explicit MessageRef(Block* block) : block_(block) { ++block_->uses; }

  Block* block_ = nullptr;
};

class MessagePool {
 public:
  MessagePool() = default;
  MessagePool(const MessagePool&) = delete;
  MessagePool& operator=(const MessagePool&) = delete;

  /// A message with this head and a copy of this payload.
  MessageRef take(const MessageHead& head, std::span<const std::uint8_t> payload, bool is_local);

 private:
  friend class MessageRef;
  static constexpr std::size_t kMostFree = 256;  // blocks kept for later

  void give_back(MessageRef::Block* block);

  std::vector<std::unique_ptr<MessageRef::Block>> free_;
};

}  // namespace swarmtalk::daemon
