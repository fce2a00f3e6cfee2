// Bytes from the air on a link with a swarm key. First byte: what is done to the rest. As they are,
// they must not be taken (nobody guesses a tag); sealed properly first, they must be taken once and
// come out as they went in; sealed and then altered, they must be refused.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "frame/sealing.hpp"

namespace {

using namespace swarmtalk::frame;

constexpr std::size_t kLongestPlain = 4096;

void check(bool is_as_it_must_be) {
  if (!is_as_it_must_be) std::abort();
}

std::shared_ptr<const SwarmKey> the_key() {
  static const auto key = [] {
    std::array<std::uint8_t, SwarmKey::kBytes> bytes;
    // Not the key of the vectors, which are in the corpus.
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i + 100);
    return std::make_shared<const SwarmKey>(std::span<const std::uint8_t, SwarmKey::kBytes>(bytes));
  }();
  return key;
}

void walk(const Frame& frame) {
  PacketReader reader(frame.packets);
  volatile std::uint8_t sum = 0;
  for (std::span<const std::uint8_t> packet; reader.next(packet);) {
    for (const std::uint8_t byte : packet) sum = static_cast<std::uint8_t>(sum + byte);
  }
}

/// A frame whose plaintext is `plain`, whatever it says.
std::vector<std::uint8_t> seal(std::span<const std::uint8_t> plain, bool has_pose) {
  const Sealer sealer(the_key(), SealSession{1, 2, 3, 4, 5, 6});
  std::vector<std::uint8_t> frame(kSealedHeaderBytes + plain.size() + kTagBytes);
  FrameHeader header;
  header.node = 7;
  header.epoch = 8;
  header.counter = 9;
  FrameWriter(frame, header, frame.size()).finish();  // magic to counter
  frame[3] = static_cast<std::uint8_t>(2 | (has_pose ? 1 : 0));
  frame[4] = static_cast<std::uint8_t>(frame.size() >> 8);
  frame[5] = static_cast<std::uint8_t>(frame.size());
  std::copy(plain.begin(), plain.end(), frame.begin() + kSealedHeaderBytes);
  sealer.seal(frame);
  return frame;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::uint8_t mode = data[0];
  const std::span<const std::uint8_t> rest(data + 1, std::min(size - 1, kLongestPlain));
  Frame frame;
  Opener opener(the_key());
  if ((mode & 3) == 0) {
    check(opener.open(rest, frame) != ParseResult::kOk);
    if (Opener().open(rest, frame) == ParseResult::kOk) walk(frame);
    return 0;
  }
  const bool has_pose = (mode & 4) != 0;
  std::vector<std::uint8_t> bytes = seal(rest, has_pose);
  if ((mode & 3) == 1) {
    bytes[(mode >> 3) * bytes.size() / 32] ^= static_cast<std::uint8_t>(1 + rest[0] % 255);
    check(opener.open(bytes, frame) != ParseResult::kOk);
    return 0;
  }
  const ParseResult result = opener.open(bytes, frame);
  if (has_pose && rest.size() < kPoseBytes) {
    check(result == ParseResult::kTruncated);
    return 0;
  }
  check(result == ParseResult::kOk);
  check(frame.packets.size() == rest.size() - (has_pose ? kPoseBytes : 0));
  check(std::equal(frame.packets.begin(), frame.packets.end(),
                   rest.end() - static_cast<std::ptrdiff_t>(frame.packets.size())));
  walk(frame);
  check(opener.open(bytes, frame) == ParseResult::kReplayed);
  return 0;
}
