// Joins a program of the suite, or one written like it, with this platform: an image is
//
//   #include "platforms/kilobot/join.hpp"
//   static swarmtalk::kilobot::Joined<MyProgram> joined;
//   int main() { joined.run(); }
//
// where MyProgram is a template over Robot with setup() and loop().
#pragma once

#include "platforms/kilobot/kilobot_robot.hpp"

namespace swarmtalk {
namespace kilobot {

/// One robot and its program, without heap. There is one per image: the main loop calls plain
/// functions, which find it here.
/// @tparam Robot  KilobotRobot, or ClassicKilobotRobot for the wire format of 2020
template <template <class> class ProgramTemplate, class Robot = KilobotRobot>
class Joined {
 public:
  /// @param arguments  what the program's constructor takes behind the robot
  template <class... Arguments>
  explicit Joined(Arguments... arguments) : program_(robot_, arguments...) {
    instance_ = this;
  }

  [[noreturn]] void run(uint16_t spacing = kDefaultSpacing) {
    run_program({&setup, &loop, &receive, &next}, spacing);
  }

 private:
  static void setup() { instance_->program_.setup(); }
  static void loop() { instance_->program_.loop(); }
  static void receive(const IrReception& reception) { instance_->robot_.receive(reception); }
  static bool next(IrMessage& out) { return instance_->robot_.next(out); }

  static Joined* instance_;
  Robot robot_;
  ProgramTemplate<Robot> program_;
};

template <template <class> class ProgramTemplate, class Robot>
Joined<ProgramTemplate, Robot>* Joined<ProgramTemplate, Robot>::instance_ = nullptr;

}  // namespace kilobot
}  // namespace swarmtalk
