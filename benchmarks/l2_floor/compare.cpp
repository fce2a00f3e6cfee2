#include "benchmarks/l2_floor/compare.hpp"

#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <new>
#include <stdexcept>
#include <thread>
#include <vector>

#include "benchmarks/l2_floor/ends.hpp"
#include "benchmarks/l2_floor/veth_pair.hpp"

namespace swarmtalk::l2_floor {
namespace {

using namespace std::chrono_literals;

constexpr unsigned kRunLimitSeconds = 60;
constexpr auto kStall = 20us;  // of a sender whose window is full
constexpr auto kSettle = 50ms;

/// What the two processes of a run tell each other and the one that started them.
struct Shared {
  std::atomic<bool> is_receiver_ready{false};
  std::atomic<bool> is_paced_phase_over{false};
  std::atomic<std::size_t> received{0};
  Result paced_receiver;
  double paced_sender_cpu_us = 0.0;
  double window_receiver_cpu_us = 0.0;
  double window_sender_cpu_us = 0.0;
  double window_seconds = 0.0;
};

struct RunResult {
  double p50_us, p99_us, paced_cpu_us, window_cpu_us, rate_per_s;
  bool is_complete;
};

void send_phases(Sender& sender, const CompareConfig& config, Shared& shared) {
  while (!shared.is_receiver_ready) std::this_thread::sleep_for(1ms);
  sender.wait_until(now_ns() + std::chrono::nanoseconds(kSettle).count());

  const double cpu_at_start_us = cpu_us();
  std::int64_t next_ns = now_ns();
  for (std::size_t i = 0; i < config.paced_messages; ++i) {
    next_ns += std::chrono::nanoseconds(config.gap).count();
    sender.wait_until(next_ns);
    sender.send(config.message_bytes);
  }
  shared.paced_sender_cpu_us = cpu_us() - cpu_at_start_us;
  while (!shared.is_paced_phase_over) sender.wait_until(now_ns() + 1'000'000);

  const double cpu_before_us = cpu_us();
  const std::int64_t start_ns = now_ns();
  for (std::size_t sent = 0; sent < config.window_messages; ++sent) {
    while (sent - shared.received >= config.window) {
      sender.wait_until(0);
      std::this_thread::sleep_for(kStall);
    }
    sender.send(config.message_bytes);
  }
  while (shared.received < config.window_messages) sender.wait_until(now_ns() + 100'000);
  shared.window_seconds = static_cast<double>(now_ns() - start_ns) / 1e9;
  shared.window_sender_cpu_us = cpu_us() - cpu_before_us;
}

void receive_phases(Receiver& receiver, const CompareConfig& config, Shared& shared) {
  shared.is_receiver_ready = true;
  Samples samples(config.paced_messages);
  double cpu_before_us = cpu_us();
  receiver.receive([&](std::span<const std::uint8_t> message) {
    samples.add(message);
    return samples.count() < config.paced_messages;
  });
  shared.paced_receiver = samples.result(cpu_us() - cpu_before_us);
  shared.is_paced_phase_over = true;

  cpu_before_us = cpu_us();
  receiver.receive([&](std::span<const std::uint8_t>) {
    return shared.received.fetch_add(1) + 1 < config.window_messages;
  });
  shared.window_receiver_cpu_us = cpu_us() - cpu_before_us;
}

/// Runs `work` in a child process with a time limit.
pid_t spawn(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child != 0) return child;
  alarm(kRunLimitSeconds);
  try {
    work();
    _exit(0);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "l2_floor: %s\n", error.what());
    _exit(1);
  }
}

bool has_succeeded(pid_t child) {
  int status = 0;
  return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) &&
         WEXITSTATUS(status) == 0;
}

RunResult run(const VethPair& pair, const CompareConfig& config, bool is_bare) {
  void* const memory =
      mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::runtime_error("mmap failed");
  Shared& shared = *new (memory) Shared;
  const pid_t receiver = spawn([&] {
    pair.enter('b');
    receive_phases(*(is_bare ? open_bare_receiver : open_link_receiver)(kInterface), config,
                   shared);
  });
  const pid_t sender = spawn([&] {
    pair.enter('a');
    send_phases(*(is_bare ? open_bare_sender : open_link_sender)(kInterface), config, shared);
  });
  const bool has_received = has_succeeded(receiver);
  const bool has_sent = has_succeeded(sender);
  const auto paced = static_cast<double>(config.paced_messages);
  const auto windowed = static_cast<double>(config.window_messages);
  const RunResult result{shared.paced_receiver.p50_us,
                         shared.paced_receiver.p99_us,
                         shared.paced_receiver.cpu_us + shared.paced_sender_cpu_us / paced,
                         (shared.window_receiver_cpu_us + shared.window_sender_cpu_us) / windowed,
                         windowed / shared.window_seconds,
                         has_received && has_sent &&
                             shared.paced_receiver.messages == config.paced_messages &&
                             shared.received == config.window_messages};
  munmap(memory, sizeof(Shared));
  return result;
}

double median_of(const std::vector<RunResult>& runs, double RunResult::*field) {
  std::vector<double> values;
  for (const RunResult& result : runs) values.push_back(result.*field);
  return median(values);
}

void print(const char* name, const std::vector<RunResult>& runs) {
  std::printf(
      "{\"ends\": \"%s\", \"runs\": %zu, \"p50_us\": %.1f, \"p99_us\": %.1f, "
      "\"paced_cpu_us\": %.2f, \"window_cpu_us\": %.2f, \"rate_per_s\": %.0f}\n",
      name, runs.size(), median_of(runs, &RunResult::p50_us), median_of(runs, &RunResult::p99_us),
      median_of(runs, &RunResult::paced_cpu_us), median_of(runs, &RunResult::window_cpu_us),
      median_of(runs, &RunResult::rate_per_s));
}

/// Median over the pairs of the link's value divided by the bare one's of the same pair.
double ratio(const std::vector<RunResult>& bare, const std::vector<RunResult>& link,
             double RunResult::*field) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < bare.size(); ++i) ratios.push_back(link[i].*field / bare[i].*field);
  return median(ratios);
}

}  // namespace

int compare(const CompareConfig& config) {
  const VethPair pair;
  std::vector<RunResult> bare, link;
  for (std::size_t i = 0; i < config.pairs; ++i) {
    bare.push_back(run(pair, config, true));
    link.push_back(run(pair, config, false));
    if (!bare.back().is_complete || !link.back().is_complete) {
      std::fprintf(stderr, "l2_floor: messages were lost in pair %zu\n", i + 1);
      return 1;
    }
  }
  print("bare", bare);
  print("raw_l2", link);
  std::printf(
      "{\"ratio\": \"raw_l2 / bare\", \"p50\": %.2f, \"p99\": %.2f, \"paced_cpu\": %.2f, "
      "\"window_cpu\": %.2f, \"rate\": %.2f}\n",
      ratio(bare, link, &RunResult::p50_us), ratio(bare, link, &RunResult::p99_us),
      ratio(bare, link, &RunResult::paced_cpu_us), ratio(bare, link, &RunResult::window_cpu_us),
      ratio(bare, link, &RunResult::rate_per_s));
  return 0;
}

}  // namespace swarmtalk::l2_floor
