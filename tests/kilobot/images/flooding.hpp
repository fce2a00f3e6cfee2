// Floods messages of one packet and counts what it hears, to compare with what others have sent.
// One image for all: what a robot does is in its uid (FloodingUid).
#pragma once

#include <stdint.h>

#include "platforms/robot.hpp"

// What an emulator looks at; of the robot's present start.
extern volatile uint16_t flooding_sent;      // messages that have left
extern volatile uint16_t flooding_heard;     // messages of others, copies included
extern volatile uint16_t flooding_first;     // of these, others' first 16 since their start
extern volatile uint16_t flooding_twice;     // of these, no newer than the one before
extern volatile uint16_t flooding_own_back;  // own messages heard as if they were another's
extern volatile uint8_t flooding_node_id;    // 0 until RUN
extern volatile uint8_t flooding_id_changes;

namespace swarmtalk {
namespace kilobot {

/// What the upper byte of a uid asks for. The lower one tells robots apart.
enum FloodingUid : uint16_t {
  kSends = 0x100,   // or listens only
  kSlowly = 0x200,  // a message every 16 ticks, or as soon as the last has left
  kOneHop = 0x400,  // TTL 0, or 3
  kOwnId = 0x800,   // the uid's lower byte is the node id, and stays it; or it is drawn
};

template <class Robot>
class Flooding {
 public:
  Flooding(Robot& robot, uint16_t uid) : robot_(robot), uid_(uid) {}

  void setup() {
    if (is(kOwnId)) robot_.swarmtalk().set_node_id(name());
    core::Channel<Profile>* channel = robot_.swarmtalk().new_channel(0, is(kOneHop) ? 0 : 3, false);
    publisher_ = channel->new_publisher(&on_sent, this);
    channel->new_subscriber(Robot::distance(1000), &on_message, this);
    last_ = static_cast<uint8_t>(robot_.clock());
    if (is(kSends) && !is(kSlowly)) send();
  }

  void loop() {
    flooding_node_id = robot_.swarmtalk().node_id();
    flooding_id_changes = robot_.swarmtalk().counters().id_changes;
    if (!is(kSends) || !is(kSlowly)) return;
    if (static_cast<uint8_t>(robot_.clock() - last_) < kTicks) return;
    last_ = static_cast<uint8_t>(last_ + kTicks);
    send();
  }

 private:
  using Profile = typename Robot::Profile;
  static constexpr uint8_t kTicks = 16;  // from one message to the next
  static constexpr uint8_t kFirst = 16;  // messages
  static_assert(core::Wire<Profile>::kPayloadBytes >= 3, "a message fits one packet");

  bool is(FloodingUid what) const { return (uid_ & what) != 0; }
  uint8_t name() const { return static_cast<uint8_t>(uid_); }

  void send() {
    const uint8_t message[] = {name(), static_cast<uint8_t>(number_),
                               static_cast<uint8_t>(number_ >> 8)};
    if (publisher_->send(message, sizeof(message)) == core::Error::kOk) ++number_;
  }

  static void on_sent(void* self) {
    count(flooding_sent);
    Flooding& me = *static_cast<Flooding*>(self);
    if (!me.is(kSlowly)) me.send();
  }

  static void on_message(void* self, const uint8_t* bytes, uint16_t,
                         const core::Reception<Profile>&) {
    Flooding& me = *static_cast<Flooding*>(self);
    if (bytes[0] == me.name()) return count(flooding_own_back);
    const uint16_t number = static_cast<uint16_t>(bytes[1] | static_cast<uint16_t>(bytes[2]) << 8);
    if (flooding_heard != 0 && static_cast<int16_t>(number - me.heard_) <= 0) {
      count(flooding_twice);
    }
    me.heard_ = number;
    count(flooding_heard);
    if (number < kFirst) count(flooding_first);
  }

  static void count(volatile uint16_t& counter) { counter = static_cast<uint16_t>(counter + 1); }

  Robot& robot_;
  const uint16_t uid_;
  core::Publisher<Profile>* publisher_ = nullptr;
  uint16_t number_ = 0;  // of the next message
  uint16_t heard_ = 0;   // number heard last
  uint8_t last_ = 0;     // when a message was due last
};

}  // namespace kilobot
}  // namespace swarmtalk
