// How right the buffering delay is that a program is given: beside it stands the true time from
// send() in one program to the callback in the other, on the one clock of one machine. The
// difference is the time on the wire, which is left out, and the error.
// benchmarks/buffering_delay.py runs it.
//   buffering_delay receive COUNT       prints one JSON line when COUNT messages have come
//   buffering_delay send COUNT BURST GAP_US   BURST messages at once, every GAP_US
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <swarmtalk/client.hpp>
#include <thread>
#include <vector>

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kGiveUp = 10s;

std::int64_t now_ns() {
  return Clock::now().time_since_epoch().count();
}

double quantile(std::vector<double>& values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

int receive(std::size_t count) {
  auto robot = swarmtalk::Client::connected("buffering_delay");
  std::vector<double> true_us;
  std::vector<double> errors_us;
  std::size_t heard = 0;
  auto subscriber = robot.channel("delay", {.ttl = {}, .timestamped = true})
                        .subscriber([&](const swarmtalk::Message& message) {
                          const std::int64_t now = now_ns();
                          if (++heard >= count) robot.stop();
                          const auto sent_ns = message.as<std::int64_t>();
                          if (!sent_ns || !message.buffering_delay) return;
                          const double whole_us = static_cast<double>(now - *sent_ns) / 1000;
                          const auto told_us =
                              static_cast<double>(message.buffering_delay->count());
                          true_us.push_back(whole_us);
                          errors_us.push_back(std::abs(whole_us - told_us));
                        });
  std::fprintf(stderr, "ready\n");
  auto last_progress = Clock::now();
  for (std::size_t seen = 0; heard < count && Clock::now() - last_progress < kGiveUp;) {
    robot.run_for(200ms);
    if (heard != std::exchange(seen, heard)) last_progress = Clock::now();
  }
  std::printf(
      "{\"received\": %zu, \"timed\": %zu, \"way_p50_us\": %.1f, \"way_p99_us\": %.1f, "
      "\"error_p50_us\": %.1f, \"error_p99_us\": %.1f, \"error_max_us\": %.1f}\n",
      heard, errors_us.size(), quantile(true_us, 0.5), quantile(true_us, 0.99),
      quantile(errors_us, 0.5), quantile(errors_us, 0.99), quantile(errors_us, 1.0));
  return heard == count ? 0 : 1;
}

int send(std::size_t count, std::size_t burst, std::chrono::microseconds gap) {
  auto robot = swarmtalk::Client::connected("buffering_delay");
  auto publisher =
      robot.channel("delay", {.ttl = {}, .timestamped = true})
          .publisher({}, swarmtalk::Sending::queued(static_cast<std::uint32_t>(burst)));
  auto next = Clock::now();
  for (std::size_t sent = 0; sent < count;) {
    next += gap;
    for (std::size_t i = 0; i < burst && sent < count; ++i, ++sent) {
      while (publisher.busy()) robot.run_once(1ms);
      if (const swarmtalk::Status status = publisher.send(now_ns()); !status) {
        std::fprintf(stderr, "buffering_delay: %s\n", std::string(status.text()).c_str());
        return 1;
      }
    }
    robot.run_for(std::max<std::chrono::nanoseconds>(next - Clock::now(), 0ns));
  }
  robot.run_for(100ms);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 3 && std::strcmp(argv[1], "receive") == 0) {
      return receive(std::strtoul(argv[2], nullptr, 10));
    }
    if (argc == 5 && std::strcmp(argv[1], "send") == 0) {
      return send(std::strtoul(argv[2], nullptr, 10), std::strtoul(argv[3], nullptr, 10),
                  std::chrono::microseconds(std::strtol(argv[4], nullptr, 10)));
    }
  } catch (const swarmtalk::Error& error) {
    std::fprintf(stderr, "buffering_delay: %s\n", error.what());
    return 1;
  }
  std::fprintf(stderr,
               "usage: buffering_delay receive COUNT | buffering_delay send COUNT BURST GAP_US\n");
  return 2;
}
