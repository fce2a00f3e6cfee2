// What the screen of `swarmtalk-cli kilobot calibrate` knows: four motor duties, which of them the
// robot has heard, and what each key does to them. Robots tell nothing of theirs, so a duty that
// was not sent is whatever that robot has. No I/O.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "ipc/framing.hpp"

namespace swarmtalk::cli {

class Calibration {
 public:
  /// A key, as Screen::key() tells it, changes what is shown and what is to be sent.
  void press(int key);
  /// The end is near: a robot that may be moving is to be paused.
  void quit();

  /// What is to be sent next; only the latest of a motion is kept.
  bool has_next() const { return !waiting_.empty(); }
  ipc::KilobotCommand take_next();

  /// That one was sent, or was not.
  void on_sent();
  void on_failed(const std::string& why);

  bool is_ending() const { return is_ending_; }

  std::vector<std::string> lines(const std::string& link, std::size_t width) const;
  /// One line for after the screen: what the robot was told, and whether it keeps it.
  std::string summary() const;

 private:
  enum Duty : std::uint8_t { kTurnLeft, kTurnRight, kStraightLeft, kStraightRight, kDuties };
  enum class Heard : std::uint8_t { kNothing, kToBeSent, kIt, kSaved };
  struct Value {
    std::uint32_t duty;
    Heard heard = Heard::kNothing;
  };

  static ipc::KilobotMotion motion_of(std::size_t duty);
  void type(int key);
  void change(int by);
  void move(ipc::KilobotMotion motion);
  void save();
  void pause();
  void set_uid();
  void mark(ipc::KilobotMotion motion, Heard heard);
  ipc::KilobotCommand motion_command(ipc::KilobotMotion motion) const;

  std::array<Value, kDuties> values_{Value{70}, Value{70}, Value{65}, Value{65}};
  std::size_t chosen_ = kTurnLeft;
  std::deque<ipc::KilobotCommand> waiting_;
  ipc::KilobotCommand in_hand_;
  ipc::KilobotMotion last_motion_ = ipc::KILOBOT_NO_MOTION;  // that was asked for
  std::string uid_;                                          // the last one asked for
  std::string typed_;                                        // so far
  std::string uid_state_ = "as it is";
  std::string remark_ = "have ONE robot in the light";
  bool is_typing_ = false;
  bool is_ending_ = false;
  bool may_move_ = false;  // the robot, as far as it has heard us
  bool was_paused_ = false;
};

}  // namespace swarmtalk::cli
