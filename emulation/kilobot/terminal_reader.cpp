#include "emulation/kilobot/terminal_reader.hpp"

#include <poll.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <vector>

namespace swarmtalk::emulator {
namespace {

constexpr std::uint64_t kLateBytes = 4;     // as many come at once when the reader is late
constexpr std::size_t kBytesMax = 1 << 16;  // of a host that writes to an emulation far behind

std::uint64_t monotonic_ns() {
  return static_cast<std::uint64_t>(
      std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count());
}

}  // namespace

// Of this thread alone. Niceness is the second best: it gives a larger share, but not at once.
void read_before_others() {
  constexpr int kNice = -15;
  const sched_param lowest{::sched_get_priority_min(SCHED_FIFO)};
  if (::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &lowest) == 0) return;
  ::setpriority(PRIO_PROCESS, 0, kNice);  // without the right, nothing
}

std::optional<TimedByte> PacedReader::next(std::uint64_t now_ns) {
  line_free_ns_ = std::max(line_free_ns_, now_ns - std::min(now_ns, kLateBytes * byte_ns_));
  if (line_free_ns_ + byte_ns_ > now_ns) return std::nullopt;
  std::vector<std::uint8_t> byte;
  if (terminal_.read_into(byte, 1) == 0) return std::nullopt;
  line_free_ns_ += byte_ns_;
  return TimedByte{byte[0], line_free_ns_};
}

TerminalReader::TerminalReader(Pty& terminal, std::uint64_t byte_ns)
    : terminal_(terminal), reader_(terminal, byte_ns), wake_(::eventfd(0, EFD_CLOEXEC)) {
  if (wake_ < 0) throw std::runtime_error("cannot make an event descriptor");
  thread_ = std::thread([this] { run(); });
}

TerminalReader::~TerminalReader() {
  is_stopping_ = true;
  const std::uint64_t one = 1;
  while (::write(wake_, &one, sizeof one) < 0 && errno == EINTR) {
  }
  thread_.join();
  ::close(wake_);
}

std::optional<TimedByte> TerminalReader::take(std::uint64_t until_ns) {
  const std::lock_guard lock(mutex_);
  if (bytes_.empty() || bytes_.front().at_ns > until_ns) return std::nullopt;
  const TimedByte byte = bytes_.front();
  bytes_.pop_front();
  return byte;
}

bool TerminalReader::has_room() {
  const std::lock_guard lock(mutex_);
  return bytes_.size() < kBytesMax;
}

void TerminalReader::run() {
  read_before_others();
  while (!is_stopping_) {
    std::array<pollfd, 2> pollers{{{terminal_.descriptor(), POLLIN, 0}, {wake_, POLLIN, 0}}};
    ::poll(pollers.data(), pollers.size(), -1);
    while (has_room()) {
      const auto byte = reader_.next(monotonic_ns());
      if (!byte) break;
      const std::lock_guard lock(mutex_);
      bytes_.push_back(*byte);
    }
    std::this_thread::sleep_for(kLinePoll);  // what is there already takes its time on the line
  }
}

}  // namespace swarmtalk::emulator
