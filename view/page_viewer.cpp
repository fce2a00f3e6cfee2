#include "view/page_viewer.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "view/playback.hpp"
#include "view/swarm_json.hpp"

namespace swarmtalk::view {
namespace {

using Json = nlohmann::json;

enum StateKind : std::size_t { kState, kInfo, kCard, kDropped };

Outgoing text(std::string json) {
  return {std::make_shared<const std::string>(std::move(json)), false};
}

/// A channel as the page names it: text, or a number.
std::string channel_name(const Json& request) {
  const auto found = request.find("channel");
  if (found == request.end()) return {};
  if (found->is_number_unsigned()) return std::to_string(found->get<std::uint64_t>());
  return found->is_string() ? found->get<std::string>() : std::string();
}

/// Digits, with a sign or without, that are not the number of a channel.
bool is_no_channel(const std::string& name) {
  const std::size_t sign = name.starts_with('-') || name.starts_with('+') ? 1 : 0;
  return name.size() > sign && name.find_first_not_of("0123456789", sign) == std::string::npos &&
         !is_channel_number(name);
}

/// Requests of who looks at a recording. @return none: it is none of them; else as answer()
std::optional<std::string> move_time(Playback* playback, const Json& request) {
  const Json& op = request["op"];
  const bool is_move = op == "play" || op == "pause" || op == "seek" || op == "speed";
  if (!is_move) return std::nullopt;
  if (playback == nullptr) return "this is no recording: its time cannot be moved";
  const auto number = [&](const char* key) {
    const auto found = request.find(key);
    return found != request.end() && found->is_number() ? found->get<double>() : -1.0;
  };
  if (op == "seek" || op == "speed") {
    const double value = number(op == "seek" ? "at" : "times");
    if (!(value >= 0)) return "\"seek\" takes \"at\", milliseconds; \"speed\" takes \"times\"";
    if (op == "speed") {
      playback->set_speed(value);
    } else {
      const double most = static_cast<double>(playback->length().count());
      playback->seek(Playback::Milliseconds(static_cast<std::int64_t>(std::min(value, most))));
    }
  } else if (op == "play") {
    playback->play();
  } else {
    playback->pause();
  }
  return "";
}

}  // namespace

void PageViewer::begin() {
  tell(hello_json(source_, may_operate_));
  tell_lines();
}

void PageViewer::tell_lines() {
  for (const LogLine& line : source_.traffic().lines()) tell(line_json(line, source_.now()));
}

void PageViewer::on_jump() {
  tell(jump_json(source_));
  tell_recent_messages();
  tell_lines();
}

// As one event, so that the queue's limit never parts them from their jump.
void PageViewer::tell_recent_messages() {
  if (watched_ && source_.playback() != nullptr) {
    tell(messages_json(source_.recent_messages(*watched_)));
  }
}

void PageViewer::tell(std::string json) {
  queue.put_event(text(std::move(json)));
  wake();
}

void PageViewer::on_text(std::string_view bytes) {
  const std::string why = answer(bytes);
  if (!why.empty()) refuse(why);
}

void PageViewer::on_binary(std::string_view /*bytes*/) {
  refuse("requests are JSON texts, not binary");
}

void PageViewer::refuse(const std::string& why) {
  if (++bad_requests_ >= kMostBadRequests) return leave("too many bad requests; the last: " + why);
  tell(notice_json(why));
}

void PageViewer::unwatch() {
  if (opened_) source_.close_channel(*opened_);
  opened_.reset();
  watched_.reset();
}

std::string PageViewer::watch(const std::string& channel) {
  unwatch();
  const Status status = source_.open_channel(channel);
  if (!status) {
    return "channel " + channel.substr(0, 80) +
           " cannot be listened to: " + std::string(status.text());
  }
  opened_ = channel;
  watched_ = source_.number_of(channel);
  tell_recent_messages();
  return {};
}

/// @return why not; empty: done
std::string PageViewer::answer(std::string_view bytes) {
  const Json request = Json::parse(bytes, nullptr, false);
  if (!request.is_object()) return "a request is a JSON object with \"op\"";
  const auto op = request.find("op");
  if (op == request.end() || !op->is_string()) return "a request is a JSON object with \"op\"";
  if (*op == "unwatch") {
    unwatch();
    return {};
  }
  if (*op == "card") {
    const auto robot = request.find("robot");
    const bool is_good = robot != request.end() && robot->is_number_unsigned() &&
                         robot->get<std::uint64_t>() <= UINT16_MAX;
    if (!is_good) return "\"card\" takes \"robot\", a node id; 0: none";
    card_ = robot->get<std::uint32_t>();
    if (card_ != 0) source_.want_details(card_);
    return {};
  }
  const std::string channel = channel_name(request);
  if (is_no_channel(channel)) return "a channel is a name, or a number from 0 to 65535";
  if (*op == "watch") {
    if (channel.empty()) return "\"watch\" takes \"channel\", a name or a number";
    return watch(channel);
  }
  if (*op == "publish") {
    if (!may_operate_ && source_.playback() == nullptr) {
      return "this viewer only looks: start swarmtalk-view with --operate";
    }
    const auto payload = request.find("text");
    if (channel.empty() || payload == request.end() || !payload->is_string()) {
      return "\"publish\" takes \"channel\" and \"text\"";
    }
    const Status sent = source_.publish(channel, payload->get<std::string>());
    tell(notice_json(sent ? "sent on channel " + channel : std::string(sent.text())));
    return {};
  }
  if (const auto moved = move_time(source_.playback(), request)) return *moved;
  return "there is no request of that name";
}

void PageViewer::show(const Scene& scene) {
  if (opened_ && !watched_) watched_ = source_.number_of(*opened_);
  if (scene.state) queue.put_state(kState, {scene.state, false});
  if (!scene.info) return;
  queue.put_state(kInfo, {scene.info, false});
  if (card_ != 0) queue.put_state(kCard, text(card_json(source_.swarm(), card_, scene.now)));
  const std::uint64_t dropped = queue.events_dropped() + queue.states_replaced();
  if (dropped == told_dropped_) return;
  told_dropped_ = dropped;
  queue.put_state(kDropped, text(dropped_json(queue.events_dropped(), queue.states_replaced())));
}

void PageViewer::on_message(const HeardMessage& message) {
  if (watched_ == message.channel) tell(message_json(message));
}

void PageViewer::on_line(const LogLine& line) {
  tell(line_json(line, source_.now()));
}

}  // namespace swarmtalk::view
