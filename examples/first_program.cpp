// The first robot program, as the README shows it.
#include <chrono>
#include <iostream>
#include <string>
#include <swarmtalk/client.hpp>

int main() {
  swarmtalk::Client robot("first_program");
  if (auto status = robot.connect(); !status) {
    std::cerr << status.text() << "\n";
    return 1;
  }
  auto hello = robot.channel("hello");
  auto publisher = hello.publisher();
  auto subscriber = hello.subscriber([](const swarmtalk::Message& m) {
    std::cout << "robot " << m.sender << " says " << m.text();
    if (m.has_distance()) std::cout << ", " << m.distance_m << " m away";
    std::cout << std::endl;
  });
  for (int i = 1; i <= 10; ++i) {
    if (auto sent = publisher.send("hello " + std::to_string(i)); !sent) {
      std::cerr << "not sent: " << sent.text() << "\n";
    }
    robot.run_for(std::chrono::milliseconds(500));
  }
}
