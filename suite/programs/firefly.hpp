// Firefly synchronisation: each robot flashes once a period and tells its neighbours; who hears of
// a flash works out when it was and moves its own next flash towards it. Messages have four
// packets, as in the paper's experiment, so they wait long in buffers; the channel's delay says how
// long. Source: Zhang et al., AAMAS 2020, sec. 4.2 (figures 6 and 7).
#pragma once

#include <stdint.h>

#include "platforms/robot.hpp"

namespace swarmtalk {
namespace suite {

/// @tparam kUsesDelay  false: takes the arrival of a message for the time of the flash, as the
/// right
///                     half of figure 7
template <class Robot, bool kUsesDelay>
class BasicFirefly {
  static_assert(platforms::CheckedRobot<Robot>::kIsSound, "");

 public:
  static constexpr uint16_t kPeriodTicks = 120;  // 3.9 s
  static constexpr int16_t kLatestTicks = 34;
  static constexpr uint8_t kFlashTicks = 8;  // LED on
  static constexpr uint8_t kPackets = 4;
  static constexpr int32_t kRangeMm = 250;  // farther neighbours are not heard, in Kilobot mm
  static constexpr uint8_t kChannel = 8;    // the first that carries delays

  explicit BasicFirefly(Robot& robot) : robot_(robot) {}

  void setup() {
    auto* channel = robot_.swarmtalk().new_channel(kChannel, 0, true);
    publisher_ = channel->new_publisher(static_cast<core::SentFn>(nullptr), nullptr);
    channel->new_subscriber(Robot::distance(platforms::scaled_mm<Robot>(kRangeMm)), &on_message,
                            this);
    last_flash_ = now();
    period_ = static_cast<uint16_t>(1 + robot_.random() % kPeriodTicks);
  }

  void loop() {
    const uint16_t since = static_cast<uint16_t>(now() - last_flash_);
    if (since >= period_) {
      flash(static_cast<uint16_t>(since - period_));
    } else if (since >= kFlashTicks) {
      robot_.led(platforms::kOff);
    }
  }

  /// Flashes so far; after 255 comes 1, as 0 is a robot that has not flashed.
  const uint8_t& flashes() const { return flashes_; }

 private:
  using Profile = typename Robot::Profile;
  static constexpr uint8_t kMessageBytes = kPackets * core::Wire<Profile>::kTimedPayloadBytes;

  uint16_t now() { return static_cast<uint16_t>(robot_.clock()); }

  /// @param late  ticks since it was due
  void flash(uint16_t late) {
    // A clock that was set, or a loop that stood still: not a flash for each period missed.
    last_flash_ = late < kPeriodTicks ? static_cast<uint16_t>(last_flash_ + period_) : now();
    flashes_ = flashes_ == 255 ? 1 : static_cast<uint8_t>(flashes_ + 1);
    robot_.led(platforms::kWhite);
    robot_.log("flash", flashes_);
    const uint8_t dummy[kMessageBytes] = {};
    if (publisher_->send(dummy, kMessageBytes) != core::Error::kOk) robot_.log("unsent", flashes_);
    period_ = kPeriodTicks;
    sixteenths_ = static_cast<uint8_t>(8 + robot_.random() % 5);
    offset_sum_ = 0;
    heard_ = 0;
  }

  /// Part of the mean offset of the neighbours heard since the last flash. The part varies, or
  /// waves could run around in the swarm for ever.
  int16_t correction() const {
    const int32_t product = static_cast<int32_t>(offset_sum_) * sixteenths_;
    const int32_t half = heard_ * INT32_C(8);  // to round, or small offsets would stay
    return static_cast<int16_t>((product + (product > 0 ? half : -half)) / (heard_ * INT32_C(16)));
  }

  static void on_message(void* self, const uint8_t*, uint16_t,
                         const core::Reception<Profile>& reception) {
    BasicFirefly& me = *static_cast<BasicFirefly*>(self);
    if (me.heard_ == 255 || me.flashes_ == 0) return;
    const uint16_t delay = kUsesDelay ? static_cast<uint16_t>(reception.delay_ticks) : 0;
    // How long after mine the other's flash was; from kLatestTicks on the nearer way to it is to be
    // earlier. Clearly less than half a period: whoever is far from its neighbours hurries, and
    // swarms whose phases run once around do not stay so. Not much less: a message that waited for
    // 64 ticks has to come before the flash that it moves.
    int16_t offset = static_cast<int16_t>(static_cast<uint16_t>(me.now() - delay - me.last_flash_));
    offset = static_cast<int16_t>(offset % static_cast<int16_t>(kPeriodTicks));
    if (offset > kLatestTicks) offset = static_cast<int16_t>(offset - kPeriodTicks);
    if (offset < kLatestTicks - static_cast<int16_t>(kPeriodTicks)) {
      offset = static_cast<int16_t>(offset + kPeriodTicks);
    }
    me.offset_sum_ = static_cast<int16_t>(me.offset_sum_ + offset);
    ++me.heard_;
    // The very next flash: one that moves a period later would answer to what is no longer so.
    me.period_ = static_cast<uint16_t>(kPeriodTicks + me.correction());
  }

  Robot& robot_;
  platforms::PublisherPointer<Robot> publisher_;
  uint16_t last_flash_;
  uint16_t period_;         // until the next flash
  uint8_t sixteenths_ = 8;  // of the mean offset, that the next flash moves
  int16_t offset_sum_ = 0;
  uint8_t heard_ = 0;
  uint8_t flashes_ = 0;
};

template <class Robot>
using Firefly = BasicFirefly<Robot, true>;

template <class Robot>
using FireflyNoDelay = BasicFirefly<Robot, false>;

}  // namespace suite
}  // namespace swarmtalk
