// The sending loop of window.hpp.
#pragma once

#include <cstdio>
#include <cstring>
#include <string>

namespace peers {

constexpr std::uint32_t kNapUs = 20;
constexpr std::int64_t kGiveUpNs = 10'000'000'000;

template <class System>
int run_sender(const Run& run, System& system) {
  std::string message(run.size_bytes, 'x');
  const double cpu_before_us = cpu_us();
  std::int64_t next_ns = now_ns();
  std::int64_t progress_ns = next_ns;
  std::uint32_t refused = 0;
  for (std::uint32_t number = 0; number < run.count;) {
    const std::int64_t now = now_ns();
    const bool is_due =
        run.gap_us != 0 ? now >= next_ns : number - run.shared->received.load() < run.window;
    if (!is_due) {
      const std::int64_t left_us = (next_ns - now) / 1000;
      system.wait(run.gap_us != 0 ? static_cast<std::uint32_t>(left_us) : kNapUs);
      if (now - progress_ns > kGiveUpNs) break;
      continue;
    }
    std::memcpy(message.data(), &number, kNumberBytes);
    run.shared->sent_ns[number].store(now_ns());
    if (!system.send(message.data(), message.size())) {
      ++refused;
      system.wait(kNapUs);
      if (now - progress_ns > kGiveUpNs) break;
      continue;
    }
    ++number;
    next_ns += std::int64_t{run.gap_us} * 1000;
    progress_ns = now;
  }
  system.flush();
  std::printf("{\"refused\": %u, \"cpu_us\": %.1f}\n", refused, cpu_us() - cpu_before_us);
  return 0;
}

}  // namespace peers
