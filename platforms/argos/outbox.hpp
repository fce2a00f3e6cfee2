// The packet that a robot in ARGoS wants to send: pulled from the node once a period, kept until
// the simulated air takes it. What waits there keeps its timestamp right, as the node's own queues
// do. Owned by the robot, called on its step.
#pragma once

#include <cstdint>
#include <cstring>

#include "sim/random.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::platforms::in_argos {

/// @tparam P  the node's profile
template <class P>
class Outbox {
 public:
  using W = core::Wire<P>;
  /// Steps from one packet's leaving to the next one's wish: the Kilobot plugin's 100 ms, asked for
  /// in whole steps, a step less or more, so that robots that were in step do not stay so.
  static constexpr uint32_t kPeriodSteps = 4;

  /// @param first_step  earliest for the first packet
  Outbox(core::Swarmtalk<P>& node, uint64_t first_step, sim::Random& random)
      : node_(node), random_(random), due_(first_step + random.below(kPeriodSteps)) {}

  /// Once in a step, at its end: takes the node's next packet if it is time.
  void step(uint64_t now) {
    if (size_ == 0 && now >= due_) size_ = node_.pull_packet(bytes_);
    // It is heard in the next step at the earliest; who still waits then does this again.
    if (size_ != 0) wait_a_step();
  }

  /// The packet has left, with what was in it after the last step().
  void sent(uint64_t now) {
    if (size_ == 0) return;
    size_ = 0;
    due_ = now + kPeriodSteps - 1 + random_.below(3);
  }

  /// 0: there is none.
  uint16_t size() const { return size_; }
  const uint8_t* bytes() const { return bytes_; }

 private:
  void wait_a_step() {
    if (!W::is_timestamped(bytes_)) return;
    const auto bare = static_cast<typename W::PacketSize>(size_ - W::kChecksumBytes);
    if (bare < W::kHeaderBytes + W::kTimestampBytes) return;
    W::set_timestamp(bytes_, bare, W::later(W::timestamp(bytes_, bare), 1));
    W::seal(bytes_, bare);
  }

  core::Swarmtalk<P>& node_;
  sim::Random& random_;
  uint64_t due_;
  uint16_t size_ = 0;
  uint8_t bytes_[W::kMtuBytes] = {};
};

}  // namespace swarmtalk::platforms::in_argos
