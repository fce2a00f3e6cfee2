// A robot of the simulated swarm (sim/swarm.hpp) as programs see it. Its body is a colour and a
// motion that others may read; positions in the swarm's unit are hundredths of it in distances.
#pragma once

#include <cstdint>

#include "platforms/robot.hpp"
#include "sim/swarm.hpp"

namespace swarmtalk::platforms {

template <class P>
class SimRobot {
 public:
  using Profile = P;
  using Distance = typename P::Sensing::Distance;
  static constexpr uint16_t kBodyMm = kKilobotBodyMm;
  static constexpr uint32_t kTicksPerSecond = 31;

  explicit SimRobot(sim::SimRobot<P>& body) : body_(body) {}

  core::Swarmtalk<P>& swarmtalk() { return body_.node; }
  uint32_t clock() { return body_.ticks(); }
  uint32_t random() { return body_.random(); }
  static Distance distance(int32_t mm) { return static_cast<Distance>(mm); }
  void led(Colour colour) { colour_ = colour; }
  void forward(uint32_t ticks) { move(1, 1, ticks); }
  void left(uint32_t ticks) { move(0, 1, ticks); }
  void right(uint32_t ticks) { move(1, 0, ticks); }
  void stop() { move(0, 0, 0); }
  bool is_moving() { return (left_ != 0 || right_ != 0) && !is_over(); }
  void log(const char*, int32_t) {}

  Colour colour() const { return colour_; }

 private:
  void move(int left, int right, uint32_t ticks) {
    left_ = left;
    right_ = right;
    since_ = clock();
    for_ticks_ = ticks;
  }
  bool is_over() { return for_ticks_ != 0 && clock() - since_ >= for_ticks_; }

  sim::SimRobot<P>& body_;
  Colour colour_ = kOff;
  int left_ = 0;
  int right_ = 0;
  uint32_t since_ = 0;
  uint32_t for_ticks_ = 0;
};

}  // namespace swarmtalk::platforms
