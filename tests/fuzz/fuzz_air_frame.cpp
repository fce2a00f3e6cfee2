// Bytes from the air. Whatever is accepted must survive being written and read again.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "frame/air_frame.hpp"

namespace {

using swarmtalk::frame::Frame;
using swarmtalk::frame::FrameWriter;
using swarmtalk::frame::PacketReader;
using swarmtalk::frame::ParseResult;

void check(bool is_as_it_must_be) {
  if (!is_as_it_must_be) std::abort();
}

bool is_same(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Frame frame;
  if (swarmtalk::frame::parse({data, size}, frame) != ParseResult::kOk) return 0;

  std::vector<std::uint8_t> buffer(size);
  FrameWriter writer(buffer, frame.header, buffer.size());
  PacketReader reader(frame.packets);
  for (std::span<const std::uint8_t> packet; reader.next(packet);) check(writer.append(packet));

  swarmtalk::frame::LastMessageReader beacon(frame.last_messages);
  for (swarmtalk::frame::LastMessage last; beacon.next(last);) check(writer.append_last(last));

  Frame again;
  check(swarmtalk::frame::parse(writer.finish(), again) == ParseResult::kOk);
  check(again.header == frame.header);
  check(is_same(again.packets, frame.packets.first(again.packets.size())));
  check(is_same(again.last_messages, frame.last_messages.first(again.last_messages.size())));
  check(beacon.is_malformed() == (again.last_messages.size() != frame.last_messages.size()));
  if (!reader.is_malformed()) check(again.packets.size() == frame.packets.size());
  return 0;
}
