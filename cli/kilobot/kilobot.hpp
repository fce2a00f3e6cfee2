// `swarmtalk-cli kilobot`: commands to the Kilobots of a link, through the daemon. Nothing that is
// sent is ever acknowledged, so the words here are "sent", never "done".
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/common/commands.hpp"
#include "ipc/framing.hpp"

namespace CLI {
class App;
}

namespace swarmtalk::cli {

struct KilobotArguments {
  ipc::KilobotCommand command;
  std::string name;  // of the command, as typed
  std::string link;
  std::string uid;
  std::string message_type, data_hex, checksum;
  std::vector<std::string> positions;  // ID,X,Y,THETA
  std::string hold_s;                  // seconds; 0: until it is stopped
  std::string left, right;
  std::string hex_path;
  std::uint32_t passes = 6;
  bool saves = false, stops = false, is_forced = false, may_sleep = false;
  bool is_on_screen = false;  // calibrate
};

/// Adds the subcommand and its own to `app`.
void add_kilobot(CLI::App& app, KilobotArguments& arguments);

/// Does what was parsed. @return exit code
int kilobot(const Common& common, KilobotArguments& arguments);

}  // namespace swarmtalk::cli
