#include "cli/kilobot/calibration.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "cli/look/screen.hpp"

namespace swarmtalk::cli {
namespace {

constexpr int kMostDuty = 120;  // above it motors wear out
constexpr int kLargeStep = 10;
constexpr std::uint32_t kMostUid = 65535;
constexpr std::size_t kUidDigits = 5;
constexpr std::array<const char*, 4> kNames{"turn left", "turn right", "straight left",
                                            "straight right"};
constexpr std::array<ipc::KilobotMotion, 3> kMotions{ipc::KILOBOT_LEFT, ipc::KILOBOT_RIGHT,
                                                     ipc::KILOBOT_STRAIGHT};

std::string row(bool is_chosen, const std::string& name, const std::string& value,
                const std::string& state) {
  char text[128];
  std::snprintf(text, sizeof text, "%c %-16s %5s  %s", is_chosen ? '>' : ' ', name.c_str(),
                value.c_str(), state.c_str());
  return text;
}

}  // namespace

ipc::KilobotMotion Calibration::motion_of(std::size_t duty) {
  return kMotions[std::min<std::size_t>(duty, kStraightLeft)];
}

void Calibration::press(int key) {
  if (is_ending_) return;
  if (is_typing_) return type(key);
  switch (key) {
    case Screen::kUp:
    case 'k':
      chosen_ = (chosen_ + kDuties - 1) % kDuties;
      break;
    case Screen::kDown:
    case 'j':
      chosen_ = (chosen_ + 1) % kDuties;
      break;
    case Screen::kLeft:
    case '-':
      return change(-1);
    case Screen::kRight:
    case '+':
      return change(1);
    case Screen::kPageDown:
      return change(-kLargeStep);
    case Screen::kPageUp:
      return change(kLargeStep);
    case '\n':
    case '\r':
      return move(motion_of(chosen_));
    case ' ':
      return pause();
    case 's':
      return save();
    case 'u':
      is_typing_ = true;
      typed_.clear();
      remark_ = "type a uid, 0 to 65535, then Enter; Esc gives up";
      break;
    case 'n':
      may_move_ = may_move_ || in_hand_.action() == ipc::KILOBOT_CALIBRATE;
      in_hand_.Clear();
      waiting_.clear();
      for (Value& value : values_) value.heard = Heard::kNothing;
      uid_.clear();
      uid_state_ = "as it is";
      last_motion_ = ipc::KILOBOT_NO_MOTION;
      remark_ = "another robot: it has heard nothing yet";
      break;
    case 'q':
      return quit();
    default:
      break;
  }
}

void Calibration::type(int key) {
  if (key >= '0' && key <= '9' && typed_.size() < kUidDigits) {
    typed_ += static_cast<char>(key);
  } else if (key == Screen::kBackspace || key == Screen::kDelete || key == '\b') {
    if (!typed_.empty()) typed_.pop_back();
  } else if (key == Screen::kEscape) {
    is_typing_ = false;
    remark_ = "the uid stays as it is";
  } else if (key == '\n' || key == '\r') {
    set_uid();
  }
}

void Calibration::change(int by) {
  Value& value = values_[chosen_];
  const int wanted = static_cast<int>(value.duty) + by;
  const int duty = std::clamp(wanted, 0, kMostDuty);
  if (duty != static_cast<int>(value.duty)) {
    value.duty = static_cast<std::uint32_t>(duty);
    move(motion_of(chosen_));
  }
  if (wanted > kMostDuty) remark_ = "120 is the most here: above it motors wear out";
}

void Calibration::move(ipc::KilobotMotion motion) {
  std::erase_if(waiting_, [motion](const ipc::KilobotCommand& each) {
    return each.action() == ipc::KILOBOT_PAUSE ||
           (each.action() == ipc::KILOBOT_CALIBRATE && each.motion() == motion && !each.save());
  });
  mark(motion, Heard::kToBeSent);
  last_motion_ = motion;
  waiting_.push_back(motion_command(motion));
  remark_ = "the robot is to move";
}

void Calibration::save() {
  if (last_motion_ == ipc::KILOBOT_NO_MOTION) {
    remark_ = "nothing to save: change a duty, or Enter, first";
    return;
  }
  // All that is shown as sent once more: a robot may have missed one of them.
  std::erase_if(waiting_, [](const ipc::KilobotCommand& each) {
    return each.action() == ipc::KILOBOT_CALIBRATE || each.action() == ipc::KILOBOT_PAUSE;
  });
  for (std::size_t duty = kTurnLeft; duty <= kStraightLeft; ++duty) {
    const ipc::KilobotMotion motion = motion_of(duty);
    if (values_[duty].heard == Heard::kNothing || motion == last_motion_) continue;
    waiting_.push_back(motion_command(motion));
  }
  waiting_.push_back(motion_command(last_motion_));
  waiting_.back().set_save(true);
  remark_ = "saving: the robot moves with each value, then stands";
}

void Calibration::pause() {
  std::erase_if(waiting_, [](const ipc::KilobotCommand& each) {
    return each.action() == ipc::KILOBOT_CALIBRATE && !each.save();
  });
  for (Value& value : values_) {
    if (value.heard == Heard::kToBeSent) value.heard = Heard::kNothing;
  }
  waiting_.emplace_back().set_action(ipc::KILOBOT_PAUSE);
  remark_ = "the robot is to stand still";
}

void Calibration::set_uid() {
  if (typed_.empty() || std::stoul(typed_) > kMostUid) {
    remark_ = "a uid is 0 to 65535";
    return;
  }
  is_typing_ = false;
  uid_ = std::to_string(std::stoul(typed_));
  ipc::KilobotCommand& command = waiting_.emplace_back();
  command.set_action(ipc::KILOBOT_SET_UID);
  command.set_uid(static_cast<std::uint32_t>(std::stoul(uid_)));
  uid_state_ = "to be sent";
  remark_ = "uid and duties are to be saved in the robot";
}

void Calibration::quit() {
  is_ending_ = true;
  is_typing_ = false;
  const bool is_moving = may_move_ || in_hand_.action() == ipc::KILOBOT_CALIBRATE;
  std::erase_if(waiting_, [](const ipc::KilobotCommand& each) {
    return each.action() == ipc::KILOBOT_CALIBRATE && !each.save();
  });
  if (is_moving || has_next()) pause();
}

ipc::KilobotCommand Calibration::take_next() {
  in_hand_ = std::move(waiting_.front());
  waiting_.pop_front();
  return in_hand_;
}

void Calibration::on_sent() {
  const ipc::KilobotCommand sent = std::exchange(in_hand_, {});
  if (sent.action() == ipc::KILOBOT_UNSPECIFIED) return;  // it was for the robot before
  if (sent.action() == ipc::KILOBOT_PAUSE) {
    may_move_ = false;
    was_paused_ = true;
    remark_ = "pause was sent";
    return;
  }
  was_paused_ = false;
  may_move_ = sent.action() == ipc::KILOBOT_CALIBRATE && !sent.save();
  if (sent.action() == ipc::KILOBOT_SET_UID) uid_state_ = "sent and saved";
  if (sent.action() == ipc::KILOBOT_CALIBRATE) {
    // Another duty may be shown meanwhile.
    const ipc::KilobotCommand shown = motion_command(sent.motion());
    const bool is_shown = shown.left() == sent.left() && shown.right() == sent.right();
    if (is_shown) mark(sent.motion(), Heard::kIt);
    remark_ = "sent; the robot moves until pause, save or another motion";
  }
  if (sent.save() || sent.action() == ipc::KILOBOT_SET_UID) {
    for (Value& value : values_) {
      if (value.heard == Heard::kIt) value.heard = Heard::kSaved;
    }
    remark_ = "save was sent: a robot that heard it stands still now";
  }
}

void Calibration::on_failed(const std::string& why) {
  if (in_hand_.action() == ipc::KILOBOT_CALIBRATE) mark(in_hand_.motion(), Heard::kNothing);
  if (in_hand_.action() == ipc::KILOBOT_SET_UID) uid_state_ = "not sent";
  in_hand_.Clear();
  for (const ipc::KilobotCommand& each : waiting_) {
    if (each.action() == ipc::KILOBOT_CALIBRATE) mark(each.motion(), Heard::kNothing);
  }
  waiting_.clear();
  remark_ = why;
}

void Calibration::mark(ipc::KilobotMotion motion, Heard heard) {
  for (std::size_t duty = 0; duty < kDuties; ++duty) {
    if (motion_of(duty) == motion) values_[duty].heard = heard;
  }
}

ipc::KilobotCommand Calibration::motion_command(ipc::KilobotMotion motion) const {
  ipc::KilobotCommand command;
  command.set_action(ipc::KILOBOT_CALIBRATE);
  command.set_motion(motion);
  if (motion == ipc::KILOBOT_LEFT) command.set_left(values_[kTurnLeft].duty);
  if (motion == ipc::KILOBOT_RIGHT) command.set_right(values_[kTurnRight].duty);
  if (motion == ipc::KILOBOT_STRAIGHT) {
    command.set_left(values_[kStraightLeft].duty);
    command.set_right(values_[kStraightRight].duty);
  }
  return command;
}

std::vector<std::string> Calibration::lines(const std::string& link, std::size_t width) const {
  static constexpr std::array<const char*, 4> kStates{"not sent", "to be sent", "sent",
                                                      "sent and saved"};
  std::vector<std::string> lines{"calibrate" + (link.empty() ? "" : ", link " + link), "",
                                 "MOTION              DUTY  ROBOT"};
  for (std::size_t duty = 0; duty < kDuties; ++duty) {
    lines.push_back(row(duty == chosen_ && !is_typing_, kNames[duty],
                        std::to_string(values_[duty].duty),
                        kStates[static_cast<std::size_t>(values_[duty].heard)]));
  }
  lines.push_back(row(is_typing_, "uid",
                      is_typing_     ? typed_ + "_"
                      : uid_.empty() ? "-"
                                     : uid_,
                      is_typing_ ? "" : uid_state_));
  lines.insert(lines.end(), {"", remark_, "", "up/down choose   left/right change by 1",
                             "PgUp/PgDn by 10  Enter send again", "space pause      s save",
                             "u uid            n next robot    q quit"});
  for (std::string& line : lines) {
    if (line.size() > width) line.resize(width);
  }
  return lines;
}

std::string Calibration::summary() const {
  std::string text;
  bool is_saved = true;
  for (std::size_t duty = 0; duty < kDuties; ++duty) {
    const Value& value = values_[duty];
    if (value.heard != Heard::kIt && value.heard != Heard::kSaved) continue;
    is_saved = is_saved && value.heard == Heard::kSaved;
    text += std::string(text.empty() ? "" : ", ") + kNames[duty] + " " + std::to_string(value.duty);
  }
  if (text.empty()) return was_paused_ ? "pause was sent" : "nothing was sent";
  return text + (is_saved ? "; save was sent" : "; not saved: reset ends them") +
         (was_paused_ ? "; pause was sent" : "");
}

}  // namespace swarmtalk::cli
