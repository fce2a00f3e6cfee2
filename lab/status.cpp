#include "lab/status.hpp"

#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <swarmtalk/client.hpp>

#include "lab/lab.hpp"
#include "lab/medium.hpp"

namespace swarmtalk::lab {
namespace {

using nlohmann::json;

/// swarmtalk-cli beside this program in the build tree or installed, else by its name.
std::string find_cli() {
  const auto here = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  for (const auto& path : {here / "../cli/swarmtalk-cli", here / "swarmtalk-cli"}) {
    if (access(path.c_str(), X_OK) == 0) return std::filesystem::weakly_canonical(path);
  }
  return "swarmtalk-cli";
}

struct Answer {
  bool answers = false;
  swarmtalk::DaemonStatus daemon;
  std::string problem;
};

/// Of a robot whose socket only programs of its own medium reach: by swarmtalk-cli there.
Answer ask_there(const State& state, const Robot& robot) {
  const Output output = output_of(
      medium_named(state.medium)
          .as_robot(state, robot, {find_cli(), "--socket", robot.socket, "stats", "--json"}));
  Answer answer;
  const json status = json::parse(output.text, nullptr, false);
  if (output.exit_code != 0 || !status.is_object()) {
    answer.problem = is_running(robot.daemon) ? output.text : "swarmtalkd has ended";
    return answer;
  }
  answer.answers = true;
  answer.daemon.node_id = status.value("node_id", 0u);
  answer.daemon.clients = status.value("clients", 1u);
  for (const json& entry : status.value("links", json::array())) {
    swarmtalk::LinkStatus link;
    link.name = entry.value("name", "");
    link.device = entry.value("device", "");
    link.up = entry.value("up", false);
    link.state = entry.value("state", "");
    const json counters = entry.value("counters", json::object());
    for (const char* name : {"frames_sent", "frames_received"}) {
      link.counters.push_back({name, counters.value(name, std::uint64_t{0})});
    }
    answer.daemon.links.push_back(link);
  }
  return answer;
}

Answer ask(const State& state, const Robot& robot) {
  if (medium_named(state.medium).is_elsewhere()) return ask_there(state, robot);
  swarmtalk::ClientOptions options;
  options.socket_path = robot.socket;
  options.connect_timeout = std::chrono::milliseconds(500);
  swarmtalk::Client client("swarmtalk-lab", options);
  Answer answer;
  swarmtalk::Status status = client.connect();
  if (status.ok()) status = client.get_status(answer.daemon);
  answer.answers = status.ok();
  answer.problem = is_running(robot.daemon)
                       ? std::string(status.text())
                       : "swarmtalkd has ended: " + last_words(robot) + " (log: " + robot.log + ")";
  return answer;
}

std::uint64_t counter(const swarmtalk::LinkStatus& link, const std::string& name) {
  for (const swarmtalk::Counter& counter : link.counters) {
    if (counter.name == name) return counter.value;
  }
  return 0;
}

json to_json(const Robot& robot, const Answer& answer) {
  json object = {
      {"robot", robot.number},     {"pid", robot.daemon.pid}, {"running", is_running(robot.daemon)},
      {"answers", answer.answers}, {"socket", robot.socket},  {"log", robot.log},
      {"x_m", robot.pose.x_m},     {"y_m", robot.pose.y_m},   {"theta_rad", robot.pose.theta_rad}};
  if (!answer.answers) {
    object["problem"] = answer.problem;
    return object;
  }
  object["node_id"] = answer.daemon.node_id;
  object["clients"] = answer.daemon.clients - 1;  // without this question
  for (const swarmtalk::LinkStatus& link : answer.daemon.links) {
    object["links"].push_back({{"name", link.name},
                               {"up", link.up},
                               {"state", link.state},
                               {"frames_sent", counter(link, "frames_sent")},
                               {"frames_received", counter(link, "frames_received")}});
  }
  return object;
}

void print_line(const Robot& robot, const Answer& answer) {
  std::printf("%5d  %7d  (%.2f, %.2f)", robot.number, robot.daemon.pid, robot.pose.x_m,
              robot.pose.y_m);
  if (!answer.answers) {
    std::printf("  no answer: %s\n", answer.problem.c_str());
    return;
  }
  std::printf("  %7u", answer.daemon.clients - 1);
  for (const swarmtalk::LinkStatus& link : answer.daemon.links) {
    std::printf("  %s %s, %llu frames sent, %llu received", link.device.c_str(), link.state.c_str(),
                static_cast<unsigned long long>(counter(link, "frames_sent")),
                static_cast<unsigned long long>(counter(link, "frames_received")));
  }
  std::printf("\n");
}

}  // namespace

int print_status(State state, bool as_json) {
  medium_named(state.medium).refresh(state);
  if (!as_json) {
    std::printf("lab '%s', medium %s, %zu robots\n", state.name.c_str(), state.medium.c_str(),
                state.robots.size());
    std::printf("robot      pid  pose (m)      clients  link\n");
  }
  int result = 0;
  for (const Robot& robot : state.robots) {
    const Answer answer = ask(state, robot);
    if (!answer.answers) result = 1;
    if (as_json) {
      std::printf("%s\n", to_json(robot, answer).dump().c_str());
    } else {
      print_line(robot, answer);
    }
  }
  return result;
}

}  // namespace swarmtalk::lab
