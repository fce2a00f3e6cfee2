#include "lab/wifi_medium.hpp"

#include <unistd.h>

#include <filesystem>
#include <stdexcept>

#include "lab/process.hpp"

namespace swarmtalk::lab {
namespace {

namespace fs = std::filesystem;

/// Beside this program in the build tree, or where it is installed; empty: not there.
std::string find_beside(const std::vector<std::string>& places) {
  const fs::path here = own_folder();
  for (const std::string& place : places) {
    if (access((here / place).c_str(), X_OK) == 0) return fs::weakly_canonical(here / place);
  }
  return {};
}

std::string guest_tool() {
  return find_beside({"../share/swarmtalk/wifi/swarmtalk-wifi-guest"});
}

std::string guest_folder(const State& state) {
  return folder_of(state.name) / "wifi";
}

}  // namespace

std::string WifiMedium::problem() const {
  const std::string tool = guest_tool();
  if (tool.empty()) return "the medium wifi is not installed here: no swarmtalk-wifi-guest";
  const Output output = output_of({tool, "check"});
  if (output.exit_code == 0) return {};
  return "no Wi-Fi guest can run here: " + output.text;
}

void WifiMedium::plan(State& state) const {
  for (Robot& robot : state.robots) {
    const std::string name = "robot-" + std::to_string(robot.number);
    robot.socket = "/run/" + name + ".sock";  // the guest's
    robot.config = fs::path(guest_folder(state)) / (name + ".toml");
  }
}

void WifiMedium::make(State& state) const {
  std::vector<std::string> command{guest_tool(),
                                   "up",
                                   guest_folder(state),
                                   "--radios",
                                   std::to_string(state.robots.size()),
                                   "--mode",
                                   state.wifi_mode};
  // Without it the kernel's own medium joins the radios, which loses nothing.
  if (const std::string air = find_beside(
          {"wifi/medium/swarmtalk-wifi-medium", "../libexec/swarmtalk-lab/swarmtalk-wifi-medium"});
      !air.empty()) {
    command.insert(command.end(), {"--air", air, "--places"});
    for (const Robot& robot : state.robots) {
      command.push_back(std::to_string(robot.pose.x_m) + "," + std::to_string(robot.pose.y_m));
    }
  }
  const Output output = output_of(command);
  if (output.exit_code != 0) throw std::runtime_error("the Wi-Fi guest: " + output.text);
}

LinkKeys WifiMedium::link_of(const State&, const Robot&) const {
  return {{"type", "raw_l2"}, {"interface", "wlan0"}};
}

void WifiMedium::remove(const State& state) const {
  if (fs::exists(guest_folder(state))) output_of({guest_tool(), "end", guest_folder(state)});
}

std::vector<std::string> WifiMedium::as_robot(const State& state, const Robot& robot,
                                              const std::vector<std::string>& command) const {
  std::vector<std::string> words{guest_tool(), "exec", guest_folder(state),
                                 "r" + std::to_string(robot.number), "--"};
  words.insert(words.end(), command.begin(), command.end());
  return words;
}

}  // namespace swarmtalk::lab
