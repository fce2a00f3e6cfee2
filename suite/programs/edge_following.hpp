// Edge following: followers circle a group of standing seeds clockwise at a fixed distance, by
// distance sensing alone. Seeds and followers have a one-way channel each. A seed grants itself to
// one follower at a time; others that come to it stop and wait.
// Source: Zhang et al., AAMAS 2020, sec. 4.3 (figure 8).
#pragma once

#include <stdint.h>

#include "platforms/robot.hpp"

namespace swarmtalk {
namespace suite {

enum class EdgeRole : uint8_t { kSeed, kFollower };

template <class Robot>
class EdgeFollowing {
 public:
  static constexpr int32_t kSetMm = 60;       // to the nearest seed, in Kilobot mm
  static constexpr int32_t kToleranceMm = 2;  // dito
  static constexpr int32_t kStepMm = 3;       // dito, ahead
  static constexpr int32_t kStepDeg = 12;     // turns
  static constexpr int32_t kRangeMm = 200;    // dito
  static constexpr uint8_t kNobody = 255;
  static constexpr uint8_t kOccupiedTicks = 100;  // 3.3 s: a seed forgets a silent follower
  static constexpr uint8_t kSeedChannel = 0;
  static constexpr uint8_t kFollowerChannel = 1;

  /// @param number  different for each robot, 0 to 254
  EdgeFollowing(Robot& robot, EdgeRole role, uint8_t number)
      : robot_(robot), role_(role), number_(number) {}

  void setup() {
    partner_ = kNobody;
    auto* seeds = robot_.swarmtalk().new_channel(kSeedChannel, 0, false);
    auto* followers = robot_.swarmtalk().new_channel(kFollowerChannel, 0, false);
    const Distance range = length(kRangeMm);
    if (is_seed()) {
      publisher_ = seeds->new_publisher(&on_sent, this);
      followers->new_subscriber(range, &on_follower, this);
    } else {
      publisher_ = followers->new_publisher(&on_sent, this);
      seeds->new_subscriber(range, &on_seed, this);
    }
    on_sent(this);
  }

  void loop() {
    if (is_seed()) {
      if (partner_ != kNobody && since_partner() >= kOccupiedTicks) partner_ = kNobody;
      robot_.led(partner_ == kNobody ? platforms::kWhite : platforms::kBlue);
      return;
    }
    if (robot_.is_moving()) return;
    if (!is_granted_) {
      robot_.led(platforms::kRed);
    } else if (has_reading_) {
      has_reading_ = false;
      step();
      last_mm_ = distance_mm_;
    }
    robot_.log("waits", is_granted_ ? 0 : 1);
  }

 private:
  using Profile = typename Robot::Profile;
  using Distance = typename Profile::Sensing::Distance;
  using Reception = core::Reception<Profile>;

  bool is_seed() const { return role_ == EdgeRole::kSeed; }
  static Distance length(int32_t kilobot_mm) {
    return Robot::distance(platforms::scaled_mm<Robot>(kilobot_mm));
  }
  uint8_t since_partner() {
    return static_cast<uint8_t>(static_cast<uint8_t>(robot_.clock()) - heard_tick_);
  }

  /// Seeds: who may follow. Followers: whom they follow.
  static void on_sent(void* self) {
    EdgeFollowing& me = *static_cast<EdgeFollowing*>(self);
    const uint8_t message[2] = {me.number_, me.partner_};
    me.publisher_->send(message, sizeof message);
  }

  static void on_follower(void* self, const uint8_t* bytes, uint16_t size, const Reception&) {
    EdgeFollowing& me = *static_cast<EdgeFollowing*>(self);
    if (size < 2 || bytes[1] != me.number_) return;
    if (me.partner_ == kNobody) me.partner_ = bytes[0];
    if (me.partner_ == bytes[0]) me.heard_tick_ = static_cast<uint8_t>(me.robot_.clock());
  }

  static void on_seed(void* self, const uint8_t* bytes, uint16_t size, const Reception& reception) {
    EdgeFollowing& me = *static_cast<EdgeFollowing*>(self);
    // What is measured while moving is old when the move ends.
    if (size < 2 || reception.sensing.distance < 0 || me.robot_.is_moving()) return;
    const Distance distance_mm = reception.sensing.distance;
    if (bytes[0] != me.partner_) {
      if (me.partner_ != kNobody && distance_mm >= me.distance_mm_) return;
      me.partner_ = bytes[0];
      me.last_mm_ = distance_mm;
    }
    me.is_granted_ = bytes[1] == me.number_;
    me.distance_mm_ = distance_mm;
    me.has_reading_ = true;
  }

  /// One step along the edge, the seeds to the right.
  void step() {
    if (distance_mm_ > length(kSetMm + kToleranceMm) && distance_mm_ >= last_mm_) {
      robot_.led(platforms::kYellow);
      robot_.right(platforms::turn_ticks<Robot>(kStepDeg));
    } else if (distance_mm_ < length(kSetMm - kToleranceMm) && distance_mm_ <= last_mm_) {
      robot_.led(platforms::kWhite);
      robot_.left(platforms::turn_ticks<Robot>(kStepDeg));
    } else {
      robot_.led(platforms::kGreen);
      robot_.forward(platforms::forward_ticks<Robot>(kStepMm));
    }
  }

  Robot& robot_;
  platforms::PublisherPointer<Robot> publisher_;
  EdgeRole role_;
  uint8_t number_;
  uint8_t partner_;
  uint8_t heard_tick_ = 0;    // seeds: of the partner
  bool is_granted_ = false;   // followers: the seed lets us
  bool has_reading_ = false;  // dito, since the last step
  Distance distance_mm_ = 0;  // dito, to the partner
  Distance last_mm_ = 0;      // dito, at the last step
};

}  // namespace suite
}  // namespace swarmtalk
