// Follows the nearest robot: turns towards it, drives, and stops 20 cm before it. Usage: follow
//
// drive() prints; put your robot's motors there.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <optional>
#include <swarmtalk/client.hpp>

constexpr float kPi = 3.14159265F;

void drive(float left, float right) {
  std::printf("left %.0f, right %.0f\n", static_cast<double>(left), static_cast<double>(right));
  std::fflush(stdout);
}

void follow(const swarmtalk::Message& nearest) {
  std::printf("robot %u is nearest, %.2f m away at %.0f degrees\n", nearest.sender,
              static_cast<double>(nearest.distance_m),
              static_cast<double>(nearest.bearing_rad * 180 / kPi));
  if (nearest.distance_m < 0.2F) {
    drive(0, 0);
    return;
  }
  const float turn =
      30 * nearest.bearing_rad / kPi;  // counter-clockwise: the right wheel is faster
  drive(20 - turn, 20 + turn);
}

int main() {
  swarmtalk::Client robot("follow");
  if (auto status = robot.connect(); !status) {
    std::cerr << status.text() << "\n";
    return 1;
  }
  std::optional<swarmtalk::Message> nearest;
  auto here = robot.advertise("here", swarmtalk::Sending::newest(1));
  auto subscriber =
      robot.subscribe("here",
                      swarmtalk::Policy::latest_from_each().known_distance_only().no_older_than(
                          std::chrono::seconds(1)),
                      [&](const swarmtalk::Message& m) {
                        if (!m.has_bearing()) return;
                        if (!nearest || m.distance_m < nearest->distance_m) nearest = m;
                      });
  while (true) {
    if (auto sent = here.send(""); !sent) std::cerr << "not sent: " << sent.text() << "\n";
    nearest.reset();
    robot.run_for(std::chrono::milliseconds(100));
    if (nearest) follow(*nearest);
  }
}
