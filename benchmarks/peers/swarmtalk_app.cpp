// The two programs of a run over swarmtalkd; SWARMTALK_SOCKET names the daemon's socket.
#include <chrono>
#include <cstdio>
#include <string_view>
#include <swarmtalk/client.hpp>

#include "benchmarks/peers/window.hpp"

namespace {

using namespace peers;
using namespace std::chrono_literals;

constexpr std::uint32_t kQueue = 256;

class Sender {
 public:
  Sender(swarmtalk::Client& robot, swarmtalk::Publisher& publisher, const Run& run)
      : robot_(robot), publisher_(publisher), run_(run) {}
  bool send(const char* bytes, std::size_t size) {
    return publisher_.send(std::string_view(bytes, size)).ok();
  }
  void wait(std::uint32_t us) { robot_.run_for(std::chrono::microseconds(us)); }
  void listen(std::uint32_t us) { wait(us); }
  void flush() {
    // The queue goes with its program.
    for (int i = 0; i < 200 && run_.slowest() < run_.count; ++i) {
      robot_.run_for(10ms);
    }
  }

 private:
  swarmtalk::Client& robot_;
  swarmtalk::Publisher& publisher_;
  const Run& run_;
};

int send(swarmtalk::Client& robot, const Run& run) {
  // As the other systems do: messages wait in a queue, not in the program.
  auto publisher = robot.channel("peers").publisher({}, swarmtalk::Sending::queued(kQueue));
  Sender sender(robot, publisher, run);
  return run_sender(run, sender);
}

int receive(swarmtalk::Client& robot, const Run& run) {
  Receiver receiver(run);
  auto subscriber = robot.channel("peers").subscriber(
      [&](const swarmtalk::Message& message) {
        if (receiver.on_message(message.payload.data(), message.payload.size())) robot.stop();
      },
      swarmtalk::Policy::last(2 * kQueue));
  receiver.ready();
  while (!receiver.is_complete() && !receiver.has_stalled()) robot.run_for(200ms);
  return receiver.report();
}

int swarm(swarmtalk::Client& robot, const Run& run) {
  SwarmEar ear(run);
  auto subscriber = robot.channel("peers").subscriber([&](const swarmtalk::Message& message) {
    ear.on_message(message.payload.data(), message.payload.size());
  });
  auto publisher = robot.channel("peers").publisher();
  Sender sender(robot, publisher, run);
  return run_swarm(run, ear, sender);
}

}  // namespace

int main(int argc, char** argv) {
  const Run run = parse(argc, argv);
  try {
    auto robot = swarmtalk::Client::connected("peers");
    if (run.is_swarm) return swarm(robot, run);
    return run.is_sender ? send(robot, run) : receive(robot, run);
  } catch (const swarmtalk::Error& error) {
    std::fprintf(stderr, "swarmtalk_app: %s\n", error.what());
    return 1;
  }
}
