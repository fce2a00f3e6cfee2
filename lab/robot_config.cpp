#include "lab/robot_config.hpp"

#include <toml++/toml.h>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <sstream>
#include <stdexcept>

#include "lab/bridge_medium.hpp"

namespace swarmtalk::lab {
namespace {

toml::table read_base(const std::string& path) {
  if (path.empty()) return {};
  try {
    return toml::parse_file(path);
  } catch (const toml::parse_error& error) {
    std::ostringstream text;
    text << path << ":" << error.source().begin.line << ": " << error.description();
    throw std::runtime_error(text.str());
  }
}

toml::table& section(toml::table& table, const char* name) {
  table.insert(name, toml::table{});
  toml::table* found = table[name].as_table();
  if (found == nullptr) throw std::runtime_error(std::string("[") + name + "] is not a section");
  return *found;
}

// Labs of different names must not hear each other, so each has a port of its own. FNV-1a.
std::int64_t udp_port(const std::string& lab_name) {
  std::uint32_t hash = 2166136261u;
  for (const char c : lab_name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
  return 20000 + hash % 10000;
}

}  // namespace

std::string robot_config(const State& state, const Robot& robot, const std::string& base_config) {
  toml::table table = read_base(base_config);
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
  toml::table link;
  if (state.medium == "udp") {
    link = toml::table{{"type", "udp"}, {"interface", "lo"}, {"port", udp_port(state.name)}};
  } else {
    link = toml::table{{"type", "raw_l2"}, {"interface", kRobotInterface}};
  }
  // A [links.wifi] of the base file keeps its other keys (rates, EtherType, profile).
  toml::table& links = section(table, "links");
  toml::table& wifi = section(links, "wifi");
  for (auto&& [key, value] : link) wifi.insert_or_assign(key, value);
  std::ostringstream text;
  text << "# Robot " << robot.number << " of the lab '" << state.name << "'.\n" << table << "\n";
  return text.str();
}

}  // namespace swarmtalk::lab
