// LD_PRELOAD library for tests: shifts the monotonic clock of one process, which stands still while
// a machine is suspended. SWARMTALK_MONOTONIC_OFFSET names a file that holds the offset, int64
// nanoseconds.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>

namespace {

constexpr std::int64_t kNsPerS = 1'000'000'000;

/// What the file that a variable names holds now; 0: there is no such variable.
class Offset {
 public:
  explicit Offset(const char* variable) {
    const char* const path = std::getenv(variable);
    if (path == nullptr) return;
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) std::abort();
    void* const at = mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, file, 0);
    if (at == MAP_FAILED) std::abort();
    close(file);
    shared_ = static_cast<const std::atomic<std::int64_t>*>(at);
  }
  std::int64_t ns() const { return shared_ == nullptr ? 0 : shared_->load(); }

 private:
  const std::atomic<std::int64_t>* shared_ = nullptr;
};

std::int64_t monotonic_offset_ns() {
  static const Offset offset("SWARMTALK_MONOTONIC_OFFSET");
  return offset.ns();
}

void shift(timespec& time, std::int64_t by_ns) {
  const std::int64_t ns = time.tv_nsec + by_ns % kNsPerS;
  time.tv_sec += by_ns / kNsPerS + (ns < 0 ? -1 : ns >= kNsPerS ? 1 : 0);
  time.tv_nsec = (ns + kNsPerS) % kNsPerS;
}

template <typename Function>
Function real(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  static const auto original = real<int (*)(clockid_t, timespec*)>("clock_gettime");
  const int result = original(clock, time);
  if (result == 0 && clock == CLOCK_MONOTONIC) shift(*time, monotonic_offset_ns());
  return result;
}
