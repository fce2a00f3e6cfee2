// Bytes from a peer on the local socket: first byte says in what portions they arrive. Whatever is
// accepted must survive being written and read again, and what is read without an Envelope must be
// what protobuf reads.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

#include <google/protobuf/stubs/logging.h>

#include "ipc/framing.hpp"
#include "ipc/message_frames.hpp"

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

template <class Frame>
std::string bytes_of(const Frame& frame) {
  std::string bytes;
  if (!swarmtalk::ipc::append_frame(frame, bytes)) std::abort();
  return bytes;
}

void check_message_frames(std::string_view bytes) {
  swarmtalk::ipc::PublishFrame publish;
  swarmtalk::ipc::DeliverFrame deliver;
  const bool is_publish = swarmtalk::ipc::parse(bytes, publish);
  const bool is_deliver = swarmtalk::ipc::parse(bytes, deliver);
  if (!is_publish && !is_deliver) return;
  Envelope envelope;
  if (!swarmtalk::ipc::parse(bytes, envelope)) std::abort();
  if (envelope.has_request_id() || swarmtalk::ipc::count_bodies(envelope) != 1) std::abort();
  if (is_publish != envelope.has_publish() || is_deliver != envelope.has_deliver()) std::abort();
  if (is_publish && bytes_of(publish) != bytes_of(envelope)) std::abort();
  if (is_deliver && bytes_of(deliver) != bytes_of(frame_of(envelope.deliver()))) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  // Not a line for each name that is not UTF-8.
  [[maybe_unused]] static const auto before = google::protobuf::SetLogHandler(nullptr);
  if (size == 0) return 0;
  const std::size_t portion = bytes[0] == 0 ? size : bytes[0];
  FrameReader reader;
  for (std::size_t at = 1; at < size; at += portion) {
    const std::size_t count = std::min(portion, size - at);
    auto room = reader.prepare(count);
    std::memcpy(room.data(), bytes + at, count);
    reader.commit(count);
    for (;;) {
      std::string_view body;
      const ReadResult result = reader.next(body);
      if (result == ReadResult::kMalformed) return 0;
      if (result == ReadResult::kNeedMore) break;
      check_message_frames(body);
      Envelope envelope;
      if (!swarmtalk::ipc::parse(body, envelope)) return 0;
      check_round_trip(envelope);
    }
  }
  return 0;
}
