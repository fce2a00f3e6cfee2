// Sends COUNT messages and ends, as a first program does: it does not run, and waits for nothing.
// Arguments: COUNT; "wait": says that it is ready, and waits for a line before it sends; "long":
// they are long, and their Client is never destroyed; "callback": they are sent in a callback,
// which ends the program; "handler": they are sent for ever, and after COUNT ms a signal's handler
// ends it.
#include <sys/time.h>

#include <csignal>
#include <cstdlib>
#include <iostream>
#include <string>
#include <swarmtalk/client.hpp>

namespace {

constexpr std::uint32_t kQueue = 200;  // of at most 256
constexpr std::size_t kLongBytes = 16000;

int send_long(int count) {
  auto* robot = new swarmtalk::Client("leaving");
  auto* publisher =
      new swarmtalk::Publisher(robot->advertise("two", swarmtalk::Sending::queued(kQueue)));
  for (int i = 0; i < count; ++i) {
    std::string text(kLongBytes, '.');
    text.replace(0, 3, std::to_string(i) + " ");
    if (!publisher->send(text)) return 1;
  }
  return 0;
}

int send_in_callback(int count) {
  swarmtalk::Client robot("leaving");
  auto publisher = robot.advertise("two");
  auto first = robot.advertise("one", {}, [&](const swarmtalk::Status&) {
    for (int i = 0; i < count; ++i) {
      if (!publisher.send(std::to_string(i))) std::exit(1);
    }
    std::exit(0);
  });
  if (!first.send("now")) return 1;
  robot.run_for(std::chrono::minutes(1));
  return 1;
}

[[noreturn]] void send_until_a_handler_ends_it(int after_ms) {
  std::signal(SIGALRM, [](int) { std::exit(0); });
  swarmtalk::Client robot("leaving");
  auto publisher = robot.advertise("two", swarmtalk::Sending::newest(1));
  const itimerval when{{0, 0}, {after_ms / 1000, after_ms % 1000 * 1000}};
  setitimer(ITIMER_REAL, &when, nullptr);
  for (;;) static_cast<void>(publisher.send("on and on"));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const int count = std::atoi(argv[1]);
  const std::string how = argc > 2 ? argv[2] : "";
  if (how == "long") return send_long(count);
  if (how == "callback") return send_in_callback(count);
  if (how == "handler") send_until_a_handler_ends_it(count);
  swarmtalk::Client robot("leaving");
  auto publisher = robot.advertise("two");
  const bool waits = how == "wait";
  if (waits) {
    std::cout << "ready" << std::endl;
    std::cin.get();
  }
  for (int i = 0; i < count; ++i) {
    if (!publisher.send(std::to_string(i)) && !waits) return 1;
  }
  return 0;
}
