// Prints once a second which robots are within half a metre. Usage: near
//
// Every robot says that it is there, five times a second; who is farther away is not heard. A robot
// that was not heard for a second is gone.
#include <chrono>
#include <cstdio>
#include <iostream>
#include <map>
#include <swarmtalk/client.hpp>

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

struct Heard {
  Clock::time_point when;
  float distance_m;
};

void print(std::uint32_t own_id, const std::map<std::uint32_t, Heard>& robots) {
  std::printf("robot %u:", own_id);
  const char* separator = " ";
  for (const auto& [id, heard] : robots) {
    if (Clock::now() - heard.when > milliseconds(1000)) continue;
    std::printf("%s%u at %.2f m", separator, id, static_cast<double>(heard.distance_m));
    separator = ", ";
  }
  std::puts(separator[0] == ' ' ? " nobody is near" : "");
  std::fflush(stdout);
}

int main() {
  swarmtalk::Client robot("near");
  if (auto status = robot.connect(); !status) {
    std::cerr << status.text() << "\n";
    return 1;
  }
  std::map<std::uint32_t, Heard> robots;
  auto here = robot.advertise("here", swarmtalk::Sending::newest(1));  // only the newest counts
  auto subscriber = robot.subscribe("here", swarmtalk::Policy().within(0.5F).known_distance_only(),
                                    [&](const swarmtalk::Message& m) {
                                      robots[m.sender] = {Clock::now(), m.distance_m};
                                    });
  auto told = Clock::now();
  while (true) {
    if (auto sent = here.send(""); !sent) std::cerr << "not sent: " << sent.text() << "\n";
    robot.run_for(milliseconds(200));
    if (Clock::now() - told < milliseconds(1000)) continue;
    told = Clock::now();
    print(robot.node_id(), robots);
  }
}
