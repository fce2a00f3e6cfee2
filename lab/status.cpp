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
#include "usage/terminal.hpp"

namespace swarmtalk::lab {
namespace {

using nlohmann::json;

constexpr std::size_t kRowColumns = 72;  // narrower terminals get a block for each robot

/// swarmtalk-cli beside this program in the build tree or installed, else by its name.
std::string find_cli() {
  const std::filesystem::path here = own_folder();
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
  answer.problem = is_running(robot.daemon) ? std::string(status.text())
                                            : "swarmtalkd has ended; the end of its log, " +
                                                  robot.log + ": " + last_words(robot);
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

/// What there is to say of a robot's links, or why nothing is.
std::string link_text(const Answer& answer) {
  if (!answer.answers) return "no answer: " + answer.problem;
  std::string text;
  for (const swarmtalk::LinkStatus& link : answer.daemon.links) {
    text += (text.empty() ? "" : "  ") + link.device + " " + link.state + ", " +
            std::to_string(counter(link, "frames_sent")) + " frames sent, " +
            std::to_string(counter(link, "frames_received")) + " received";
  }
  return text;
}

std::string row_of(const Robot& robot, const Answer& answer) {
  char text[80];
  std::snprintf(text, sizeof text, "%5d  %7d  (%.2f, %.2f)", robot.number, robot.daemon.pid,
                robot.pose.x_m, robot.pose.y_m);
  std::string row = text;
  if (answer.answers) {
    std::snprintf(text, sizeof text, "  %7u", answer.daemon.clients - 1);
    row += text;
  }
  return row + "  " + link_text(answer) + "\n";
}

/// The same for a terminal that has no room for rows.
std::string block_of(const Robot& robot, const Answer& answer) {
  char text[160];
  std::snprintf(text, sizeof text, "robot %d\n    pid %d\n    pose (%.2f, %.2f) m\n", robot.number,
                robot.daemon.pid, robot.pose.x_m, robot.pose.y_m);
  std::string block = text;
  if (answer.answers) {
    block += "    clients " + std::to_string(answer.daemon.clients - 1) + "\n";
  }
  return block + "    " + link_text(answer) + "\n";
}

}  // namespace

int print_status(State state, bool as_json) {
  medium_named(state.medium).refresh(state);
  const std::size_t columns = usage::columns(STDOUT_FILENO);
  const bool is_narrow = columns != 0 && columns < kRowColumns;
  const auto print = [](const std::string& text) {
    std::fputs(usage::folded(text, STDOUT_FILENO).c_str(), stdout);
  };
  if (!as_json) {
    print("lab '" + state.name + "', medium " + state.medium + ", " +
          std::to_string(state.robots.size()) + " robots\n");
    if (!is_narrow) print("robot      pid  pose (m)      clients  link\n");
  }
  int result = 0;
  for (const Robot& robot : state.robots) {
    const Answer answer = ask(state, robot);
    if (!answer.answers) result = 1;
    if (as_json) {
      std::printf("%s\n", to_json(robot, answer).dump().c_str());
    } else {
      print(is_narrow ? block_of(robot, answer) : row_of(robot, answer));
    }
  }
  return result;
}

}  // namespace swarmtalk::lab
