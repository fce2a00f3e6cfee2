// Says hello twice a second on channel "hello" and prints every robot it hears, with how far away
// and in which direction that robot is. Usage: hello_swarm [--seconds N]
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numbers>
#include <set>
#include <string>
#include <swarmtalk/client.hpp>

namespace {

using namespace std::chrono_literals;

swarmtalk::Client* running = nullptr;
volatile std::sig_atomic_t has_signal = 0;

void on_signal(int) {
  has_signal = 1;
  running->stop();
}

/// What is known of where the sender is, unknown as "unknown".
std::string place(const swarmtalk::Message& message) {
  char text[80] = "distance unknown";
  if (message.has_distance()) {
    std::snprintf(text, sizeof(text), "distance %.2f m", static_cast<double>(message.distance_m));
  }
  std::string line = text;
  if (message.has_bearing()) {
    const double degrees = static_cast<double>(message.bearing_rad) * 180 / std::numbers::pi;
    std::snprintf(text, sizeof(text), "  bearing %.0f deg", std::round(degrees) + 0.0);
    line += text;
  }
  return line;
}

}  // namespace

int main(int argc, char** argv) {
  double seconds = 1e9;
  if (argc == 3 && std::strcmp(argv[1], "--seconds") == 0) {
    seconds = std::atof(argv[2]);
  } else if (argc != 1) {
    std::fprintf(stderr, "usage: hello_swarm [--seconds N]\n");
    return 2;
  }

  swarmtalk::Client robot("hello_swarm");
  if (auto status = robot.connect(); !status) {
    std::fprintf(stderr, "hello_swarm: %s\n", std::string(status.text()).c_str());
    return 1;
  }
  running = &robot;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);

  const char* variable = std::getenv("SWARMTALK_ROBOT");
  const std::string me = variable ? variable : std::to_string(robot.node_id());
  int heard = 0;
  std::set<std::uint32_t> robots;

  auto hello = robot.channel("hello");
  auto publisher = hello.publisher();
  auto subscriber = hello.subscriber([&](const swarmtalk::Message& message) {
    ++heard;
    robots.insert(message.sender);
    std::printf("robot %s hears robot %u  \"%s\"  %s\n", me.c_str(), message.sender,
                message.payload.c_str(), place(message).c_str());
    std::fflush(stdout);
  });

  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  robot.run_for(250ms);  // until robots that start at the same time listen as well
  for (int i = 1; !has_signal && std::chrono::steady_clock::now() < end; ++i) {
    if (auto status = publisher.send("hello " + std::to_string(i)); !status) {
      std::fprintf(stderr, "robot %s: %s\n", me.c_str(), std::string(status.text()).c_str());
    }
    robot.run_for(500ms);
  }
  std::printf("robot %s heard %d messages from %zu %s\n", me.c_str(), heard, robots.size(),
              robots.size() == 1 ? "robot" : "robots");
}
