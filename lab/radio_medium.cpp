#include "lab/radio_medium.hpp"

#include <signal.h>
#include <sys/resource.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>

#include "lab/interrupt.hpp"
#include "lab/network_namespace.hpp"
#include "lab/radio/control_socket.hpp"
#include "lab/radio/radio_server.hpp"
#include "lab/radio/tap.hpp"
#include "lab/radio/udp_port.hpp"
#include "lab/udp_medium.hpp"

namespace swarmtalk::lab {
namespace {

using namespace std::chrono_literals;

constexpr const char* kRadioInterface = "wlan0";  // what a Raspberry Pi calls its radio
constexpr auto kMediumTimeout = 20s;

std::string log_of(const State& state) {
  return folder_of(state.name) / "medium.log";
}

/// Its last line, for a medium that could not begin.
std::string last_line(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::string last = "it wrote nothing to its log";
  while (std::getline(file, line)) {
    const auto colon = line.find(": ");
    if (!line.empty()) last = colon == std::string::npos ? line : line.substr(colon + 2);
  }
  return last;
}

void need_descriptors() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);  // too few show when they are opened
}

}  // namespace

std::string RadioMedium::problem() const {
  return has_namespaces_ ? namespace_problem(without_namespaces()) : "";
}

void RadioMedium::plan(State& state) const {
  for (Robot& robot : state.robots) {
    if (!has_namespaces_) break;
    robot.network_namespace = namespace_prefix(state.name) + std::to_string(robot.number);
  }
  state.control_socket = folder_of(state.name) / "medium.sock";
}

void RadioMedium::make(State& state) const {
  for (const Robot& robot : state.robots) {
    throw_if_interrupted();
    if (has_namespaces_) make_namespace(robot.network_namespace);
  }
  SpawnOptions options;
  options.detached = true;
  options.output_file = log_of(state);
  ProcessId keeper;
  options.write_down = [&](const ProcessId& process) {
    keeper = process;
    state.medium_processes = {keeper};
    save(state);
  };
  spawn({std::filesystem::read_symlink("/proc/self/exe"), "--name", state.name, "keep",
         state.control_socket},
        options);
  const auto deadline = std::chrono::steady_clock::now() + kMediumTimeout;
  for (std::string problem;;) {
    throw_if_interrupted();
    try {
      const auto status =
          nlohmann::json::parse(radio::ask(state.control_socket, R"({"do":"status"})"));
      state.medium_processes.push_back(identify(status.at("pid").get<pid_t>()));
      return;
    } catch (const std::runtime_error& error) {
      problem = error.what();
    }
    if (!is_running(keeper)) {
      throw std::runtime_error("the medium could not begin: " + last_line(log_of(state)));
    }
    if (std::chrono::steady_clock::now() > deadline) throw std::runtime_error(problem);
    std::this_thread::sleep_for(10ms);
  }
}

LinkKeys RadioMedium::link_of(const State& state, const Robot& robot) const {
  if (has_namespaces_) return {{"type", "raw_l2"}, {"interface", kRadioInterface}};
  return {{"type", "udp"},
          {"interface", "lo"},
          {"address", radio::group_of(robot.number)},
          {"port", udp_port_of(state)}};
}

void RadioMedium::remove(const State& state) const {
  for (const Robot& robot : state.robots) remove_namespace(robot.network_namespace);
}

void RadioMedium::refresh(State& state) const {
  const auto status = nlohmann::json::parse(radio::ask(state.control_socket, R"({"do":"status"})"));
  for (const auto& place : status.at("robots")) {
    if (place.value("ghost", false)) continue;
    Robot& robot = state.robots.at(place.at("robot").get<std::size_t>() - 1);
    robot.pose.x_m = place.at("x_m").get<double>();
    robot.pose.y_m = place.at("y_m").get<double>();
  }
}

int RadioMedium::serve(const State& state) const {
  need_descriptors();
  sim::WifiAirConfig air;
  air.range_mm = state.radio.range_m * 1000;
  air.loss = state.radio.loss;
  air.rate_mbps = static_cast<std::uint32_t>(state.radio.rate_mbps);
  if (!has_namespaces_) air.header_bytes = 0;  // what goes on the air is the same frame
  const auto seed =
      static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
  radio::RadioServer server(air, state.control_socket, seed);
  for (const Robot& robot : state.robots) {
    std::unique_ptr<radio::Port> port;
    if (has_namespaces_) {
      port = std::make_unique<radio::Tap>(robot.network_namespace, kRadioInterface,
                                          static_cast<std::uint16_t>(robot.number));
    } else {
      port = std::make_unique<radio::UdpPort>(robot.number,
                                              static_cast<std::uint16_t>(udp_port_of(state)));
    }
    server.add(std::move(port), robot.pose.x_m, robot.pose.y_m);
  }
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGUSR1);
  return server.run(signals);
}

int serve_radio(const State& state) {
  return RadioMedium(state.medium == "radio").serve(state);
}

}  // namespace swarmtalk::lab
