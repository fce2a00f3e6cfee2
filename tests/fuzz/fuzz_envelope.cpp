// Bytes from a peer on the local socket: first byte says in what portions they arrive. Whatever is
// accepted must survive being written and read again.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

#include <google/protobuf/stubs/logging.h>

#include "ipc/framing.hpp"

using swarmtalk::ipc::Envelope;
using swarmtalk::ipc::FrameReader;
using swarmtalk::ipc::ReadResult;

namespace {

void check_round_trip(const Envelope& envelope) {
  std::string buffer;
  if (!swarmtalk::ipc::append_frame(envelope, buffer)) return;  // canonical form may be empty
  FrameReader reader;
  auto room = reader.prepare(buffer.size());
  std::memcpy(room.data(), buffer.data(), buffer.size());
  reader.commit(buffer.size());
  Envelope again;
  if (reader.next(again) != ReadResult::kEnvelope) std::abort();
  if (swarmtalk::ipc::count_bodies(again) != swarmtalk::ipc::count_bodies(envelope)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  // Not a line for each name that is not UTF-8.
  [[maybe_unused]] static const auto before = google::protobuf::SetLogHandler(nullptr);
  if (size == 0) return 0;
  const std::size_t portion = bytes[0] == 0 ? size : bytes[0];
  FrameReader reader;
  Envelope envelope;
  for (std::size_t at = 1; at < size; at += portion) {
    const std::size_t count = std::min(portion, size - at);
    auto room = reader.prepare(count);
    std::memcpy(room.data(), bytes + at, count);
    reader.commit(count);
    for (;;) {
      const ReadResult result = reader.next(envelope);
      if (result == ReadResult::kMalformed) return 0;
      if (result == ReadResult::kNeedMore) break;
      check_round_trip(envelope);
    }
  }
  return 0;
}
