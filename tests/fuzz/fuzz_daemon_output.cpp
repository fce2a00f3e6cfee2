// What comes from the air and from other programs, all the way through the daemon: whatever it
// writes to a client, the client's parser takes, and every string in it is text. Input: pieces of a
// length byte, a kind byte and that many bytes: the payload of a message that says it crossed a
// gateway, any packet, the name of another program, or a channel's name that it asks for.
#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "tests/fuzz/daemon_driver.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  [[maybe_unused]] static const auto before = google::protobuf::SetLogHandler(nullptr);
  swarmtalk::fuzz::Robot robot;
  std::span<const std::uint8_t> rest(bytes, size);
  for (int pieces = 0; rest.size() >= 2 && pieces < 16; ++pieces) {
    const std::size_t length = std::min<std::size_t>(rest[0], rest.size() - 2);
    const std::uint8_t kind = rest[1];
    const auto piece = rest.subspan(2, length);
    rest = rest.subspan(2 + length);
    switch (kind % 4) {
      case 0:
        robot.crossed(piece);
        break;
      case 1:
        robot.any_packet(piece);
        break;
      default:
        robot.program(std::string(piece.begin(), piece.end()), kind % 4 == 2);
    }
  }
  robot.check();
  return 0;
}
