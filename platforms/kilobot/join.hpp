// Joins a program of the suite, or one written like it, with this platform: an image is
//
//   #include "platforms/kilobot/join.hpp"
//   static swarmtalk::kilobot::Joined<MyProgram> joined;
//   int main() { joined.run(); }
//
// where MyProgram is a template over Robot with setup() and loop().
#pragma once

#include <stddef.h>

#include "platforms/kilobot/kilobot_robot.hpp"

namespace swarmtalk {
namespace kilobot {

/// Where an object of this image is made (there is no <new> for this processor).
struct Place {
  void* address;
};

}  // namespace kilobot
}  // namespace swarmtalk

inline void* operator new(size_t, swarmtalk::kilobot::Place place) noexcept {
  return place.address;
}

/// Gives an image an absolute symbol with a value and a size, for who looks at robots from outside.
/// Costs nothing on the robot. In what is called once.
#define SWARMTALK_KILOBOT_SYMBOL(name, value, bytes)                                       \
  __asm__ volatile(".global " #name "\n\t.set " #name ", %0\n\t.type " #name               \
                   ", @object\n\t.size " #name ", %1" ::"i"(static_cast<unsigned>(value)), \
                   "i"(static_cast<unsigned>(bytes)))

/// offset_NAME, as large as the variable: how many bytes behind `joined` (an object of Joined) a
/// variable of its program lies.
#define SWARMTALK_KILOBOT_OFFSET(name, joined, variable) \
  SWARMTALK_KILOBOT_SYMBOL(offset_##name, (joined).offset_of(variable), sizeof(variable))

namespace swarmtalk {
namespace kilobot {

/// One robot and its program, without heap. There is one per image: the main loop calls plain
/// functions, which find it here. Its address is known when the image is built, not looked up,
/// which saves a twentieth of an image's flash.
/// @tparam Robot  KilobotRobot, or ClassicKilobotRobot for the wire format of 2020
template <template <class> class ProgramTemplate, class Robot = KilobotRobot>
class Joined {
 public:
  /// @param arguments  what the program's constructor takes behind the robot
  template <class... Arguments>
  explicit Joined(Arguments... arguments) {
    new (Place{&room_.parts}) Parts(arguments...);
  }

  [[noreturn]] void run(uint16_t period = kDefaultPeriod) {
    tell_fields();
    run_program({&setup, &loop, &receive, &next}, period);
  }

  static const ProgramTemplate<Robot>& program() { return room_.parts.program; }
  /// Of a variable of the program: bytes from the symbol room_.
  template <class T>
  static ptrdiff_t offset_of(const T& variable) {
    return reinterpret_cast<const char*>(&variable) - reinterpret_cast<const char*>(&room_);
  }

 private:
  struct Parts {
    template <class... Arguments>
    explicit Parts(Arguments... arguments) : program(robot, arguments...) {}
    Robot robot;
    ProgramTemplate<Robot> program;
  };

  /// Memory for the parts, which are made with arguments that are known late.
  union Room {
    constexpr Room() : none(0) {}  // constant: nothing to do at start
    unsigned char none;
    Parts parts;
  };

  /// Symbols field_NAME: the first bit of a field in a packet, counted from the first bit of its
  /// first byte; as large as the field has bits.
  static void tell_fields() {
    using P = typename Robot::Profile;
    using Wire = core::Wire<P>;
    SWARMTALK_KILOBOT_SYMBOL(field_node, 0, P::kNodeBits);
    SWARMTALK_KILOBOT_SYMBOL(field_message, Wire::kMessageAt, P::kMessageBits);
    SWARMTALK_KILOBOT_SYMBOL(field_sequence, Wire::kSequenceAt, P::kSequenceBits);
    SWARMTALK_KILOBOT_SYMBOL(field_end, Wire::kEndAt, 1);
    SWARMTALK_KILOBOT_SYMBOL(field_channel, Wire::kChannelAt, P::kChannelBits);
  }

  static Parts& parts() { return room_.parts; }
  static void setup() { parts().program.setup(); }
  static void loop() { parts().program.loop(); }
  static void receive(const IrReception& reception) { parts().robot.receive(reception); }
  static bool next(IrMessage& out) { return parts().robot.next(out); }

  static Room room_;
};

template <template <class> class ProgramTemplate, class Robot>
typename Joined<ProgramTemplate, Robot>::Room Joined<ProgramTemplate, Robot>::room_;

}  // namespace kilobot
}  // namespace swarmtalk
