// The medium `radio`: one network namespace per robot, in it a TAP device whose other end is held
// by a process of the lab that runs the Wi-Fi medium of sim/ in real time (lab/radio/). Needs root.
// docs/radio.md says what it is like and how it is told to change while it runs.
#pragma once

#include "lab/medium.hpp"

namespace swarmtalk::lab {

class RadioMedium final : public Medium {
 public:
  std::string name() const override { return "radio"; }
  std::string problem() const override;
  void plan(State& state) const override;
  void make(State& state) const override;
  LinkKeys link_of(const State& state, const Robot& robot) const override;
  void remove(const State& state) const override;
  void refresh(State& state) const override;

  /// The medium of a lab in this process, until a signal ends it (keeper.hpp). @return which
  static int serve(const State& state);
};

}  // namespace swarmtalk::lab
