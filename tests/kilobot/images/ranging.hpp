// Says its number over SwarmTalk without pause and remembers how far away the last speaker was: the
// same program on our hardware layer and on kilolib, to compare what the two measure.
#pragma once

#include <stdint.h>

#include "platforms/robot.hpp"

// What an emulator looks at.
extern volatile uint16_t ranging_heard;       // messages, wraps
extern volatile int16_t ranging_distance_mm;  // of the last one

namespace swarmtalk {
namespace kilobot {

template <class Robot>
class Ranging {
 public:
  explicit Ranging(Robot& robot) : robot_(robot) {}

  void setup() {
    core::Channel<Profile>* channel = robot_.swarmtalk().new_channel(0, 0, false);
    publisher_ = channel->new_publisher(&on_sent, this);
    channel->new_subscriber(Robot::distance(1000), &on_message, nullptr);
    on_sent(this);
  }
  void loop() {}

 private:
  using Profile = typename Robot::Profile;

  static void on_sent(void* self) {
    Ranging* ranging = static_cast<Ranging*>(self);
    ranging->publisher_->send(&ranging->number_, 1);
    ++ranging->number_;
  }
  static void on_message(void*, const uint8_t*, uint16_t,
                         const core::Reception<Profile>& reception) {
    ranging_distance_mm = reception.sensing.distance;
    ranging_heard = static_cast<uint16_t>(ranging_heard + 1);
  }

  Robot& robot_;
  core::Publisher<Profile>* publisher_ = nullptr;
  uint8_t number_ = 0;
};

}  // namespace kilobot
}  // namespace swarmtalk
