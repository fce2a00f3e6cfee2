#include "lab/status.hpp"

#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <swarmtalk/client.hpp>

#include "lab/lab.hpp"
#include "lab/medium.hpp"

namespace swarmtalk::lab {
namespace {

using nlohmann::json;

struct Answer {
  bool answers = false;
  swarmtalk::DaemonStatus daemon;
  std::string problem;
};

Answer ask(const Robot& robot) {
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
    const Answer answer = ask(robot);
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
