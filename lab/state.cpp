#include "lab/state.hpp"

#include <fcntl.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace swarmtalk::lab {
namespace {

using nlohmann::json;

std::filesystem::path found_base;  // empty: that of the environment

/// $XDG_RUNTIME_DIR after su or in a service may be that of another user, or of none.
bool may_write_to(const char* folder) {
  return faccessat(AT_FDCWD, folder, W_OK | X_OK, AT_EACCESS) == 0;
}

std::filesystem::path base_folder() {
  if (!found_base.empty()) return found_base;
  if (geteuid() == 0) return "/run/swarmtalk-lab";
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime != nullptr && may_write_to(runtime)) {
    return std::filesystem::path(runtime) / "swarmtalk-lab";
  }
  return "/tmp/swarmtalk-lab-" + std::to_string(geteuid());
}

std::filesystem::path word_of(const std::string& name) {
  return base_folder() / (name + ".ended");
}

json to_json(const ProcessId& process) {
  return {{"pid", process.pid}, {"start_time_ticks", process.start_time_ticks}};
}

/// Whether a process sees the files that we see: one of a container has other ones under our names.
bool sees_our_files(const std::filesystem::path& process) {
  std::error_code error;
  const auto its = std::filesystem::read_symlink(process / "ns/mnt", error);
  return !error && its == std::filesystem::read_symlink("/proc/self/ns/mnt", error);
}

/// Of a lab's own process: the file in the lab's folder that it was started with. Empty: another.
std::filesystem::path own_file(const std::filesystem::path& process, const std::string& name) {
  std::ifstream file(process / "cmdline");
  std::string before;
  for (std::string word; std::getline(file, word, '\0'); before = word) {
    if (before != "--config" && before != "keep") continue;
    const std::filesystem::path path = word;
    const std::filesystem::path folder = path.parent_path();
    const std::string base = folder.parent_path().filename();
    if (folder.filename() == name && base.starts_with("swarmtalk-lab")) return path;
  }
  return {};
}

ProcessId process_from(const json& object) {
  return {object.at("pid").get<pid_t>(), object.at("start_time_ticks").get<unsigned long long>()};
}

}  // namespace

std::filesystem::path folder_of(const std::string& name) {
  return base_folder() / name;
}

bool load(const std::string& name, State& state) {
  const auto path = folder_of(name) / "lab.json";
  std::ifstream file(path);
  if (!file) return false;
  try {
    const json object = json::parse(file);
    state = {};
    state.name = name;
    state.medium = object.at("medium").get<std::string>();
    state.wifi_mode = object.value("wifi_mode", "");
    state.hub_namespace = object.at("hub_namespace").get<std::string>();
    state.keeper = process_from(object.at("keeper"));
    if (object.contains("radio")) {
      const json& radio = object["radio"];
      state.radio = {radio.at("range_m").get<double>(), radio.at("loss").get<double>(),
                     radio.at("rate_mbps").get<int>()};
      state.control_socket = radio.at("control_socket").get<std::string>();
      for (const json& process : radio.at("processes")) {
        state.medium_processes.push_back(process_from(process));
      }
    }
    for (const json& entry : object.at("robots")) {
      Robot robot;
      robot.number = entry.at("number").get<int>();
      robot.network_namespace = entry.at("network_namespace").get<std::string>();
      robot.socket = entry.at("socket").get<std::string>();
      robot.config = entry.at("config").get<std::string>();
      robot.log = entry.at("log").get<std::string>();
      robot.pose = {entry.at("x_m").get<double>(), entry.at("y_m").get<double>(),
                    entry.at("theta_rad").get<double>()};
      robot.daemon = process_from(entry.at("daemon"));
      state.robots.push_back(robot);
    }
  } catch (const json::exception& error) {
    throw std::runtime_error(path.string() + " is damaged (" + error.what() +
                             "); end its processes by hand and remove its folder");
  }
  return true;
}

