// What a message costs the client library's own code, for a processor whose instructions are
// counted by other means (docs/benchmarks.md): MESSAGES publications made into bytes, or deliveries
// of bytes made into what a callback gets. No socket, no system call in between.
//   small_processor MESSAGES send|receive     prints a sum of bytes
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <swarmtalk/client.hpp>

#include "client_lib/convert.hpp"
#include "ipc/framing.hpp"
#include "ipc/message_frames.hpp"

namespace {

using namespace swarmtalk;

constexpr std::size_t kPayloadBytes = 64;
constexpr std::size_t kRoomBytes = 4096;
constexpr std::uint64_t kSomeTimeNs = 123'456'789'012'345;

std::size_t send(std::uint64_t messages) {
  const std::string payload(kPayloadBytes, 'x');
  std::string bytes;
  std::size_t sum = 0;
  for (std::uint64_t i = 1; i <= messages; ++i) {
    ipc::PublishFrame frame;
    frame.publisher_id = 1;
    frame.publish_number = i;
    frame.payload = payload;
    frame.sent_at_ns = kSomeTimeNs;
    bytes.clear();
    if (!ipc::append_frame(frame, bytes)) return 0;
    sum += bytes.size();
  }
  return sum;
}

std::size_t receive(std::uint64_t messages) {
  const std::string payload(kPayloadBytes, 'x');
  ipc::DeliverFrame delivery;
  delivery.subscription_id = 1;
  delivery.payload = payload;
  delivery.channel = 33'000;
  delivery.sender = 7;
  delivery.epoch = 12'345;
  delivery.message_number = 1;
  delivery.received_at_ns = kSomeTimeNs;
  std::string bytes;
  if (!ipc::append_frame(delivery, bytes)) return 0;
  ipc::FrameReader reader;
  Message message;
  std::size_t sum = 0;
  for (std::uint64_t i = 0; i < messages; ++i) {
    const auto room = reader.prepare(kRoomBytes);
    std::copy(bytes.begin(), bytes.end(), room.begin());
    reader.commit(bytes.size());
    std::string_view envelope;
    ipc::DeliverFrame frame;
    if (reader.next(envelope) != ipc::ReadResult::kEnvelope) return 0;
    if (!ipc::parse(envelope, frame)) return 0;
    client::convert(frame, message);
    sum += message.payload.size();
  }
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  const bool sends = argc == 3 && std::strcmp(argv[2], "send") == 0;
  if (!sends && (argc != 3 || std::strcmp(argv[2], "receive") != 0)) {
    std::fprintf(stderr, "usage: small_processor MESSAGES send|receive\n");
    return 2;
  }
  const std::uint64_t messages = std::strtoull(argv[1], nullptr, 10);
  const std::size_t sum = sends ? send(messages) : receive(messages);
  std::printf("%zu\n", sum);
  return sum != 0 ? 0 : 1;
}
