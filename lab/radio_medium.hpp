// The media `radio` and `radio-udp`: a process of the lab runs the Wi-Fi medium of sim/ in real
// time (lab/radio/). To it lead, for `radio`, a TAP device in each robot's network namespace, which
// needs root, and for `radio-udp` the daemons' UDP links on the loopback interface, which needs
// nothing. docs/radio.md says what it is like and how it is told to change while it runs.
#pragma once

#include "lab/medium.hpp"

namespace swarmtalk::lab {

class RadioMedium final : public Medium {
 public:
  explicit RadioMedium(bool has_namespaces) : has_namespaces_(has_namespaces) {}

  std::string name() const override { return has_namespaces_ ? "radio" : "radio-udp"; }
  std::string problem() const override;
  std::string without_namespaces() const override { return has_namespaces_ ? "radio-udp" : ""; }
  void plan(State& state) const override;
  void make(State& state) const override;
  LinkKeys link_of(const State& state, const Robot& robot) const override;
  bool is_air() const override { return true; }
  void remove(const State& state) const override;
  void refresh(State& state) const override;

  /// The medium of a lab in this process, until a signal ends it (keeper.hpp). @return which
  int serve(const State& state) const;

 private:
  bool has_namespaces_;
};

/// The same, of the lab's own kind.
int serve_radio(const State& state);

}  // namespace swarmtalk::lab
