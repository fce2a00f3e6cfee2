// The robot with the highest number leads; when it falls silent, the next one does. Usage: leader
//
// Everyone tells its number, and messages go on over up to three more robots.
#include <chrono>
#include <cstdio>
#include <iostream>
#include <map>
#include <swarmtalk/client.hpp>

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kSilence{2};

struct Claim {
  std::uint32_t id;  // little-endian, as on all robots that this runs on
};

int main() {
  swarmtalk::Client robot("leader");
  if (auto status = robot.connect(); !status) {
    std::cerr << status.text() << "\n";
    return 1;
  }
  std::map<std::uint32_t, Clock::time_point> last;  // robot: when it was heard
  swarmtalk::ChannelOptions options;
  options.ttl = 3;
  auto channel = robot.channel("leader", options);
  auto claims = channel.publisher({}, swarmtalk::Sending::newest(1));
  auto subscriber = channel.subscriber([&](const swarmtalk::Message& m) {
    if (auto claim = m.as<Claim>()) last[claim->id] = Clock::now();
  });
  std::uint32_t leader = 0;
  while (true) {
    if (auto sent = claims.send(Claim{robot.node_id()}); !sent) {
      std::cerr << "not sent: " << sent.text() << "\n";
    }
    robot.run_for(std::chrono::milliseconds(250));
    std::uint32_t highest = robot.node_id();
    for (const auto& [id, when] : last) {
      if (Clock::now() - when < kSilence && id > highest) highest = id;
    }
    if (highest == leader) continue;
    leader = highest;
    if (leader == robot.node_id()) {
      std::printf("robot %u: I lead\n", robot.node_id());
    } else {
      std::printf("robot %u: robot %u leads\n", robot.node_id(), leader);
    }
    std::fflush(stdout);
  }
}
