#include "daemon/config/config_limits.hpp"

#include <algorithm>

#include "ipc/framing.hpp"

namespace swarmtalk::daemon {
namespace {

void read_shares(const TableReader& table, LimitsConfig& limits) {
  table.read_integer("clients_per_user", {1, 1000}, limits.clients_per_user);
  table.read_integer("operator_clients", {0, 1000}, limits.operator_clients);
  table.read_integer("channels_per_client", {1, 65'536}, limits.channels_per_client);
  table.read_integer("channels_per_user", {1, 65'536}, limits.channels_per_user);
  table.read_integer("subscriptions_per_user", {1, 1'000'000}, limits.subscriptions_per_user);
  table.read_integer("publishers_per_user", {1, 1'000'000}, limits.publishers_per_user);
  table.read_integer("waiting_messages_per_client", {1, 100'000},
                     limits.waiting_messages_per_client);
  table.read_integer("waiting_messages_per_user", {1, 100'000}, limits.waiting_messages_per_user);
  table.read_integer("waiting_bytes", {64 << 10, 1 << 30}, limits.waiting_bytes);
  table.read_integer("requests_per_client_hz", {0, 1'000'000}, limits.requests_per_client_hz);
  table.read_integer("requests_per_user_hz", {0, 1'000'000}, limits.requests_per_user_hz);
  table.read_integer("changes_per_user_hz", {0, 10'000}, limits.changes_per_user_hz);
  table.read_integer("changes_burst", {1, 10'000}, limits.changes_burst);
}

}  // namespace

void read_limits(const TableReader& table, LimitsConfig& limits) {
  table.expect_keys({"clients",
                     "clients_per_user",
                     "operator_clients",
                     "channels_per_client",
                     "channels_per_user",
                     "subscriptions_per_user",
                     "publishers_per_user",
                     "waiting_messages_per_client",
                     "waiting_messages_per_user",
                     "waiting_bytes",
                     "requests_per_client_hz",
                     "requests_per_user_hz",
                     "changes_per_user_hz",
                     "changes_burst",
                     "subscriptions_per_client",
                     "publishers_per_client",
                     "queue_messages",
                     "queue_messages_max",
                     "queue_bytes",
                     "reply_bytes",
                     "socket_buffer_bytes",
                     "waiting_messages",
                     "publish_queue_max",
                     "publish_rate_hz",
                     "publish_burst",
                     "copies_max",
                     "copy_interval_ms",
                     "tracked_senders"});
  table.read_integer("clients", {1, 1000}, limits.clients);
  read_shares(table, limits);
  table.read_integer("subscriptions_per_client", {1, 10'000}, limits.subscriptions_per_client);
  table.read_integer("publishers_per_client", {1, 10'000}, limits.publishers_per_client);
  table.read_integer("queue_messages_max", {1, 100'000}, limits.queue_messages_max);
  limits.queue_messages = std::min(limits.queue_messages, limits.queue_messages_max);
  table.read_integer("queue_messages", {1, limits.queue_messages_max}, limits.queue_messages);
  table.read_integer("queue_bytes", {64 << 10, 1 << 30}, limits.queue_bytes);
  table.read_integer("reply_bytes", {64 << 10, 64 << 20}, limits.reply_bytes);
  table.read_integer("socket_buffer_bytes", {4096, 16 << 20}, limits.socket_buffer_bytes);
  table.read_integer("waiting_messages", {1, 100'000}, limits.waiting_messages);
  table.read_integer("publish_queue_max", {0, 100'000}, limits.publish_queue_max);
  table.read_integer("publish_rate_hz", {0, 1'000'000}, limits.publish_rate_hz);
  table.read_integer("publish_burst", {1, 1'000'000}, limits.publish_burst);
  table.read_integer("copies_max", {1, 100}, limits.copies_max);
  table.read_integer("copy_interval_ms", {1, 10'000}, limits.copy_interval_ms);
  table.read_integer("tracked_senders", {1, 1'000'000}, limits.tracked_senders);
}

}  // namespace swarmtalk::daemon
