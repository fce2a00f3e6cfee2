// The sending loops of window.hpp.
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
    const bool is_due = run.gap_us != 0 ? now >= next_ns : number - run.slowest() < run.window;
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

constexpr std::int64_t kSettleNs = 4'000'000'000;   // until all know each other
constexpr std::int64_t kSilenceNs = 2'000'000'000;  // then what is missing is lost
constexpr std::uint32_t kListenUs = 20'000;

/// Waits for all robots. @return when the first one begins
template <class System>
std::int64_t begin_of_swarm(const Run& run, System& system) {
  Shared& shared = *run.shared;
  const std::int64_t came_ns = now_ns();
  if (++shared.ready == run.robots) shared.begin_ns = now_ns() + kSettleNs;
  while (shared.begin_ns == 0 && now_ns() - came_ns < 6 * kGiveUpNs) system.listen(kListenUs);
  return shared.begin_ns;
}

template <class System>
int run_swarm(const Run& run, SwarmEar& ear, System& system) {
  Shared& shared = *run.shared;
  const std::int64_t begin_ns = begin_of_swarm(run, system);
  if (begin_ns == 0) return 1;
  const std::int64_t gap_ns = std::int64_t{run.gap_us} * 1000;
  while (now_ns() < begin_ns - kSilenceNs / 8) system.listen(kListenUs);
  const double cpu_before_us = cpu_us();
  std::int64_t next_ns = begin_ns + gap_ns * run.index / run.robots;
  std::string message(run.size_bytes, 'x');
  for (std::uint32_t i = 0; i < run.count; next_ns += gap_ns) {
    for (std::int64_t now = now_ns(); now < next_ns; now = now_ns()) {
      system.listen(static_cast<std::uint32_t>((next_ns - now) / 1000 + 1));
    }
    const std::uint32_t number = run.index * kSwarmMessages + i++;
    std::memcpy(message.data(), &number, kNumberBytes);
    shared.sent_ns[number].store(now_ns());
    system.send(message.data(), message.size());
  }
  const std::uint32_t all = run.count * (run.robots - 1);
  std::uint32_t heard = ear.heard();
  for (std::int64_t progress_ns = now_ns(); heard < all && now_ns() - progress_ns < kSilenceNs;) {
    system.listen(kListenUs);
    if (ear.heard() != heard) progress_ns = now_ns();
    heard = ear.heard();
  }
  const double used_us = cpu_us() - cpu_before_us;
  ++shared.done;
  for (const std::int64_t end_ns = now_ns() + kGiveUpNs;
       shared.done < run.robots && now_ns() < end_ns;) {
    system.listen(kListenUs);
  }
  return ear.report(used_us);
}

}  // namespace peers
