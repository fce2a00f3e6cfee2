#include "lab/robot_config.hpp"

#include <filesystem>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <variant>

#include "lab/installed_config.hpp"
#include "lab/medium.hpp"
#include "text/toml_text.hpp"

namespace swarmtalk::lab {
namespace {

toml::table& section(toml::table& table, const char* name) {
  table.insert(name, toml::table{});
  toml::table* found = table[name].as_table();
  if (found == nullptr) throw std::runtime_error(std::string("[") + name + "] is not a section");
  return *found;
}

toml::table installed_file() {
  return text::parse_toml(kInstalledConfig, "swarmtalkd.toml");
}

/// What an installed robot has, and what a lab's robots have instead: any program may log, since
/// they are for trying things out, and on a wire nobody shares the air. link_of() says the rest.
toml::table installed(const Medium& medium) {
  toml::table table = installed_file();
  section(table, "node").erase("id");
  section(table, "reserved").insert_or_assign("debug", true);
  toml::table& wifi = section(section(table, "links"), "wifi");
  wifi.erase("interface");
  if (!medium.is_air()) wifi.insert_or_assign("rate_hz", 0);
  return table;
}

}  // namespace

std::string robot_config(const State& state, const Robot& robot, const std::string& base_config) {
  const Medium& medium = medium_named(state.medium);
  toml::table table = base_config.empty() ? installed(medium) : text::parse_toml_file(base_config);
  toml::table& node = section(table, "node");
  // A file made for one robot serves for all; only an automatic id is as good for many.
  if (node["id"].value<std::string>() != "auto") node.insert_or_assign("id", robot.number);
  node.insert_or_assign("pose", toml::array{robot.pose.x_m, robot.pose.y_m, robot.pose.theta_rad});
  if (node.contains("pose_socket")) {
    const std::filesystem::path socket(robot.socket);
    node.insert_or_assign("pose_socket",
                          (socket.parent_path() / (socket.stem().string() + ".pose")).string());
  }
  section(table, "socket").insert_or_assign("path", robot.socket);
  // A [links.wifi] of the base file keeps its other keys (rates, EtherType, profile).
  toml::table& links = section(table, "links");
  toml::table& wifi = section(links, "wifi");
  for (const auto& [key, given] : medium.link_of(state, robot)) {
    std::visit([&wifi, &name = key](const auto& value) { wifi.insert_or_assign(name, value); },
               given);
  }
  if (medium.is_air()) {  // also where the base file has none: docs/radio.md
    wifi.insert("jitter_us", installed_file()["links"]["wifi"]["jitter_us"].value<int>().value());
  }
  std::ostringstream text;
  text << "# Robot " << robot.number << " of the lab '" << state.name << "'.\n" << table << "\n";
  return text.str();
}

}  // namespace swarmtalk::lab
