// The floor under every latency and CPU figure on raw layer 2: a bare packet socket at each end.
//   l2_floor receive INTERFACE COUNT             one JSON line when COUNT messages have come
//   l2_floor send INTERFACE COUNT BYTES GAP_US   paced, the same form as `latency send`
//   l2_floor compare [PAIRS [BYTES]]             bare sockets and the raw_l2 link in turn, on a
//   veth
//                                                pair of its own, with medians and ratios
// The first two run in two robots of a lab (`swarmtalk-lab exec 1 -- l2_floor ...`), beside the
// measurement from program to program, on the same wires. All need root.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "benchmarks/l2_floor/compare.hpp"
#include "benchmarks/l2_floor/ends.hpp"

namespace {

using namespace swarmtalk::l2_floor;

int receive(const std::string& interface, std::size_t count) {
  const auto receiver = open_bare_receiver(interface);
  std::fprintf(stderr, "ready\n");
  Samples samples(count);
  const double cpu_before_us = cpu_us();
  receiver->receive([&](std::span<const std::uint8_t> message) {
    samples.add(message);
    return samples.count() < count;
  });
  const Result result = samples.result(cpu_us() - cpu_before_us);
  std::printf("{\"received\": %zu, \"p50_us\": %.1f, \"p99_us\": %.1f, \"cpu_us\": %.2f}\n",
              result.messages, result.p50_us, result.p99_us, result.cpu_us);
  return result.messages == count ? 0 : 1;
}

int send(const std::string& interface, std::size_t count, std::size_t size_bytes,
         std::int64_t gap_us) {
  const auto sender = open_bare_sender(interface);
  const double cpu_before_us = cpu_us();
  std::int64_t next_ns = now_ns();
  for (std::size_t i = 0; i < count; ++i) {
    next_ns += gap_us * 1000;
    sender->wait_until(next_ns);
    sender->send(std::max(size_bytes, kSmallestMessageBytes));
  }
  std::printf("{\"sent\": %zu, \"cpu_us\": %.2f}\n", count,
              (cpu_us() - cpu_before_us) / static_cast<double>(std::max<std::size_t>(count, 1)));
  return 0;
}

std::size_t number(const std::string& text) {
  return std::strtoul(text.c_str(), nullptr, 10);
}

int run(const std::vector<std::string>& words) {
  const std::string command = words.empty() ? "" : words[0];
  if (command == "receive" && words.size() == 3) return receive(words[1], number(words[2]));
  if (command == "send" && words.size() == 5) {
    return send(words[1], number(words[2]), number(words[3]),
                static_cast<std::int64_t>(number(words[4])));
  }
  if (command == "compare" && words.size() <= 3) {
    CompareConfig config;
    if (words.size() > 1) config.pairs = std::max<std::size_t>(number(words[1]), 1);
    if (words.size() > 2) {
      config.message_bytes = std::clamp<std::size_t>(number(words[2]), kSmallestMessageBytes, 1400);
    }
    return compare(config);
  }
  std::fprintf(stderr,
               "usage: l2_floor receive INTERFACE COUNT\n"
               "       l2_floor send INTERFACE COUNT BYTES GAP_US\n"
               "       l2_floor compare [PAIRS [BYTES]]\n");
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(std::vector<std::string>(argv + 1, argv + argc));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "l2_floor: %s\n", error.what());
    return 1;
  }
}
