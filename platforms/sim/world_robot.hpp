// A robot of the simulated world (sim/world.hpp) as programs see it: LED, wheels, timed moves. What
// a Kilobot and a Coachbot differ in is in the models below; the rest is the world's configuration.
#pragma once

#include <cstdint>

#include "platforms/robot.hpp"
#include "sim/world.hpp"
#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk::platforms {

/// The paper's 9-byte packets with 3 bytes of header and 1 of checksum, on every platform that is
/// compared; counters that do not saturate.
struct ComparedProfile : core::Kilobot {
  using Counter = uint32_t;
};

struct KilobotModel {
  static constexpr uint16_t kBodyMm = kKilobotBodyMm;
  static constexpr uint16_t kSpeedMmPerS = 10;
  static constexpr uint16_t kTurnDegPerS = 45;
  static constexpr double kTurnBack = 0;  // one motor turns alone
  static sim::WorldConfig world() { return {sim::kilobot_radio(), sim::kilobot_body(), {}, {}}; }
};

struct CoachbotModel {
  static constexpr uint16_t kBodyMm = 110;
  static constexpr uint16_t kSpeedMmPerS = 120;
  static constexpr uint16_t kTurnDegPerS = 153;
  static constexpr double kTurnBack = -1;  // wheels turn against each other
  static sim::WorldConfig world() {
    return {sim::coachbot_radio(), sim::coachbot_body(), {50, 1000000}, {}};
  }
};

/// @tparam P  what is compared, unless a sweep asks for another
template <class Model, class P = ComparedProfile>
class WorldRobot {
 public:
  using Profile = P;
  using World = sim::World<Profile>;
  using Distance = typename Profile::Sensing::Distance;
  static constexpr uint16_t kBodyMm = Model::kBodyMm;
  static constexpr uint16_t kSpeedMmPerS = Model::kSpeedMmPerS;
  static constexpr uint16_t kTurnDegPerS = Model::kTurnDegPerS;
  static constexpr uint32_t kTicksPerSecond = 31;

  WorldRobot(World& world, uint32_t index) : world_(&world), index_(index) {}

  core::Swarmtalk<Profile>& swarmtalk() { return world_->node(index_); }
  uint32_t clock() { return world_->ticks(index_); }
  uint32_t random() { return world_->random(index_); }
  static Distance distance(int32_t mm) { return static_cast<Distance>(mm); }
  void led(Colour colour) { colour_ = colour; }
  void forward(uint32_t ticks) { move(1, 1, ticks); }
  void left(uint32_t ticks) { move(Model::kTurnBack, 1, ticks); }
  void right(uint32_t ticks) { move(1, Model::kTurnBack, ticks); }
  void stop() { move(0, 0, 0); }
  bool is_moving() const { return moves_; }
  void log(const char*, int32_t) {}

  /// Ends timed moves; the owner calls it before each loop() of the program.
  void poll() {
    if (moves_ && for_ticks_ != 0 && clock() - since_ >= for_ticks_) stop();
  }

  Colour colour() const { return colour_; }
  World& world() { return *world_; }
  uint32_t index() const { return index_; }
  uint64_t time_us() const { return world_->now_us(); }

 private:
  void move(double left, double right, uint32_t ticks) {
    moves_ = left != 0 || right != 0;
    since_ = clock();
    for_ticks_ = ticks;
    world_->body(index_).drive(left, right);
  }

  World* world_;
  uint32_t index_;
  Colour colour_ = kOff;
  bool moves_ = false;
  uint32_t since_ = 0;
  uint32_t for_ticks_ = 0;
};

}  // namespace swarmtalk::platforms
