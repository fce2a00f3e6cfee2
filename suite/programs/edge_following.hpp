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
  static_assert(platforms::CheckedRobot<Robot>::kIsSound, "");

 public:
  static constexpr int32_t kSetMm = 60;       // to the nearest seed, in Kilobot mm
  static constexpr int32_t kToleranceMm = 4;  // in Kilobot mm, as the lengths below
  static constexpr int32_t kNearerMm = 3;
  static constexpr int32_t kStepMm = 5;    // ahead
  static constexpr int32_t kStepDeg = 12;  // turns
  static constexpr int32_t kRangeMm = 200;
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
    const bool waits = partner_ == kNobody || held_ != partner_;
    if (waits) {
      robot_.led(platforms::kRed);
    } else if (has_reading_) {
      has_reading_ = false;
      step();
    }
    const uint8_t cause = is_taken_ ? 2 : 1;  // another has the seed; it has not answered yet
    robot_.log("waits", waits ? cause : 0);
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

  /// Of seeds: number, who may follow. Of followers: number, whom they want, whom they have.
  static void on_sent(void* self) {
    EdgeFollowing& me = *static_cast<EdgeFollowing*>(self);
    const uint8_t message[3] = {me.number_, me.partner_, me.held_};
    me.publisher_->send(message, sizeof message);
  }

  static void on_follower(void* self, const uint8_t* bytes, uint16_t size, const Reception&) {
    EdgeFollowing& me = *static_cast<EdgeFollowing*>(self);
    if (size < 3) return;
    const bool wants_me = bytes[1] == me.number_;
    const bool has_me = bytes[2] == me.number_;
    if (me.partner_ == kNobody && wants_me) me.partner_ = bytes[0];
    if (me.partner_ != bytes[0]) return;
    if (wants_me || has_me) {
      me.heard_tick_ = static_cast<uint8_t>(me.robot_.clock());
    } else {
      me.partner_ = kNobody;
    }
  }

  static void on_seed(void* self, const uint8_t* bytes, uint16_t size, const Reception& reception) {
    EdgeFollowing& me = *static_cast<EdgeFollowing*>(self);
    if (size < 2 || reception.sensing.distance < 0) return;
    const Distance distance_mm = reception.sensing.distance;
    if (bytes[0] != me.partner_) {
      // Clearly nearer, or two robots between two seeds could each want the other's for ever.
      if (me.partner_ != kNobody && distance_mm >= me.distance_mm_ - length(kNearerMm)) return;
      me.partner_ = bytes[0];
      me.last_mm_ = distance_mm;
    }
    // A follower that waits for its next seed keeps the one it has: nobody comes up behind it.
    if (bytes[1] == me.number_) me.held_ = me.partner_;
    me.is_taken_ = bytes[1] != me.number_ && bytes[1] != kNobody;
    me.distance_mm_ = distance_mm;
    // What is measured while moving is too old to step by when the move ends; it does tell which
    // seed is the nearest. At rest alone the first seed to speak, often the old one, ended the
    // stop, and the next was missed stop after stop, until the follower ran into it.
    if (!me.robot_.is_moving()) me.has_reading_ = true;
  }

  /// One step along the edge, the seeds to the right: the error and how it grows decide on a turn;
  /// after a turn always a step ahead, or nothing could be seen of what the turn has done.
  void step() {
    if (!has_turned_) {
      const int16_t error = static_cast<int16_t>(distance_mm_ - length(kSetMm));
      const int16_t trend = static_cast<int16_t>(error + 3 * (distance_mm_ - last_mm_));
      last_mm_ = distance_mm_;
      has_turned_ = true;
      if (trend > length(kToleranceMm)) {
        robot_.led(platforms::kYellow);
        return robot_.right(platforms::turn_ticks<Robot>(kStepDeg));
      }
      if (trend < -length(kToleranceMm)) {
        robot_.led(platforms::kWhite);
        return robot_.left(platforms::turn_ticks<Robot>(kStepDeg));
      }
    }
    has_turned_ = false;
    robot_.led(platforms::kGreen);
    robot_.forward(platforms::forward_ticks<Robot>(kStepMm));
  }

  Robot& robot_;
  platforms::PublisherPointer<Robot> publisher_;
  EdgeRole role_;
  uint8_t number_;
  uint8_t partner_;
  uint8_t heard_tick_ = 0;    // seeds: of the partner
  uint8_t held_ = kNobody;    // followers: the seed that lets us; partner_ is the one we want
  bool has_turned_ = false;   // followers: in the last step
  bool has_reading_ = false;  // followers: since the last step
  bool is_taken_ = false;     // followers: the seed we want is another's
  Distance distance_mm_ = 0;  // followers: to the partner
  Distance last_mm_ = 0;      // followers: at the last step
};

}  // namespace suite
}  // namespace swarmtalk
