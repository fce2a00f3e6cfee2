// Says hello ten times, twice a second, and prints what other robots say. Usage: chatter
#include <chrono>
#include <cstdio>
#include <iostream>
#include <string>
#include <swarmtalk/client.hpp>

int main() {
  swarmtalk::Client robot("chatter");
  if (auto status = robot.connect(); !status) {
    std::cerr << status.text() << "\n";
    return 1;
  }
  auto subscriber = robot.subscribe("hello", [](const swarmtalk::Message& m) {
    std::printf("robot %u says %s", m.sender, m.payload.c_str());
    if (m.has_distance()) std::printf(", %.2f m away", static_cast<double>(m.distance_m));
    std::puts("");
    std::fflush(stdout);
  });
  auto publisher = robot.advertise("hello");
  for (int i = 1; i <= 10; ++i) {
    if (auto sent = publisher.send("hello " + std::to_string(i)); !sent) {
      std::cerr << "not sent: " << sent.text() << "\n";
    }
    robot.run_for(std::chrono::milliseconds(500));  // callbacks run in here
  }
}
