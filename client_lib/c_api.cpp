// The C interface (swarmtalk.h) over the C++ one. No exception leaves it.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <new>
#include <string>
#include <swarmtalk/client.hpp>
#include <utility>

#include "client_lib/c_api.hpp"
#include "client_lib/unread.hpp"

using swarmtalk::Client;
using swarmtalk::Message;
using swarmtalk::Publisher;
using swarmtalk::Status;
using swarmtalk::StatusCode;
using swarmtalk::Subscriber;
using swarmtalk::c_api::as_ours;
using swarmtalk::c_api::code_of;
using swarmtalk::c_api::guarded;

struct swarmtalk_publisher {
  Publisher publisher;
  std::shared_ptr<swarmtalk::c_api::LastError> error;  // of its client, which may be gone
  bool expects_busy = false;
};
struct swarmtalk_subscriber {
  Subscriber subscriber;
};

namespace {

static_assert(int{SWARMTALK_BUSY} == static_cast<int>(StatusCode::kBusy));
static_assert(int{SWARMTALK_SYSTEM} == static_cast<int>(StatusCode::kSystem));
static_assert(int{SWARMTALK_RATE} == static_cast<int>(StatusCode::kRate));
static_assert(int{SWARMTALK_LINK_DOWN} == static_cast<int>(StatusCode::kLinkDown),
              "the C codes follow StatusCode, in its order");

swarmtalk_message c_message(const Message& message) {
  swarmtalk_message to{};
  to.payload = reinterpret_cast<const std::uint8_t*>(message.payload.data());
  to.payload_bytes = message.payload.size();
  to.channel = message.channel;
  to.sender = message.sender;
  to.epoch = message.epoch;
  to.message_number = message.message_number;
  to.distance_m = message.distance_m;
  to.bearing_rad = message.bearing_rad;
  to.hops = message.hops;
  to.ttl = message.ttl;
  to.buffering_delay_us = message.buffering_delay ? message.buffering_delay->count() : -1;
  to.received_at_ns = -1;
  if (message.received_at) {
    to.received_at_ns = std::chrono::nanoseconds(message.received_at->time_since_epoch()).count();
  }
  to.local = message.local ? 1 : 0;
  const swarmtalk::Loss& lost = message.lost_before;
  to.lost_before = {lost.air, lost.kernel, lost.daemon, lost.client, lost.late};
  to.transmitter = message.transmitter;
  return to;
}

// As release 0.1 has them: a member that is added later stands after these, and these lines stay.
constexpr std::size_t kFirstPolicyBytes = offsetof(swarmtalk_policy, timestamped) + sizeof(int);
constexpr std::size_t kFirstSendingBytes =
    offsetof(swarmtalk_sending, redundancy) + sizeof(std::uint32_t);

swarmtalk::Policy cpp_policy(const swarmtalk_policy& from) {
  swarmtalk::Policy policy;
  if (from.keep_last != 0) policy.keep_last = from.keep_last;
  if (from.max_distance_m != 0) policy.max_distance_m = from.max_distance_m;  // also NaN: refused
  if (from.max_age_ms != 0) policy.max_age = std::chrono::milliseconds(from.max_age_ms);
  policy.drop_unknown_distance = from.drop_unknown_distance != 0;
  policy.latest_of_each = from.latest_from_each != 0;
  return policy;
}

swarmtalk::Sending cpp_sending(const swarmtalk_sending& from) {
  swarmtalk::Sending sending;
  if (from.queue != 0) sending.queue = from.queue;
  if (from.queue == SWARMTALK_NO_QUEUE) sending.queue = 0;
  sending.drop_oldest = from.drop_oldest != 0;
  sending.redundancy = from.redundancy;
  if (from.copies != 0) sending.copies = from.copies;
  if (from.copy_interval_ms != 0) {
    sending.copy_interval = std::chrono::milliseconds(from.copy_interval_ms);
  }
  return sending;
}

/// A word of digits is a number.
swarmtalk::Channel channel_of(Client& client, const char* word,
                              const swarmtalk::ChannelOptions& options) {
  const std::string name = word == nullptr ? "" : word;
  const bool is_number = !name.empty() && name.size() <= 9 &&
                         std::all_of(name.begin(), name.end(),
                                     [](char digit) { return digit >= '0' && digit <= '9'; });
  return is_number ? client.channel(std::stoi(name), options) : client.channel(name, options);
}

std::function<void(const Status&)> c_event(swarmtalk_event_fn callback, void* context) {
  if (callback == nullptr) return {};
  return [callback, context](const Status& status) {
    callback(code_of(status), std::string(status.text()).c_str(), context);
  };
}

/// What keeps it from being set is in swarmtalk_error(): these calls answer nothing.
template <typename Call>
void set_callback(swarmtalk_client* client, Call call) {
  static_cast<void>(guarded(client, [&](Client& robot) {
    call(robot);
    return Status();
  }));
}

}  // namespace

