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

/// Gives an image the absolute symbol offset_NAME, as large as the variable: how many bytes behind
/// `joined` (an object of Joined) a variable of its program lies, for who looks at a robot's memory
/// from outside. Costs nothing on the robot. In main() or what is called once.
#define SWARMTALK_KILOBOT_OFFSET(name, joined, variable)                    \
  __asm__ volatile(".global offset_" #name "\n\t.set offset_" #name         \
                   ", %0\n\t"                                               \
                   ".type offset_" #name ", @object\n\t.size offset_" #name \
                   ", %1" ::"i"((joined).offset_of(variable)),              \
                   "i"(sizeof(variable)))

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

  [[noreturn]] void run(uint16_t spacing = kDefaultSpacing) {
    run_program({&setup, &loop, &receive, &next}, spacing);
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
