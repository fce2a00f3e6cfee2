// One-way latency and CPU of a message from one program to another through client library, socket,
// daemon, radio link and back up, as two robots of a lab see it, and its last part: from the
// kernel's receive stamp to the callback. benchmarks/latency.py, daemon_load.py, python_cost.py run
// it.
//   latency receive COUNT                    prints one JSON line when COUNT messages have come
//   latency send COUNT BYTES GAP_US [BURST]  paced, BURST at once; CLOCK_MONOTONIC is one clock on
//                                            one machine
#include <sys/resource.h>

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

double cpu_us() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  auto us = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) * 1e6 + static_cast<double>(t.tv_usec);
  };
  return us(usage.ru_utime) + us(usage.ru_stime);
}

std::int64_t now_ns() {
  return Clock::now().time_since_epoch().count();
}

double quantile(std::vector<double>& values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

int receive(std::size_t count) {
  auto robot = swarmtalk::Client::connected("latency");
  std::vector<double> latencies_us;
  std::vector<double> from_kernel_us;
  latencies_us.reserve(count);
  from_kernel_us.reserve(count);
  auto subscriber = robot.channel("latency").subscriber([&](const swarmtalk::Message& message) {
    std::int64_t sent_ns = 0;
    if (message.payload.size() < sizeof sent_ns) return;
    std::memcpy(&sent_ns, message.payload.data(), sizeof sent_ns);
    const std::int64_t now = now_ns();
    latencies_us.push_back(static_cast<double>(now - sent_ns) / 1000);
    if (message.received_at) {
      const std::int64_t stamp_ns = message.received_at->time_since_epoch().count();
      from_kernel_us.push_back(static_cast<double>(now - stamp_ns) / 1000);
    }
    if (latencies_us.size() == count) robot.stop();
  });
  std::fprintf(stderr, "ready\n");
  auto last_progress = Clock::now();
  std::size_t seen = 0;
  const double cpu_before_us = cpu_us();
  while (latencies_us.size() < count && Clock::now() - last_progress < kGiveUp) {
    robot.run_for(200ms);
    if (latencies_us.size() != seen) {
      seen = latencies_us.size();
      last_progress = Clock::now();
    }
  }
  const double cpu_us_each =
      (cpu_us() - cpu_before_us) / static_cast<double>(std::max<std::size_t>(seen, 1));
  std::printf(
      "{\"received\": %zu, \"p50_us\": %.1f, \"p99_us\": %.1f, \"cpu_us\": %.2f, "
      "\"stamped\": %zu, \"from_kernel_p50_us\": %.1f, \"from_kernel_p99_us\": %.1f}\n",
      seen, quantile(latencies_us, 0.5), quantile(latencies_us, 0.99), cpu_us_each,
      from_kernel_us.size(), quantile(from_kernel_us, 0.5), quantile(from_kernel_us, 0.99));
  return seen == count ? 0 : 1;
}

int send(std::size_t count, std::size_t size_bytes, std::chrono::microseconds gap,
         std::size_t burst) {
  auto robot = swarmtalk::Client::connected("latency");
  const auto queue = burst == 1 ? 0 : static_cast<std::uint32_t>(2 * burst);
  auto publisher = robot.advertise("latency", swarmtalk::Sending::queued(queue));
  std::string message(std::max(size_bytes, sizeof(std::int64_t)), 'x');
  std::size_t busy = 0;
  const double cpu_before_us = cpu_us();
  auto next = Clock::now();
  for (std::size_t i = 0; i < count; ++i) {
    if (i % burst == 0) {
      next += gap;
      std::this_thread::sleep_until(next);
      robot.process();
    }
    while (publisher.busy()) {
      ++busy;
      robot.run_once(1ms);
    }
    const std::int64_t now = now_ns();
    std::memcpy(message.data(), &now, sizeof now);
    if (const swarmtalk::Status status = publisher.send(message); !status) {
      std::fprintf(stderr, "latency: %s\n", std::string(status.text()).c_str());
      return 1;
    }
  }
  while (publisher.busy()) robot.run_once(10ms);
  robot.run_for(burst == 1 ? 0ms : 1000ms);  // what waits in the daemon leaves before we go
  std::printf("{\"sent\": %zu, \"waited_for_busy\": %zu, \"cpu_us\": %.2f}\n", count, busy,
              (cpu_us() - cpu_before_us) / static_cast<double>(count));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 3 && std::strcmp(argv[1], "receive") == 0) {
      return receive(std::strtoul(argv[2], nullptr, 10));
    }
    if ((argc == 5 || argc == 6) && std::strcmp(argv[1], "send") == 0) {
      return send(std::strtoul(argv[2], nullptr, 10), std::strtoul(argv[3], nullptr, 10),
                  std::chrono::microseconds(std::strtol(argv[4], nullptr, 10)),
                  argc == 6 ? std::max(std::strtoul(argv[5], nullptr, 10), 1UL) : 1);
    }
  } catch (const swarmtalk::Error& error) {
    std::fprintf(stderr, "latency: %s\n", error.what());
    return 1;
  }
  std::fprintf(stderr, "usage: latency receive COUNT | latency send COUNT BYTES GAP_US [BURST]\n");
  return 2;
}
