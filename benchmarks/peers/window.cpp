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
               "usage: %s receive SHARED COUNT BYTES | send SHARED COUNT BYTES GAP_US|window=N\n",
               program);
  std::exit(2);
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
  if (!run.is_sender && std::strcmp(argv[1], "receive") != 0) usage(argv[0]);
  if (argc != (run.is_sender ? 6 : 5)) usage(argv[0]);
  run.shared = &map_shared(argv[2]);
  run.count = static_cast<std::uint32_t>(std::strtoul(argv[3], nullptr, 10));
  run.size_bytes = std::strtoul(argv[4], nullptr, 10);
  if (run.count == 0 || run.count > kMaxMessages || run.size_bytes < kNumberBytes) usage(argv[0]);
  if (!run.is_sender) return run;
  const bool is_windowed = std::strncmp(argv[5], "window=", 7) == 0;
  const auto number =
      static_cast<std::uint32_t>(std::strtoul(is_windowed ? argv[5] + 7 : argv[5], nullptr, 10));
  if (number == 0) usage(argv[0]);
  (is_windowed ? run.window : run.gap_us) = number;
  return run;
}

Receiver::Receiver(const Run& run) : run_(run), last_ns_(now_ns()) {
  latencies_us_.reserve(run.count);
}

void Receiver::ready() {
  cpu_before_us_ = cpu_us();
  last_ns_ = now_ns();
  run_.shared->receiver_ready = 1;
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
  run_.shared->received = static_cast<std::uint32_t>(latencies_us_.size());
  if (latencies_us_.size() == run_.count) complete_ = true;
  return complete_;
}

bool Receiver::has_stalled() const {
  return now_ns() - last_ns_.load() > kGiveUpNs;
}

int Receiver::report() const {
  std::vector<float> sorted = latencies_us_;
  std::sort(sorted.begin(), sorted.end());
  auto quantile = [&](double q) {
    return sorted.empty()
               ? 0.0
               : double{
                     sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))]};
  };
  const double seconds = static_cast<double>(last_ns_.load() - first_ns_) / 1e9;
  std::printf(
      "{\"received\": %zu, \"p50_us\": %.2f, \"p99_us\": %.2f, \"seconds\": %.6f, "
      "\"cpu_us\": %.1f}\n",
      sorted.size(), quantile(0.5), quantile(0.99), seconds, cpu_us() - cpu_before_us_);
  return sorted.size() == run_.count ? 0 : 1;
}

}  // namespace peers