extern "C" {

swarmtalk_client* swarmtalk_open(const char* name, const char* socket_path) {
  try {
    swarmtalk::ClientOptions options;
    if (socket_path != nullptr) options.socket_path = socket_path;
    return new swarmtalk_client{Client(name == nullptr ? "" : name, options)};
  } catch (const std::exception&) {
    return nullptr;
  }
}

void swarmtalk_close(swarmtalk_client* client) {
  delete client;
}

swarmtalk_status swarmtalk_connect(swarmtalk_client* client) {
  return guarded(client, [](Client& robot) { return robot.connect(); });
}

const char* swarmtalk_error(const swarmtalk_client* client) {
  return client->error->text();
}

const char* swarmtalk_status_text(swarmtalk_status status) {
  if (status < SWARMTALK_OK || status > SWARMTALK_SYSTEM) return "unknown status";
  return Status(static_cast<StatusCode>(status)).text().data();  // literals, ended with a zero
}

swarmtalk_subscriber* swarmtalk_subscribe(swarmtalk_client* client, const char* channel,
                                          const swarmtalk_policy* policy,
                                          swarmtalk_receive_fn receive, void* context) {
  client->error->belong_here();
  try {
    const auto chosen = as_ours(policy, kFirstPolicyBytes, "swarmtalk_policy");
    swarmtalk::ChannelOptions options;
    if (chosen.timestamped != 0) options.timestamped = true;
    swarmtalk::ReceiveCallback callback;
    if (receive != nullptr) {
      callback = [receive, context](const Message& message) {
        const swarmtalk_message to = c_message(message);
        receive(&to, context);
      };
    }
    auto made = std::make_unique<swarmtalk_subscriber>();
    made->subscriber = channel_of(client->client, channel, options)
                           .subscriber(std::move(callback), cpp_policy(chosen));
    if (const Status status = made->subscriber.status(); !status)
      client->error->keep(status.text());
    return made.release();
  } catch (const std::exception& error) {
    client->error->keep(error.what());
    return nullptr;
  }
}

swarmtalk_status swarmtalk_subscriber_status(const swarmtalk_subscriber* subscriber) {
  if (subscriber == nullptr) return SWARMTALK_BAD_ARGUMENT;
  return code_of(subscriber->subscriber.status());
}

void swarmtalk_unsubscribe(swarmtalk_subscriber* subscriber) {
  delete subscriber;
}

swarmtalk_publisher* swarmtalk_advertise(swarmtalk_client* client, const char* channel,
                                         const swarmtalk_sending* sending, swarmtalk_sent_fn sent,
                                         void* context) {
  client->error->belong_here();
  try {
    const auto chosen = as_ours(sending, kFirstSendingBytes, "swarmtalk_sending");
    swarmtalk::ChannelOptions options;
    if (chosen.ttl != 0) options.ttl = chosen.ttl;
    if (chosen.timestamped != 0) options.timestamped = true;
    auto made = std::make_unique<swarmtalk_publisher>();
    made->error = client->error;
    made->expects_busy = chosen.queue == SWARMTALK_NO_QUEUE;
    made->publisher = channel_of(client->client, channel, options)
                          .publisher(c_event(sent, context), cpp_sending(chosen));
    if (const Status status = made->publisher.status(); !status) client->error->keep(status.text());
    return made.release();
  } catch (const std::exception& error) {
    client->error->keep(error.what());
    return nullptr;
  }
}

swarmtalk_status swarmtalk_publisher_status(const swarmtalk_publisher* publisher) {
  if (publisher == nullptr) return SWARMTALK_BAD_ARGUMENT;
  return code_of(publisher->publisher.status());
}

swarmtalk_status swarmtalk_send(swarmtalk_publisher* publisher, const void* bytes,
                                size_t size_bytes) {
  if (publisher == nullptr) return SWARMTALK_BAD_ARGUMENT;
  const bool keeps_error = publisher->error->belongs_here();
  try {
    const Status status =
        bytes == nullptr && size_bytes > 0
            ? Status(StatusCode::kBadArgument,
                     "the bytes to send are NULL, and not " + std::to_string(size_bytes))
            : publisher->publisher.send(
                  std::string_view(static_cast<const char*>(bytes), size_bytes));
    const swarmtalk_status code = code_of(status);
    if (!status && keeps_error) publisher->error->keep(status.text());
    // Whether a C program looks at an enumerator cannot be seen: it is told in any case.
    if (!publisher->expects_busy) swarmtalk::client::Unread::tell_anyway(status);
    return code;
  } catch (const std::exception& error) {
    if (keeps_error) publisher->error->keep(error.what());
    return SWARMTALK_SYSTEM;
  }
}

int swarmtalk_is_busy(const swarmtalk_publisher* publisher) {
  if (publisher == nullptr) return 1;
  try {
    return publisher->publisher.busy() ? 1 : 0;
  } catch (const std::exception&) {
    return 1;  // swarmtalk_send() says why
  }
}

size_t swarmtalk_max_message_bytes(const swarmtalk_publisher* publisher) {
  return publisher == nullptr ? 0 : publisher->publisher.max_message_bytes();
}

void swarmtalk_unadvertise(swarmtalk_publisher* publisher) {
  delete publisher;
}

swarmtalk_status swarmtalk_set_pose(swarmtalk_client* client, float x_m, float y_m,
                                    float theta_rad) {
  return guarded(client, [&](Client& robot) { return robot.set_pose(x_m, y_m, theta_rad); });
}

swarmtalk_status swarmtalk_log(swarmtalk_client* client, const char* line) {
  return guarded(client, [&](Client& robot) {
    return line == nullptr ? Status(StatusCode::kBadArgument, "the line is NULL") : robot.log(line);
  });
}

uint32_t swarmtalk_node_id(const swarmtalk_client* client) {
  return client->client.node_id();
}

int swarmtalk_fd(const swarmtalk_client* client) {
  return client->client.fd();
}

swarmtalk_status swarmtalk_process(swarmtalk_client* client) {
  return guarded(client, [](Client& robot) { return robot.process(); });
}

swarmtalk_status swarmtalk_run(swarmtalk_client* client) {
  return guarded(client, [](Client& robot) { return robot.run(); });
}

swarmtalk_status swarmtalk_run_for(swarmtalk_client* client, uint32_t time_ms) {
  return guarded(client,
                 [&](Client& robot) { return robot.run_for(std::chrono::milliseconds(time_ms)); });
}

void swarmtalk_stop(swarmtalk_client* client) {
  client->client.stop();
}

void swarmtalk_on_disconnect(swarmtalk_client* client, swarmtalk_event_fn callback, void* context) {
  set_callback(client, [&](Client& robot) { robot.on_disconnect(c_event(callback, context)); });
}

void swarmtalk_on_reconnect(swarmtalk_client* client, swarmtalk_event_fn callback, void* context) {
  set_callback(client, [&](Client& robot) {
    if (callback == nullptr) return robot.on_reconnect({});
    robot.on_reconnect([callback, context] { callback(SWARMTALK_OK, "ok", context); });
  });
}

void swarmtalk_on_error(swarmtalk_client* client, swarmtalk_event_fn callback, void* context) {
  set_callback(client, [&](Client& robot) { robot.on_error(c_event(callback, context)); });
}

void swarmtalk_on_gap(swarmtalk_client* client, swarmtalk_gap_fn callback, void* context) {
  set_callback(client, [&](Client& robot) {
    if (callback == nullptr) return robot.on_gap({});
    robot.on_gap([callback, context](const Message& message) {
      const swarmtalk_message to = c_message(message);
      callback(&to, context);
    });
  });
}

}  // extern "C"
