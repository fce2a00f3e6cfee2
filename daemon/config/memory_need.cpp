#include "daemon/config/memory_need.hpp"

#include <algorithm>

namespace swarmtalk::daemon {
namespace {

constexpr std::uint64_t kKiB = 1024;
constexpr std::uint64_t kMiB = 1024 * kKiB;
constexpr std::uint64_t kProgramBytes = 16 * kMiB;  // itself, its libraries, what it does at once
constexpr std::uint64_t kLinkBytes = 4 * kMiB;      // a node's tables and pools, frames
constexpr std::uint64_t kWritingBytes = 80 * kKiB;  // of one client: what is being written
constexpr std::uint64_t kReadingBytes = 80 * kKiB;  // and a frame that is being read
constexpr std::uint64_t kEndBytes = 512;            // a subscription or publisher
constexpr std::uint64_t kPlaceBytes = 40;           // for one message in a queue
constexpr std::uint64_t kKeptPlaces = 64;           // of each queue
constexpr std::uint64_t kMessageBytes = 300;        // a message beside its payload
constexpr std::uint64_t kBytesOfAMessage = 512;     // of queue_bytes, ClientOutput
constexpr std::uint64_t kPublicationBytes = 300;
constexpr std::uint64_t kTrackedBytes = 280;
constexpr std::uint64_t kRingHeaderBytes = 8 * kKiB;  // and what the kernel needs for a file

std::uint64_t client_bytes(const LimitsConfig& limits) {
  const std::uint64_t queued =
      limits.queue_bytes + limits.queue_bytes / kBytesOfAMessage * (kMessageBytes + kPlaceBytes);
  const std::uint64_t ends =
      limits.subscriptions_per_client * (kEndBytes + kKeptPlaces * kPlaceBytes) +
      limits.publishers_per_client * kEndBytes;
  return queued + ends + 2 * std::uint64_t{limits.reply_bytes} + kWritingBytes + kReadingBytes +
         2 * std::uint64_t{limits.socket_buffer_bytes};  // as the kernel counts
}

}  // namespace

std::uint64_t most_memory_bytes(const Config& config) {
  const LimitsConfig& limits = config.limits;
  const std::uint64_t waiting =
      limits.waiting_bytes + 2 * std::uint64_t{limits.waiting_messages} * kPublicationBytes;
  return kProgramBytes + config.links.size() * kLinkBytes + limits.clients * client_bytes(limits) +
         2 * limits.clients * kRingHeaderBytes + waiting + limits.tracked_senders * kTrackedBytes;
}

std::optional<std::string> memory_problem(const Config& config, std::uint64_t limit_bytes) {
  const std::uint64_t most = most_memory_bytes(config);
  if (most <= limit_bytes) return std::nullopt;
  return "clients may make this daemon need " + std::to_string(most / kMiB) +
         " MiB, more than the " + std::to_string(limit_bytes / kMiB) +
         " MiB that it may have (MemoryMax= of its unit); lower clients, queue_bytes or "
         "waiting_bytes under [limits], or raise MemoryMax=";
}

}  // namespace swarmtalk::daemon
