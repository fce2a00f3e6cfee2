// What `swarmtalk-cli kilobot` understands.
#include "cli/kilobot/kilobot.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

namespace swarmtalk::cli {
namespace {

constexpr const char* kKilobotFooter =
    R"(Robots answer nothing: "sent" says that the overhead controller was told, no more.
One command at a time; Ctrl-C ends it with a STOP. Wiring, calibration, programming and pitfalls:
docs/kilobot.md.)";

CLI::Validator whole(std::uint32_t most) {
  const auto check = [most](const std::string& word) {
    const bool is_digits = !word.empty() && word.size() <= 9 &&
                           word.find_first_not_of("0123456789") == std::string::npos;
    if (is_digits && std::stoul(word) <= most) return std::string();
    return "must be 0 to " + std::to_string(most) + ", not " + word;
  };
  return CLI::Validator(check, "");
}

CLI::App* add(CLI::App& app, KilobotArguments& arguments, ipc::KilobotAction action,
              const char* name, const char* text) {
  auto* command = app.add_subcommand(name, text);
  command->callback([&arguments, action, command] {
    arguments.command.set_action(action);
    arguments.name = command->get_name();
  });
  return command;
}

/// Seconds, as --hold takes them.
CLI::Validator seconds_of_hold() {
  const auto check = [](const std::string& word) {
    const bool is_short = !word.empty() && word.size() <= 9 &&
                          word.find_first_not_of("0123456789.") == std::string::npos &&
                          std::count(word.begin(), word.end(), '.') <= 1 && word != ".";
    const double seconds_held = is_short ? std::stod(word) : -1;
    if (seconds_held == 0 || (seconds_held >= 0.05 && seconds_held <= 3600)) return std::string();
    return "must be 0.05 to 3600 seconds, or 0: until Ctrl-C, not " + word;
  };
  return CLI::Validator(check, "");
}

CLI::App* holdable(CLI::App* command, KilobotArguments& arguments) {
  command->add_option("--hold", arguments.hold_s, "seconds to repeat it; 0: until Ctrl-C")
      ->check(seconds_of_hold());
  return command;
}

void add_calibrate(CLI::App& app, KilobotArguments& arguments) {
  auto* calibrate = app.add_subcommand(
      "calibrate", "Set motor duties on a live screen, or send one with left, right, straight");
  calibrate->require_subcommand(0, 1);
  calibrate->callback([&arguments, calibrate] {
    if (!calibrate->get_subcommands().empty()) return;
    arguments.is_on_screen = true;
    arguments.name = "calibrate";
  });
  const auto add_motion = [&](const char* name, const char* text, ipc::KilobotMotion motion) {
    auto* command = calibrate->add_subcommand(name, text);
    command->callback([&arguments, motion] {
      arguments.command.set_action(ipc::KILOBOT_CALIBRATE);
      arguments.command.set_motion(motion);
      arguments.name = "calibrate";
    });
    command->add_flag("--save", arguments.saves, "keep uid and all motor duties in the robot");
    command->add_flag("--stop", arguments.stops, "let it stand still afterwards");
    command->add_flag("--force", arguments.is_forced, "above 120, which wears motors out");
    return command;
  };
  auto* left = add_motion("left", "turn left", ipc::KILOBOT_LEFT);
  left->add_option("DUTY", arguments.left, "60 to 90 is usual")->required()->check(whole(255));
  auto* right = add_motion("right", "turn right", ipc::KILOBOT_RIGHT);
  right->add_option("DUTY", arguments.right, "60 to 90 is usual")->required()->check(whole(255));
  auto* straight = add_motion("straight", "go straight", ipc::KILOBOT_STRAIGHT);
  straight->add_option("LEFT", arguments.left, "60 to 90 is usual")->required()->check(whole(255));
  straight->add_option("RIGHT", arguments.right, "60 to 90 is usual")
      ->required()
      ->check(whole(255));
}

}  // namespace

void add_kilobot(CLI::App& app, KilobotArguments& arguments) {
  auto* kilobot = app.add_subcommand("kilobot", "Send commands and programs to Kilobots");
  kilobot->require_subcommand(1);
  kilobot->footer(kKilobotFooter);
  kilobot->add_option("--link", arguments.link, "which link, if several are of type kilobot");
  kilobot->fallthrough();
  const auto simple = [&](ipc::KilobotAction action, const char* name, const char* text) {
    return add(*kilobot, arguments, action, name, text);
  };
  const auto held = [&](ipc::KilobotAction action, const char* name, const char* text) {
    return holdable(simple(action, name, text), arguments);
  };
  held(ipc::KILOBOT_RUN, "run", "Start the robots' program, or go on with it");
  held(ipc::KILOBOT_PAUSE, "pause", "Let robots that are awake stand still");
  held(ipc::KILOBOT_RESET, "reset", "Start the program again; run must follow");
  held(ipc::KILOBOT_SLEEP, "sleep", "Power robots down; wakeup brings them back");
  held(ipc::KILOBOT_WAKEUP, "wakeup", "Wake sleeping robots up, 12 s: they listen every 8 s");
  held(ipc::KILOBOT_CHARGE, "charge", "Show by red flashes whether a robot charges");
  held(ipc::KILOBOT_VOLTAGE, "voltage", "Show the battery: green, blue, yellow, red");
  simple(ipc::KILOBOT_LED, "led", "Toggle the overhead controller's own LED: tests the line only");
  simple(ipc::KILOBOT_STOP, "stop", "End whatever is being sent, other programs' commands too");
  auto* uid = simple(ipc::KILOBOT_SET_UID, "set-uid", "Give a uid; have ONE robot in the light");
  uid->add_option("UID", arguments.uid, "0 to 65535")->required()->check(whole(65535));
  simple(ipc::KILOBOT_READ_UID, "read-uid", "Show the uid bit by bit: a robot turns for a 1");
  add_calibrate(*kilobot, arguments);
  auto* send = held(ipc::KILOBOT_SEND, "send", "Send one infrared message to the programs");
  send->add_option("TYPE", arguments.message_type, "0 to 127")->required();
  send->add_option("HEX", arguments.data_hex, "at most 9 bytes, as in 01:02:ff; default: zeros");
  send->add_option("--checksum", arguments.checksum,
                   "four hexadecimal digits to send instead of the right one, as in 0xa718");
  held(ipc::KILOBOT_POSITION, "position", "Tell robots where they are")
      ->add_option("ROBOT", arguments.positions,
                   "ID,X,Y,THETA as in 7,120,-45,90; whole numbers of 16, 16, 16 and 8 bits in "
                   "units that the robots' program knows")
      ->required();
  held(ipc::KILOBOT_BOOTLOAD, "bootload", "Let robots wait in their bootloader for a program")
      ->add_flag("--asleep", arguments.may_sleep, "robots may sleep: wake them first, 12 s");
  auto* program =
      simple(ipc::KILOBOT_PROGRAM, "program", "Load a program into all robots in light");
  program->add_option("FILE", arguments.hex_path, "Intel HEX, as in hop_count.hex")->required();
  program->add_option("--passes", arguments.passes, "how often it is sent; 0: until Ctrl-C")
      ->check(whole(1000))
      ->capture_default_str();
  program->add_flag("--asleep", arguments.may_sleep, "robots may sleep: wake them first, 12 s");
  program->add_flag("--force", arguments.is_forced, "also what is no program for a Kilobot");
}

}  // namespace swarmtalk::cli
