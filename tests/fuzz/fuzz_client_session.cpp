// Hostile programs and the whole way of what they send, through sockets and rings: the daemon
// answers in the protocol, goes on serving who was there before, and keeps nothing of those who
// hang up. Input: pieces of two length bytes, a kind byte and that many bytes. Bits 0 to 3 of the
// kind: what is done with them; bits 4 and 5: by which of four programs.
#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "ipc/byte_ring.hpp"
#include "ipc/pass_descriptor.hpp"
#include "tests/fuzz/daemon_driver.hpp"

namespace {

using namespace swarmtalk;

constexpr int kMostPieces = 64;

/// One of them.
class Program {
 public:
  explicit Program(fuzz::Robot& robot) : robot_(robot), end_(robot.connect()) {}

  void bytes(std::span<const std::uint8_t> sent) {
    ::send(end_, sent.data(), sent.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  /// As if it were right: with a length before it.
  void envelope(std::span<const std::uint8_t> sent) { bytes_of(framed(sent)); }

  void greet(bool asks_for_ring) {
    ipc::Envelope hello;
    hello.mutable_hello()->set_major(ipc::kProtocolMajor);
    if (asks_for_ring) hello.mutable_hello()->add_features(ipc::kRingFeature);
    fuzz::Robot::send(end_, hello);
    if (!asks_for_ring || ring_) return;
    robot_.step();
    const auto room = reader_.prepare(4096);
    int descriptor = -1;
    const ssize_t got = ipc::receive_with_descriptor(end_, room.data(), room.size(), descriptor);
    if (got > 0) reader_.commit(static_cast<std::size_t>(got));
    if (descriptor < 0) return;
    ipc::RingMemory memory = ipc::RingMemory::adopt(descriptor);
    if (!memory.is_valid()) std::abort();
    header_ = &memory.header();
    ring_.emplace(std::move(memory));
  }
  void through_ring(std::span<const std::uint8_t> sent) {
    if (!ring_) return;
    ring_->write(framed(sent));
    ring_bell();
  }
  /// @param bytes  two of the place, then what is written there
  void scribble(std::span<const std::uint8_t> bytes) {
    if (!ring_ || bytes.size() < 2) return;
    auto* const memory = reinterpret_cast<std::uint8_t*>(header_);
    const std::size_t place = (bytes[0] | std::size_t{bytes[1]} << 8) % ipc::kRingHeaderBytes;
    const std::size_t size = std::min(bytes.size() - 2, ipc::kRingHeaderBytes - place);
    std::memcpy(memory + place, bytes.data() + 2, size);
    ring_bell();
  }
  void ring_bell() { bytes(std::array<std::uint8_t, 1>{ipc::kBell}); }
  void read() { fuzz::Robot::read(end_, reader_); }
  void come_again() {
    go();
    reader_.clear();
    end_ = robot_.connect();
  }
  void go() {
    ring_.reset();
    robot_.hang_up(end_);
  }

 private:
  static std::string framed(std::span<const std::uint8_t> sent) {
    const auto size = static_cast<std::uint32_t>(sent.size());
    std::string made;
    for (int shift = 0; shift < 32; shift += 8) made += static_cast<char>(size >> shift);
    return made.append(sent.begin(), sent.end());
  }
  void bytes_of(const std::string& sent) {
    bytes({reinterpret_cast<const std::uint8_t*>(sent.data()), sent.size()});
  }

  fuzz::Robot& robot_;
  int end_;
  ipc::FrameReader reader_;
  std::optional<ipc::RingWriter> ring_;
  ipc::RingHeader* header_ = nullptr;  // of ring_
};

void act(fuzz::Robot& robot, Program& program, unsigned kind, std::span<const std::uint8_t> piece) {
  switch (kind) {
    case 0:
      return program.bytes(piece);
    case 1:
      return program.greet(false);
    case 2:
      return program.greet(true);
    case 3:
    case 4:
      return program.through_ring(piece);
    case 5:
      return program.scribble(piece);
    case 6:
      return program.ring_bell();
    case 7:
      return program.come_again();
    case 8:
      return robot.any_packet(piece);
    case 9:
      return robot.step();
    case 10:
      return program.read();
    default:
      return program.envelope(piece);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  [[maybe_unused]] static const auto before = google::protobuf::SetLogHandler(nullptr);
  fuzz::Robot robot;
  std::array<Program, 4> programs{Program(robot), Program(robot), Program(robot), Program(robot)};
  std::span<const std::uint8_t> rest(bytes, size);
  for (int pieces = 0; rest.size() >= 3 && pieces < kMostPieces; ++pieces) {
    const std::size_t length = std::min<std::size_t>(rest[0] + 256U * rest[1], rest.size() - 3);
    const unsigned kind = rest[2];
    act(robot, programs[kind >> 4 & 3], kind & 15, rest.subspan(3, length));
    rest = rest.subspan(3 + length);
    robot.step();
  }
  robot.check();
  for (Program& each : programs) each.go();
  robot.step();
  if (robot.clients() != 1) std::abort();
  return 0;
}
