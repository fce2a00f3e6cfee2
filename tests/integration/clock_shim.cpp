// LD_PRELOAD library for tests: lets one process believe that the wall clock was set, without
// setting this machine's. SWARMTALK_CLOCK_OFFSET names a file that holds the offset, int64
// nanoseconds. Kernel receive stamps of recvmmsg() are shifted too; the first read after a change
// keeps the offset before it, as stamps do that were taken before the clock was set.
// SWARMTALK_MONOTONIC_OFFSET: the same of the monotonic clock, which stands still while a machine
// is suspended.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>

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

std::int64_t offset_ns() {
  static const Offset offset("SWARMTALK_CLOCK_OFFSET");
  return offset.ns();
}

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
  if (result == 0 && clock == CLOCK_REALTIME) shift(*time, offset_ns());
  if (result == 0 && clock == CLOCK_MONOTONIC) shift(*time, monotonic_offset_ns());
  return result;
}

extern "C" int recvmmsg(int socket, mmsghdr* messages, unsigned count, int flags,
                        timespec* timeout) {
  static const auto original = real<int (*)(int, mmsghdr*, unsigned, int, timespec*)>("recvmmsg");
  static std::int64_t stamped_with_ns = offset_ns();
  const int result = original(socket, messages, count, flags, timeout);
  for (int i = 0; i < result; ++i) {
    msghdr& header = messages[i].msg_hdr;
    for (cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr;
         part = CMSG_NXTHDR(&header, part)) {
      if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_TIMESTAMPNS) continue;
      timespec stamp;
      std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
      shift(stamp, stamped_with_ns);
      std::memcpy(CMSG_DATA(part), &stamp, sizeof stamp);
    }
  }
  if (result > 0) stamped_with_ns = offset_ns();
  return result;
}
