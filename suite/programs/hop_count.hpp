// Hop count from one or two seeds: every robot tells its neighbours how many hops it is from each
// seed and takes the smallest number heard plus one; the LED shows whether it is odd or even. A
// count falls at once, and rises period by period when the way it was counted on is lost.
// Source: Zhang et al., AAMAS 2020, sec. 4.1 (figures 4 and 5).
#pragma once

#include <stdint.h>

#include "platforms/robot.hpp"

namespace swarmtalk {
namespace suite {

/// What a robot is in this program; the runner (or the robot's uid) says which.
enum class HopCountRole : uint8_t { kFollower, kSeed1, kSeed2 };

/// @tparam kSeeds  1 or 2: channel 0 counts from seed 1, channel 1 from seed 2
template <class Robot, uint8_t kSeeds>
class BasicHopCount {
  static_assert(platforms::CheckedRobot<Robot>::kIsSound, "");

 public:
  static constexpr uint8_t kUnreached = 100;    // hops before anything is heard
  static constexpr int32_t kRangeMm = 250;      // farther neighbours are not heard, in Kilobot mm
  static constexpr uint8_t kPeriodTicks = 245;  // 8 s: time to hear each neighbour several times

  BasicHopCount(Robot& robot, HopCountRole role) : robot_(robot), role_(role) {}

  void setup() {
    Gradient* other = &gradients_[kSeeds - 1];
    for (uint8_t i = 0; i < kSeeds; ++i) {
      Gradient& gradient = gradients_[i];
      gradient.is_seed = role_ == (i == 0 ? HopCountRole::kSeed1 : HopCountRole::kSeed2);
      gradient.hops = gradient.is_seed ? 0 : kUnreached;
      gradient.least = kUnreached;
      auto* channel = robot_.swarmtalk().new_channel(i, 0, false);
      // The counts are told in turn, each when the other has left: one that waited for its turn
      // beside the other would be twice as old when it is heard.
      gradient.publisher = channel->new_publisher(&Gradient::tell, other);
      other = &gradient;
      channel->new_subscriber(range(), &Gradient::on_message, &gradient);
    }
    Gradient::tell(&gradients_[0]);
    period_start_ = static_cast<uint8_t>(robot_.clock());
  }

  void loop() {
    const uint8_t now = static_cast<uint8_t>(robot_.clock());
    if (static_cast<uint8_t>(now - period_start_) >= kPeriodTicks) {
      period_start_ = now;
      for (uint8_t i = 0; i < kSeeds; ++i) gradients_[i].end_period();
    }
    show();
  }

  /// Hops from seed 0 or 1; kUnreached if it was not heard of.
  const uint8_t& hops(uint8_t seed) const { return gradients_[seed].hops; }

 private:
  using Profile = typename Robot::Profile;
  using Distance = typename Profile::Sensing::Distance;
  using PublisherPointer = platforms::PublisherPointer<Robot>;

  struct Gradient {
    PublisherPointer publisher;
    uint8_t least;  // heard in this period, plus one
    uint8_t hops;
    bool is_seed;

    static void tell(void* self) {
      Gradient* gradient = static_cast<Gradient*>(self);
      gradient->publisher->send(&gradient->hops, 1);
    }
    static void on_message(void* self, const uint8_t* bytes, uint16_t size,
                           const core::Reception<Profile>&) {
      Gradient* gradient = static_cast<Gradient*>(self);
      if (size == 0 || gradient->is_seed || bytes[0] >= kUnreached) return;
      const uint8_t hops = static_cast<uint8_t>(bytes[0] + 1);
      if (hops < gradient->least) gradient->least = hops;
      if (hops < gradient->hops) gradient->hops = hops;
    }
    void end_period() {
      if (!is_seed) hops = least;
      least = kUnreached;
    }
  };

  static Distance range() { return Robot::distance(platforms::scaled_mm<Robot>(kRangeMm)); }

  /// One seed: red is odd, blue even (figure 4). Two: red and green are odd counts, so both odd is
  /// yellow, and blue none (figure 5).
  void show() {
    platforms::Colour colour = platforms::kOff;
    if ((gradients_[0].hops & 1) != 0) colour.red = 255;
    if (kSeeds == 2 && (gradients_[kSeeds - 1].hops & 1) != 0) colour.green = 255;
    if ((colour.red | colour.green) == 0) colour.blue = 255;
    robot_.led(colour);
    robot_.log("hops_1", gradients_[0].hops);
    if (kSeeds == 2) robot_.log("hops_2", gradients_[kSeeds - 1].hops);
  }

  Robot& robot_;
  HopCountRole role_;
  uint8_t period_start_;
  Gradient gradients_[kSeeds];
};

/// Figure 4 of the paper.
template <class Robot>
using HopCountOneSeed = BasicHopCount<Robot, 1>;

/// Figure 5.
template <class Robot>
using HopCount = BasicHopCount<Robot, 2>;

}  // namespace suite
}  // namespace swarmtalk
