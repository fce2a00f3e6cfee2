// Plaintexts of authentic frames in any order, from a few voices, with a clock that jumps: whatever
// a robot of the swarm sends, what is read lies inside of it, and what is written fits its room.
// Input: pieces of a length byte, a byte of voice and time, and that many bytes.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "frame/freshness.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using swarmtalk::frame::Freshness;
  std::uint8_t next = 0;
  const auto count = [&next](std::span<std::uint8_t> out) {
    for (std::uint8_t& byte : out) byte = next++;
  };
  Freshness sut({1, 2, 3, 4, 5, 6}, 1000, count);
  std::span<const std::uint8_t> rest(bytes, size);
  Freshness::Ms now = 1000;
  std::uint32_t counter = 0;
  while (rest.size() >= 2) {
    const std::size_t length = std::min<std::size_t>(rest[0], rest.size() - 2);
    const std::uint8_t how = rest[1];
    const std::vector<std::uint8_t> plaintext(
        rest.begin() + 2, rest.begin() + 2 + static_cast<std::ptrdiff_t>(length));
    rest = rest.subspan(2 + length);
    now += how / 4 * 50u;
    Freshness::Voice voice{};
    voice[0] = how % 4;
    std::size_t used = 0;
    const auto verdict = sut.receive(voice, ++counter, plaintext, now, used);
    if (verdict != Freshness::Verdict::kMalformed && used > plaintext.size()) std::abort();
    if (verdict == Freshness::Verdict::kFresh && !sut.was_heard(voice, counter)) std::abort();
    std::vector<std::uint8_t> room(std::max<std::size_t>(length, Freshness::kLeastBytes));
    if (sut.write(now, room) > room.size()) std::abort();
  }
  return 0;
}
