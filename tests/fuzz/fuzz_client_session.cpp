// Hostile programs and the whole way of what they send: the daemon answers in the protocol, goes on
// serving who was there before, and keeps nothing of those who hang up. Input: pieces of two length
// bytes, a kind byte and that many bytes. Bits 0 to 3 of the kind: what is done with them; bits 4
// and 5: by which of four programs.
#include <google/protobuf/stubs/logging.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

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
  void envelope(std::span<const std::uint8_t> sent) {
    const auto size = static_cast<std::uint32_t>(sent.size());
    std::vector<std::uint8_t> framed;
    for (int shift = 0; shift < 32; shift += 8) {
      framed.push_back(static_cast<std::uint8_t>(size >> shift));
    }
    framed.insert(framed.end(), sent.begin(), sent.end());
    bytes(framed);
  }

  void greet() {
    ipc::Envelope hello;
    hello.mutable_hello()->set_major(ipc::kProtocolMajor);
    fuzz::Robot::send(end_, hello);
  }
  void read() { fuzz::Robot::read(end_, reader_); }
  void come_again() {
    go();
    reader_.clear();
    end_ = robot_.connect();
  }
  void go() { robot_.hang_up(end_); }

 private:
  fuzz::Robot& robot_;
  int end_;
  ipc::FrameReader reader_;
};

void act(fuzz::Robot& robot, Program& program, unsigned kind, std::span<const std::uint8_t> piece) {
  switch (kind) {
    case 0:
      return program.bytes(piece);
    case 1:
      return program.greet();
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
