#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/common/link_watch.hpp"
#include "cli/common/looking.hpp"
#include "cli/common/quiet_watch.hpp"
#include "cli/text/format.hpp"
#include "cli/text/numbers.hpp"

namespace swarmtalk::cli {
namespace {

/// Times between one sender's messages on one channel, within a report.
struct Intervals {
  std::uint64_t messages = 0;
  double least_s = 0;
  double most_s = 0;
  double sum_s = 0;
  double sum_of_squares = 0;
  std::uint64_t count = 0;
  Clock::time_point last{};

  void add(Clock::time_point time) {
    ++messages;
    if (last != Clock::time_point()) {
      const double interval_s = std::chrono::duration<double>(time - last).count();
      least_s = count == 0 ? interval_s : std::min(least_s, interval_s);
      most_s = std::max(most_s, interval_s);
      sum_s += interval_s;
      sum_of_squares += interval_s * interval_s;
      ++count;
    }
    last = time;
  }
  /// For the next report; the last message stays the one before.
  void begin_again() {
    const auto before = last;
    *this = Intervals();
    last = before;
  }
  double mean_s() const { return sum_s / static_cast<double>(count); }
  double deviation_s() const {
    return std::sqrt(
        std::max(0.0, sum_of_squares / static_cast<double>(count) - mean_s() * mean_s()));
  }
};

using Senders = std::map<std::pair<std::string, std::uint32_t>, Intervals>;

Json sender_json(const std::string& channel, std::uint32_t sender, const Intervals& seen,
                 double period_s) {
  Json json{{"channel", channel},
            {"sender", sender},
            {"messages", seen.messages},
            {"rate_hz", number_of(static_cast<double>(seen.messages) / period_s)},
            {"interval_mean_s", nullptr},
            {"interval_least_s", nullptr},
            {"interval_most_s", nullptr},
            {"interval_deviation_s", nullptr}};
  if (seen.count == 0) return json;
  json["interval_mean_s"] = number_of(seen.mean_s());
  json["interval_least_s"] = number_of(seen.least_s);
  json["interval_most_s"] = number_of(seen.most_s);
  json["interval_deviation_s"] = number_of(seen.deviation_s());
  return json;
}

std::string sender_text(const std::string& channel, std::uint32_t sender, const Intervals& seen,
                        double period_s) {
  char text[160];
  std::snprintf(text, sizeof text, ": robot %u  %.2f Hz", sender,
                static_cast<double>(seen.messages) / period_s);
  std::string line = channel + text;
  if (seen.count > 0) {
    std::snprintf(text, sizeof text, "  every %.3f s (%.3f to %.3f, deviation %.3f)", seen.mean_s(),
                  seen.least_s, seen.most_s, seen.deviation_s());
    line += text;
  }
  return line + "\n";
}

int report(const Common& common, Senders& senders, Loss& lost, double period_s) {
  int written = kExitOk;
  if (common.is_json) {
    Json list = Json::array();
    for (const auto& [key, seen] : senders) {
      list.push_back(sender_json(key.first, key.second, seen, period_s));
    }
    written = print(
        Json{{"seconds", number_of(period_s)}, {"senders", list}, {"lost", to_json(lost)}}.dump() +
        "\n");
  } else {
    std::string text;
    for (const auto& [key, seen] : senders)
      text += sender_text(key.first, key.second, seen, period_s);
    if (senders.empty()) text = "nothing heard\n";
    if (lost) text += "lost " + loss_text(lost) + "\n";
    written = print(text);
  }
  // A sender that was silent for a whole report is told once, with 0 Hz, and then forgotten.
  std::erase_if(senders, [](const auto& each) { return each.second.messages == 0; });
  for (auto& [key, seen] : senders) seen.begin_again();
  lost = {};
  return written;
}

}  // namespace

int hz(const Common& common, const HzArguments& arguments) {
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  stop_on_signals(client);
  Status lost_daemon;
  client.on_disconnect([&](const Status& status) { lost_daemon = status; });
  Senders senders;
  Loss lost;
  std::vector<Subscriber> subscribers;
  QuietWatch quiet(client, arguments.channels);
  for (const std::string& channel : arguments.channels) {
    const auto receive = [&, channel](const Message& message) {
      lost += message.lost_before;
      quiet.heard(channel);
      senders[{channel, message.sender}].add(message.received_at.value_or(Clock::now()));
    };
    Subscriber subscriber = open_channel(client, channel, {}).subscriber(receive);
    if (const Status status = subscriber.status(); !status) return fail(status);
    if (is_new(subscriber, subscribers)) subscribers.push_back(std::move(subscriber));
  }
  LinkWatch links(client);
  int written = kExitOk;
  auto begin = Clock::now();
  for (std::uint64_t i = 0; written == kExitOk && (arguments.count == 0 || i < arguments.count);
       ++i) {
    const auto end = after(begin, seconds(arguments.seconds));
    while (caught_signal() == 0 && Clock::now() < end) {
      links.look();
      if (links.has_told()) quiet.stop();
      quiet.look();
      client.run_once(std::min({end, links.next(), quiet.next()}) - Clock::now());
      if (!lost_daemon) return fail(lost_daemon);  // what comes later is no rate any more
    }
    if (caught_signal() != 0) return kExitSignal + caught_signal();
    const auto now = Clock::now();
    written = report(common, senders, lost, std::chrono::duration<double>(now - begin).count());
    begin = now;
  }
  return written;
}

}  // namespace swarmtalk::cli