void save(const State& state) {
  json robots = json::array();
  for (const Robot& robot : state.robots) {
    robots.push_back({{"number", robot.number},
                      {"network_namespace", robot.network_namespace},
                      {"socket", robot.socket},
                      {"config", robot.config},
                      {"log", robot.log},
                      {"x_m", robot.pose.x_m},
                      {"y_m", robot.pose.y_m},
                      {"theta_rad", robot.pose.theta_rad},
                      {"daemon", to_json(robot.daemon)}});
  }
  json processes = json::array();
  for (const ProcessId& process : state.medium_processes) processes.push_back(to_json(process));
  const json radio = {{"range_m", state.radio.range_m},
                      {"loss", state.radio.loss},
                      {"rate_mbps", state.radio.rate_mbps},
                      {"control_socket", state.control_socket},
                      {"processes", processes}};
  const json object = {{"medium", state.medium},          {"radio", radio},
                       {"wifi_mode", state.wifi_mode},    {"hub_namespace", state.hub_namespace},
                       {"keeper", to_json(state.keeper)}, {"robots", robots}};
  const auto folder = folder_of(state.name);
  std::filesystem::create_directories(folder);
  const auto part = folder / "lab.json.part";
  std::ofstream file(part);
  file << object.dump(2) << "\n";
  file.close();
  if (!file) throw std::runtime_error("cannot write " + part.string());
  std::filesystem::rename(part, folder / "lab.json");
}

void leave_word(const std::string& name, const std::string& why) {
  if (std::FILE* file = std::fopen(word_of(name).c_str(), "wx"); file != nullptr) {
    std::fputs((why + "\n").c_str(), file);
    std::fclose(file);
  }
}

std::string last_word(const std::string& name) {
  std::ifstream file(word_of(name));
  std::string line;
  std::getline(file, line);
  return line;
}

void forget_word(const std::string& name) {
  std::error_code error;
  std::filesystem::remove(word_of(name), error);
}

void forget(const State& state) {
  std::error_code error;
  for (int i = 0; i < 10; ++i) {  // a program that has not ended yet may make a file meanwhile
    std::filesystem::remove_all(folder_of(state.name), error);
    if (!error) return;
  }
  throw std::runtime_error("cannot remove " + folder_of(state.name).string() + ": " +
                           error.message());
}

Elsewhere find_elsewhere(const std::string& name) {
  Elsewhere found;
  std::error_code error;
  for (const auto& process : std::filesystem::directory_iterator("/proc", error)) {
    const std::string number = process.path().filename();
    struct stat its {};
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    if (stat(process.path().c_str(), &its) != 0 || its.st_uid != geteuid()) continue;
    const std::filesystem::path folder = own_file(process.path(), name).parent_path();
    if (folder.empty() || !sees_our_files(process.path())) continue;
    if (!found.folder.empty() && folder != found.folder) continue;
    found.folder = folder;
    found.processes.push_back(identify(std::stoi(number)));
  }
  found.is_folder_there = std::filesystem::exists(found.folder / "lab.json", error);
  return found;
}

void look_in(const std::filesystem::path& folder) {
  found_base = folder.parent_path();
}

std::vector<std::string> list_labs() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(base_folder(), error)) {
    if (std::filesystem::exists(entry.path() / "lab.json")) {
      names.push_back(entry.path().filename().string());
    }
  }
  return names;
}

std::string owner_of_other_lab(const std::string& name) {
  std::vector<std::filesystem::path> folders{"/run/swarmtalk-lab"};
  std::error_code error;
  for (const auto& user : std::filesystem::directory_iterator("/run/user", error)) {
    folders.push_back(user.path() / "swarmtalk-lab");
  }
  for (const auto& entry : std::filesystem::directory_iterator("/tmp", error)) {
    if (entry.path().filename().string().starts_with("swarmtalk-lab-")) folders.push_back(entry);
  }
  for (const auto& folder : folders) {
    struct stat found {};
    if (folder == base_folder() || stat((folder / name).c_str(), &found) != 0) continue;
    if (found.st_uid == geteuid()) continue;  // left behind by our own
    struct stat inside {};
    const bool is_up = stat((folder / name / "lab.json").c_str(), &inside) == 0 || errno == EACCES;
    if (!is_up) continue;  // it has ended
    const passwd* user = getpwuid(found.st_uid);
    return user != nullptr ? user->pw_name : "user " + std::to_string(found.st_uid);
  }
  return {};
}

}  // namespace swarmtalk::lab
