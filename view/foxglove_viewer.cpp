#include "view/foxglove_viewer.hpp"

#include <sodium/utils.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "text/counted.hpp"
#include "view/scene/foxglove_scene.hpp"

namespace swarmtalk::view {
namespace {

using Json = nlohmann::json;

constexpr char kMessageData = 1;  // opcodes of the protocol
constexpr char kTime = 2;
constexpr std::size_t kTimePlace = FoxgloveViewer::kMostSubscriptions;  // in the queue
constexpr int kWarning = 1;                                             // levels of a status
constexpr int kError = 2;

template <typename Unsigned>
void append_little_endian(std::string& bytes, Unsigned value) {
  for (std::size_t i = 0; i < sizeof(Unsigned); ++i) {
    bytes.push_back(static_cast<char>(value >> (8 * i) & 0xFF));
  }
}

Outgoing message_data(std::uint32_t subscription, std::uint64_t wall_ns,
                      const std::string& payload) {
  std::string bytes(1, kMessageData);
  append_little_endian(bytes, subscription);
  append_little_endian(bytes, wall_ns);
  bytes += payload;
  return {std::make_shared<const std::string>(std::move(bytes)), true};
}

Outgoing time_data(std::uint64_t wall_ns) {
  std::string bytes(1, kTime);
  append_little_endian(bytes, wall_ns);
  return {std::make_shared<const std::string>(std::move(bytes)), true};
}

std::string base64(const std::string& bytes) {
  constexpr int kVariant = sodium_base64_VARIANT_ORIGINAL;
  std::string text(sodium_base64_encoded_len(bytes.size(), kVariant), '\0');
  sodium_bin2base64(text.data(), text.size(), reinterpret_cast<const std::uint8_t*>(bytes.data()),
                    bytes.size(), kVariant);
  text.pop_back();  // its zero
  return text;
}

std::string status_json(int level, const std::string& text) {
  return Json{{"op", "status"}, {"level", level}, {"message", text}}.dump(
      -1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

void FoxgloveViewer::begin() {
  // A recording has a time of its own, which the viewer takes for the present.
  Json capabilities = Json::array();
  if (source_.playback() != nullptr) capabilities.push_back("time");
  tell(Json{{"op", "serverInfo"},
            {"name", "swarmtalk-view"},
            {"capabilities", capabilities},
            {"metadata", Json::object()}}
           .dump());
  Json channels = Json::array();
  for (std::size_t i = 0; i < kTopics; ++i) {
    const TopicDescription& each = topics()[i];
    channels.push_back({{"id", i + 1},
                        {"topic", each.topic},
                        {"encoding", "protobuf"},
                        {"schemaName", each.schema},
                        {"schemaEncoding", "protobuf"},
                        {"schema", base64(each.descriptor)}});
  }
  tell(Json{{"op", "advertise"}, {"channels", channels}}.dump());
}

void FoxgloveViewer::tell(std::string json) {
  queue.put_event({std::make_shared<const std::string>(std::move(json)), false});
  wake();
}

void FoxgloveViewer::refuse(const std::string& why) {
  if (++bad_requests_ >= kMostBadRequests) return leave("too many bad requests; the last: " + why);
  tell(status_json(kError, why));
}

void FoxgloveViewer::on_binary(std::string_view /*bytes*/) {
  refuse("swarmtalk-view only shows: it takes no messages of a client");
}

void FoxgloveViewer::on_text(std::string_view text) {
  const std::string why = answer(text);
  if (!why.empty()) refuse(why);
}

std::string FoxgloveViewer::answer(std::string_view text) {
  const Json request = Json::parse(text, nullptr, false);
  if (!request.is_object() || !request.contains("op")) return "a request is a JSON object with op";
  const Json& op = request["op"];
  const auto list = [&](const char* name) {
    const auto found = request.find(name);
    return found != request.end() && found->is_array() ? *found : Json();
  };
  if (op == "subscribe") {
    for (const Json& each : list("subscriptions")) {
      const Json id = each.is_object() ? each.value("id", Json()) : Json();
      const Json channel = each.is_object() ? each.value("channelId", Json()) : Json();
      if (!id.is_number_unsigned() || !channel.is_number_unsigned()) {
        return "a subscription has id and channelId";
      }
      const std::string why = subscribe(id.get<std::uint64_t>(), channel.get<std::uint64_t>());
      if (!why.empty()) return why;
    }
    return {};
  }
  if (op == "unsubscribe") {
    for (const Json& each : list("subscriptionIds")) {
      for (auto& held : subscriptions_) {
        if (held && each == held->id) held.reset();
      }
    }
    return {};
  }
  return "swarmtalk-view only shows: it takes subscribe and unsubscribe";
}

std::string FoxgloveViewer::subscribe(std::uint64_t id, std::uint64_t channel) {
  if (channel < 1 || channel > kTopics || id > UINT32_MAX) return "there is no such channel";
  const auto is_same = [&](const auto& held) { return held && held->id == id; };
  if (std::any_of(subscriptions_.begin(), subscriptions_.end(), is_same)) {
    return "this subscription id is in use";
  }
  const auto free = std::find(subscriptions_.begin(), subscriptions_.end(), std::nullopt);
  if (free == subscriptions_.end()) {
    return "at most " + std::to_string(kMostSubscriptions) + " subscriptions are open at a time";
  }
  *free = Subscription{static_cast<std::uint32_t>(id), static_cast<std::size_t>(channel - 1)};
  if (static_cast<Topic>(channel - 1) == Topic::kLog) {
    for (const LogLine& line : source_.traffic().lines()) tell_line((*free)->id, line);
  }
  return {};
}

bool FoxgloveViewer::wants_pictures() const {
  return std::any_of(subscriptions_.begin(), subscriptions_.end(),
                     [](const auto& held) { return held && held->topic < kStateTopics; });
}

// Each subscription has a place of its own in the queue, so that a large topic never crowds out a
// small one.
void FoxgloveViewer::show(const Scene& scene) {
  if (source_.playback() != nullptr) queue.put_state(kTimePlace, time_data(scene.wall_ns));
  for (std::size_t i = 0; i < subscriptions_.size(); ++i) {
    if (!subscriptions_[i]) continue;
    const auto& picture = scene.pictures[subscriptions_[i]->topic];
    if (picture) queue.put_state(i, message_data(subscriptions_[i]->id, scene.wall_ns, *picture));
  }
  if (scene.info) tell_left_out();
  if (!scene.info || queue.events_dropped() == told_dropped_) return;
  told_dropped_ = queue.events_dropped();
  tell(status_json(kWarning, text::counted(told_dropped_, "log line was", "log lines were") +
                                 " dropped: this viewer reads too slowly"));
}

// Each once, until it is heard again.
void FoxgloveViewer::tell_left_out() {
  const LeftOut& left_out = source_.left_out();
  if (left_out == told_left_out_) return;
  for (const auto& [channel, why] : left_out) {
    if (told_left_out_.contains(channel)) continue;
    tell(status_json(kWarning, "channel " + channel + " is left out: " + why));
  }
  told_left_out_ = left_out;
}

void FoxgloveViewer::on_line(const LogLine& line) {
  for (const auto& held : subscriptions_) {
    if (held && static_cast<Topic>(held->topic) == Topic::kLog) tell_line(held->id, line);
  }
}

void FoxgloveViewer::tell_line(std::uint32_t subscription, const LogLine& line) {
  const auto age = std::chrono::duration_cast<std::chrono::nanoseconds>(source_.now() - line.at);
  const std::uint64_t at_ns = source_.wall_ns() - static_cast<std::uint64_t>(age.count());
  queue.put_event(message_data(subscription, at_ns, encode_log(line, at_ns)));
  wake();
}

// The time goes back: viewers forget by themselves what is later.
void FoxgloveViewer::on_jump() {
  if (source_.playback() != nullptr) queue.put_state(kTimePlace, time_data(source_.wall_ns()));
  wake();
}

}  // namespace swarmtalk::view
