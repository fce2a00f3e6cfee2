#include "daemon/session/client_input.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace swarmtalk::daemon {
namespace {

constexpr int kReadsOfBells = 4;  // more are heard later
// A socket takes 200 bells, and a client rings once for each frame at most. One that rings more
// often is held up until Clients has all heard.
constexpr std::size_t kFramesUnheard = 100;
constexpr auto kOften = std::chrono::milliseconds(90);  // seldom: no timer, which wakes us as well

}  // namespace

bool ClientInput::begin_ring() {
  std::optional<ipc::RingMemory> memory = rings_.take(client_);
  if (!memory) return false;
  ring_.emplace(std::move(*memory));
  return true;
}

void ClientInput::end_ring(bool has_left) {
  rings_.give_back(std::move(ring_->memory()), client_, has_left);
  ring_.reset();
}

void ClientInput::leave() {
  if (!ring_) return;
  if (ring_->is_spoiled()) rings_.bar(client_);
  const bool has_left = ring_->writer_has_left();
  ring_->leave();
  end_ring(has_left);
}

ClientInput::Result ClientInput::read_socket(int socket, std::span<std::uint8_t> room,
                                             std::size_t& got) {
  for (;;) {
    const ssize_t count = recv(socket, room.data(), room.size(), 0);
    if (count > 0) {
      got = static_cast<std::size_t>(count);
      return Result::kBytes;
    }
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return Result::kNothing;
    end_reason_ = count == 0 ? "it closed the connection" : std::strerror(errno);
    return Result::kEnded;
  }
}

ClientInput::Result ClientInput::wake(int socket, bool must_hear) {
  if (!ring_) return Result::kNothing;
  const auto now = std::chrono::steady_clock::now();
  const bool is_often = now - std::exchange(woken_at_, now) < kOften;
  has_unheard_ =
      !must_hear && is_often && frames_since_bell_ < kFramesUnheard && ring_->has_bytes();
  return has_unheard_ ? Result::kNothing : hear(socket, must_hear);
}

// What the client wrote into the ring before its end is still read.
ClientInput::Result ClientInput::hear(int socket, bool to_its_end) {
  has_unheard_ = false;
  frames_since_bell_ = 0;
  std::array<std::uint8_t, 256> bells;
  for (int i = 0; i < kReadsOfBells && end_reason_.empty(); ++i) {
    std::size_t got = 0;
    if (read_socket(socket, bells, got) != Result::kBytes) break;
    const auto is_bell = [](std::uint8_t byte) { return byte == ipc::kBell; };
    if (!std::all_of(bells.begin(), bells.begin() + got, is_bell)) {
      has_bad_bell_ = true;
      return Result::kBroken;
    }
    if (got < bells.size() && !to_its_end) return Result::kNothing;
    has_unheard_ = i + 1 == kReadsOfBells;
  }
  return Result::kNothing;
}

ClientInput::Result ClientInput::read(int socket, std::span<std::uint8_t> room, std::size_t& got) {
  if (!ring_) return read_socket(socket, room, got);
  if (has_bad_bell_) return Result::kBroken;
  const std::optional<std::size_t> count = ring_->read(room);
  if (!count) return Result::kBroken;  // leave() looks whose fault it is
  got = *count;
  if (got > 0) return Result::kBytes;
  return end_reason_.empty() ? Result::kNothing : Result::kEnded;
}

// Whoever is held up by unread bells would not ring again.
bool ClientInput::sleep(int socket) {
  if (!ring_) return true;
  if (has_unheard_ && frames_since_bell_ >= kFramesUnheard) hear(socket, false);
  return end_reason_.empty() && !has_bad_bell_ && ring_->sleep();
}

}  // namespace swarmtalk::daemon
