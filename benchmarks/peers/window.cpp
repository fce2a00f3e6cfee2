#include "benchmarks/peers/window.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <system_error>

namespace peers {
namespace {

std::int64_t clock_ns(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

[[noreturn]] void usage(const char* program) {
  std::fprintf(stderr,
               "usage: %s receive SHARED COUNT BYTES [INDEX] | send SHARED COUNT BYTES "
               "GAP_US|window=N [RECEIVERS] | swarm SHARED COUNT BYTES GAP_US INDEX ROBOTS\n",
               program);
  std::exit(2);
}

double quantile(const std::vector<float>& values, double q) {
  if (values.empty()) return 0.0;
  std::vector<float> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  return double{sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))]};
}

std::uint32_t number(const char* text) {
  return static_cast<std::uint32_t>(std::strtoul(text, nullptr, 10));
}

}  // namespace

Shared& map_shared(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0 || ftruncate(fd, sizeof(Shared)) != 0)
    throw std::system_error(errno, std::system_category(), path);
  void* memory = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  close(fd);
  if (memory == MAP_FAILED) throw std::system_error(errno, std::system_category(), path);
  return *static_cast<Shared*>(memory);
}

std::int64_t now_ns() {
  return clock_ns(CLOCK_MONOTONIC);
}

double cpu_us() {
  return static_cast<double>(clock_ns(CLOCK_PROCESS_CPUTIME_ID)) / 1000;
}

Run parse(int argc, char** argv) {
  Run run;
  if (argc < 5) usage(argv[0]);
  run.is_sender = std::strcmp(argv[1], "send") == 0;
  run.is_swarm = std::strcmp(argv[1], "swarm") == 0;
  const bool is_receiver = std::strcmp(argv[1], "receive") == 0;
  const int least = run.is_swarm ? 8 : run.is_sender ? 6 : 5;
  const int most = run.is_swarm ? 8 : least + 1;
  if (argc < least || argc > most || !(run.is_sender || run.is_swarm || is_receiver)) {
    usage(argv[0]);
  }
  run.shared = &map_shared(argv[2]);
  run.count = number(argv[3]);
  run.size_bytes = number(argv[4]);
  const std::uint32_t limit = run.is_swarm ? kSwarmMessages : kMaxMessages;
  if (run.count == 0 || run.count > limit || run.size_bytes < kNumberBytes) usage(argv[0]);
  if (is_receiver) {
    if (argc == 6) run.index = number(argv[5]);
  } else {
    const bool is_windowed = std::strncmp(argv[5], "window=", 7) == 0;
    (is_windowed ? run.window : run.gap_us) = number(is_windowed ? argv[5] + 7 : argv[5]);
    if (run.window + run.gap_us == 0 || (run.is_swarm && is_windowed)) usage(argv[0]);
    if (run.is_swarm) run.index = number(argv[6]);
    if (argc == most) run.robots = number(argv[most - 1]);
  }
  if (run.index >= kRobots || run.robots == 0 || run.robots > kRobots) usage(argv[0]);
  return run;
}

Receiver::Receiver(const Run& run) : run_(run), last_ns_(now_ns()) {
  latencies_us_.reserve(run.count);
}

void Receiver::ready() {
  cpu_before_us_ = cpu_us();
  last_ns_ = now_ns();
  ++run_.shared->ready;
}

bool Receiver::on_message(const void* bytes, std::size_t size) {
  std::uint32_t number = 0;
  if (size != run_.size_bytes) return false;
  std::memcpy(&number, bytes, kNumberBytes);
  if (number >= run_.count) return false;
  const std::int64_t now = now_ns();
  if (latencies_us_.empty()) first_ns_ = now;
  latencies_us_.push_back(static_cast<float>(now - run_.shared->sent_ns[number].load()) / 1000);
  last_ns_ = now;
  run_.shared->received[run_.index] = static_cast<std::uint32_t>(latencies_us_.size());
  if (latencies_us_.size() == run_.count) complete_ = true;
  return complete_;
}

bool Receiver::has_stalled() const {
  return now_ns() - last_ns_.load() > kGiveUpNs;
}

int Receiver::report() const {
  const double seconds = static_cast<double>(last_ns_.load() - first_ns_) / 1e9;
  std::printf(
      "{\"received\": %zu, \"p50_us\": %.2f, \"p99_us\": %.2f, \"seconds\": %.6f, "
      "\"cpu_us\": %.1f}\n",
      latencies_us_.size(), quantile(latencies_us_, 0.5), quantile(latencies_us_, 0.99), seconds,
      cpu_us() - cpu_before_us_);
  return latencies_us_.size() == run_.count ? 0 : 1;
}

SwarmEar::SwarmEar(const Run& run) : run_(run) {
  latencies_us_.reserve(std::size_t{run.count} * run.robots);
}

void SwarmEar::on_message(const void* bytes, std::size_t size) {
  std::uint32_t number = 0;
  if (size != run_.size_bytes) return;
  std::memcpy(&number, bytes, kNumberBytes);
  const std::uint32_t robot = number / kSwarmMessages;
  if (robot >= run_.robots || robot == run_.index) return;
  latencies_us_.push_back(static_cast<float>(now_ns() - run_.shared->sent_ns[number].load()) /
                          1000);
  heard_ = static_cast<std::uint32_t>(latencies_us_.size());
}

int SwarmEar::report(double cpu_us) const {
  std::printf("{\"received\": %zu, \"p50_us\": %.2f, \"p99_us\": %.2f, \"cpu_us\": %.1f}\n",
              latencies_us_.size(), quantile(latencies_us_, 0.5), quantile(latencies_us_, 0.99),
              cpu_us);
  return 0;
}

}  // namespace peers
