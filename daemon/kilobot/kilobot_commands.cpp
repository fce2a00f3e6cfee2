#include "daemon/kilobot/kilobot_commands.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

namespace swarmtalk::daemon {
namespace {

using namespace kilobot_bridge;

constexpr std::uint32_t kMostUid = 65535;
constexpr std::uint32_t kUidBits = 16;
constexpr std::uint32_t kMostDuty = 255;
constexpr std::uint32_t kMostChecksum = 65535;

Refusal bad(std::string text) {
  return {ipc::ERROR_BAD_COMMAND, std::move(text), std::nullopt};
}

std::optional<Refusal> plan_set_uid(const ipc::KilobotCommand& command, KilobotPlan& plan) {
  if (!command.has_uid() || command.uid() > kMostUid) return bad("a uid is 0 to 65535");
  plan.sequence = set_uid_sequence(static_cast<std::uint16_t>(command.uid()));
  plan.warnings.push_back("every robot that hears this gets uid " + std::to_string(command.uid()) +
                          ", and its motor values are saved too: have one robot in the light");
  return std::nullopt;
}

std::optional<Refusal> plan_read_uid(const ipc::KilobotCommand& command, KilobotPlan& plan) {
  if (command.has_bit()) {
    if (command.bit() >= kUidBits) return bad("a uid has the bits 0 to 15");
    const std::array<std::uint8_t, 1> bit{static_cast<std::uint8_t>(command.bit())};
    plan.sequence = read_uid_sequence(bit, false);
    return std::nullopt;
  }
  std::array<std::uint8_t, kUidBits> bits{};
  std::iota(bits.begin(), bits.end(), std::uint8_t{0});
  plan.sequence = read_uid_sequence(bits, true);
  return std::nullopt;
}

std::optional<Refusal> plan_calibrate(const ipc::KilobotCommand& command, KilobotPlan& plan) {
  const bool uses_left = command.motion() != ipc::KILOBOT_RIGHT;
  const bool uses_right = command.motion() != ipc::KILOBOT_LEFT;
  if (command.motion() < ipc::KILOBOT_LEFT || command.motion() > ipc::KILOBOT_STRAIGHT) {
    return bad("calibrate needs a motion: left, right or straight");
  }
  if (uses_left != command.has_left() || uses_right != command.has_right()) {
    return bad("calibrate needs a duty for each motor that turns, and for no other");
  }
  const std::uint32_t most = std::max(command.left(), command.right());
  if (most > kMostDuty) return bad("a motor's duty is 0 to 255, not " + std::to_string(most));
  if (most > kMostMotorDuty && !command.force()) {
    return bad("duty " + std::to_string(most) + " wears motors out: 60 to 90 is usual, above " +
               std::to_string(kMostMotorDuty) + " it must be forced (--force)");
  }
  const auto mode = static_cast<Calibration>(static_cast<int>(command.motion()) + 1);
  plan.sequence = calibrate_sequence(mode, static_cast<std::uint8_t>(command.left()),
                                     static_cast<std::uint8_t>(command.right()), command.save(),
                                     command.stop());
  if (!command.save() && !command.stop()) {
    plan.warnings.push_back("robots go on moving until they hear pause, save or reset");
  }
  return std::nullopt;
}

std::optional<Refusal> plan_send(const ipc::KilobotCommand& command, bool has_single,
                                 KilobotPlan& plan) {
  if (!command.has_message_type() || command.message_type() >= kilobot::kIrFirstControl) {
    return bad(
        "a message of a program has a type of 0 to 127; those above are commands, and some "
        "of them switch motors off");
  }
  IrData data{};
  if (command.data().size() > data.size()) {
    return bad("a message has at most 9 bytes, not " + std::to_string(command.data().size()));
  }
  std::copy(command.data().begin(), command.data().end(), data.begin());
  const auto type = static_cast<std::uint8_t>(command.message_type());
  if (!command.has_checksum()) {
    plan.sequence = message_sequence(type, data, has_single && !command.has_hold_ms());
    return std::nullopt;
  }
  if (command.checksum() > kMostChecksum) {
    return bad("a checksum has 16 bits: 0 to 65535, not " + std::to_string(command.checksum()));
  }
  plan.sequence = raw_message_sequence(type, data, static_cast<std::uint16_t>(command.checksum()));
  return std::nullopt;
}

template <class Number>
bool fits(std::int64_t number) {
  return number >= std::numeric_limits<Number>::min() &&
         number <= std::numeric_limits<Number>::max();
}

std::optional<Refusal> plan_position(const ipc::KilobotCommand& command, KilobotPlan& plan) {
  if (command.positions().empty() ||
      static_cast<std::size_t>(command.positions_size()) > kMostPositions) {
    return bad("position takes 1 to " + std::to_string(kMostPositions) + " robots, not " +
               std::to_string(command.positions_size()));
  }
  std::vector<GpsRecord> records;
  for (const ipc::KilobotPosition& each : command.positions()) {
    const std::string robot = "robot " + std::to_string(each.id());
    if (!fits<std::uint16_t>(each.id())) return bad(robot + ": an id is 0 to 65535");
    if (!fits<std::int16_t>(each.x()) || !fits<std::int16_t>(each.y())) {
      return bad(robot + ": x and y are -32768 to 32767; take a larger unit");
    }
    if (!fits<std::int8_t>(each.theta())) {
      return bad(robot + ": theta is -128 to 127; take a larger unit");
    }
    if (each.id() == 0 && each.x() == 0 && each.y() == 0 && each.theta() == 0) {
      return bad(
          "robot 0 at 0,0,0 ends the list for the controller; give robots uids from 1 on, or "
          "move the origin");
    }
    records.push_back({static_cast<std::uint16_t>(each.id()), static_cast<std::int16_t>(each.x()),
                       static_cast<std::int16_t>(each.y()),
                       static_cast<std::int8_t>(each.theta())});
  }
  plan.sequence = position_sequence(records);
  return std::nullopt;
}

std::optional<Refusal> plan_program(const ipc::KilobotCommand& command, KilobotPlan& plan) {
  const std::string& image = command.image();
  if (image.empty()) return bad("there is no program");
  if (image.size() > kMostProgramBytes) {
    return bad("the program has " + std::to_string(image.size()) + " bytes, at most " +
               std::to_string(kMostProgramBytes) + " fit: behind them lies the robots' bootloader");
  }
  const std::uint32_t passes = command.has_passes() ? command.passes() : kDefaultPasses;
  if (passes > kMostPasses) {
    return bad("at most " + std::to_string(kMostPasses) + " passes, or 0: until stopped");
  }
  const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(image.data()),
                                            image.size());
  plan.sequence = program_sequence(bytes, passes, command.asleep());
  const std::size_t pages = program_pages(image.size());
  plan.pages = static_cast<std::uint32_t>(pages);
  if (pages > kSafePages) {
    plan.warnings.push_back(
        "the program has " + std::to_string(pages) + " pages; above " + std::to_string(kSafePages) +
        " the way into the bootloader may be blocked: this could be the last program that these "
        "robots take over the air");
  }
  return std::nullopt;
}

std::optional<Refusal> plan_action(const ipc::KilobotCommand& command, bool has_single,
                                   KilobotPlan& plan) {
  switch (command.action()) {
    case ipc::KILOBOT_RUN:
      plan.sequence = command_sequence(Command::kRun);
      return std::nullopt;
    case ipc::KILOBOT_PAUSE:
      plan.sequence = command_sequence(Command::kPause);
      return std::nullopt;
    case ipc::KILOBOT_RESET:
      plan.sequence = command_sequence(Command::kReset);
      return std::nullopt;
    case ipc::KILOBOT_SLEEP:
      plan.sequence = command_sequence(Command::kSleep);
      return std::nullopt;
    case ipc::KILOBOT_WAKEUP:
      plan.sequence = command_sequence(Command::kWakeup);
      return std::nullopt;
    case ipc::KILOBOT_CHARGE:
      plan.sequence = command_sequence(Command::kCharge);
      return std::nullopt;
    case ipc::KILOBOT_VOLTAGE:
      plan.sequence = command_sequence(Command::kVoltage);
      return std::nullopt;
    case ipc::KILOBOT_LED:
      plan.sequence = led_sequence();
      return std::nullopt;
    case ipc::KILOBOT_STOP:
      plan.sequence = stop_sequence();
      return std::nullopt;
    case ipc::KILOBOT_SET_UID:
      return plan_set_uid(command, plan);
    case ipc::KILOBOT_READ_UID:
      return plan_read_uid(command, plan);
    case ipc::KILOBOT_CALIBRATE:
      return plan_calibrate(command, plan);
    case ipc::KILOBOT_SEND:
      return plan_send(command, has_single, plan);
    case ipc::KILOBOT_PROGRAM:
      return plan_program(command, plan);
    case ipc::KILOBOT_BOOTLOAD:
      plan.sequence = bootload_sequence(command.asleep());
      return std::nullopt;
    case ipc::KILOBOT_POSITION:
      return plan_position(command, plan);
    default:
      return bad("this daemon does not know command " + std::to_string(command.action()));
  }
}

bool can_be_held(ipc::KilobotAction action) {
  return (action >= ipc::KILOBOT_RUN && action <= ipc::KILOBOT_VOLTAGE) ||
         action == ipc::KILOBOT_SEND || action == ipc::KILOBOT_BOOTLOAD ||
         action == ipc::KILOBOT_POSITION;
}

}  // namespace

std::optional<Refusal> plan_kilobot_command(const ipc::KilobotCommand& command, bool has_single,
                                            KilobotPlan& plan) {
  if (auto refusal = plan_action(command, has_single, plan)) return refusal;
  if (!command.has_hold_ms()) return std::nullopt;
  const std::chrono::milliseconds hold(command.hold_ms());
  if (!can_be_held(command.action())) return bad(plan.sequence.name + " has a time of its own");
  if (hold > kMostHold) return bad("a message is held for at most an hour, or 0: until stopped");
  plan.sequence = held(std::move(plan.sequence), hold);
  return std::nullopt;
}

}  // namespace swarmtalk::daemon
