// `swarmtalk-cli ping`: questions and answers are lines of text on the ordinary channel "ping"
// (docs/wire-format.md). Daemons that report answer by themselves; on other robots `ping --answer`
// does, or any program of their own.
#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <numeric>
#include <optional>
#include <random>
#include <sstream>
#include <vector>

#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/common/looking.hpp"
#include "cli/common/pong.hpp"
#include "cli/text/format.hpp"
#include "cli/text/numbers.hpp"

namespace swarmtalk::cli {
namespace {

constexpr const char* kPingChannel = "ping";
constexpr std::size_t kMaxRuns = 64;  // that an answering robot counts questions of
constexpr std::size_t kMaxQuestions = 16;

/// Run, sequence, robot and TTL of a question; none: it is something else.
std::optional<std::array<std::uint32_t, 4>> read_question(std::string_view payload) {
  constexpr std::string_view kWord = "ping";
  std::array<std::uint32_t, 4> numbers{};
  if (!payload.starts_with(kWord)) return std::nullopt;
  payload.remove_prefix(kWord.size());
  for (std::uint32_t& number : numbers) {
    if (!payload.starts_with(' ')) return std::nullopt;
    payload.remove_prefix(1);
    const auto result = std::from_chars(payload.data(), payload.data() + payload.size(), number);
    if (result.ec != std::errc()) return std::nullopt;
    payload.remove_prefix(static_cast<std::size_t>(result.ptr - payload.data()));
  }
  return payload.empty() ? std::make_optional(numbers) : std::nullopt;
}

/// What is known of one robot that is asked.
struct Asked {
  std::uint64_t answered = 0;
  std::vector<std::uint64_t> sent;             // sequence numbers of the questions
  std::uint64_t told_of = 0;                   // of those, up to the last that an answer tells of
  std::uint64_t heard_there = 0;               // ... and of these, those that were heard there
  bool is_answered = false;                    // the last question
  std::uint32_t via = 0;                       // from whom it has its last question; 0: not known
  std::uint32_t hops = Message::kHopsUnknown;  // that its last question had behind it

  void take(const Pong& pong) {
    const auto end = std::upper_bound(sent.begin(), sent.end(), pong.sequence);
    told_of = std::max(told_of, static_cast<std::uint64_t>(end - sent.begin()));
    heard_there = std::max<std::uint64_t>(heard_there, pong.heard);
    hops = pong.hops;
  }
  std::vector<double> round_trips_ms;
};

class Pinger {
 public:
  static constexpr std::size_t kMostHops = 16;

  Pinger(const Common& common, const PingArguments& arguments, Client& client)
      : common_(common), arguments_(arguments), client_(client), run_(std::random_device{}()) {
    ChannelOptions options;
    options.ttl = arguments.ttl;
    Channel channel = client.channel(kPingChannel, options);
    publisher_ = channel.publisher([](const Status&) {}, Sending::newest(kMostHops));
    subscriber_ = channel.subscriber([this](const Message& message) { hear(message); });
  }
  Status status() const {
    Status publishing = publisher_.status();
    return publishing ? subscriber_.status() : publishing;
  }

  int run() {
    auto next = Clock::now();
    while (written_ == kExitOk && caught_signal() == 0 &&
           (arguments_.count == 0 || sequence_ < arguments_.count)) {
      ++sequence_;
      asked_at_ = Clock::now();
      round_ = path();
      for (const std::uint32_t robot : round_) {
        if (const Status status = ask(robot); !status) return fail(status);
      }
      next = after(next, seconds(arguments_.period_s));
      const bool is_last = sequence_ == arguments_.count;
      while (caught_signal() == 0 && Clock::now() < next && !(is_last && is_round_answered())) {
        client_.run_once(next - Clock::now());
      }
      if (!asked_[arguments_.robot].is_answered && (caught_signal() == 0)) tell(nullptr, 0, {});
    }
    return end();
  }

 private:
  /// The robots that are asked, the nearest first: the one that is meant, and with --by-hop those
  /// from whom it and they have heard our questions.
  std::vector<std::uint32_t> path() {
    std::vector<std::uint32_t> robots{arguments_.robot};
    while (arguments_.is_by_hop && robots.size() < kMostHops) {
      const std::uint32_t via = asked_[robots.back()].via;
      const bool is_end = via == 0 || via == client_.node_id() ||
                          std::find(robots.begin(), robots.end(), via) != robots.end();
      if (is_end) break;
      robots.push_back(via);
    }
    std::reverse(robots.begin(), robots.end());
    return robots;
  }

  Status ask(std::uint32_t robot) {
    Asked& asked = asked_[robot];
    asked.sent.push_back(sequence_);
    asked.is_answered = false;
    const Status status =
        publisher_.send("ping " + std::to_string(run_) + " " + std::to_string(sequence_) + " " +
                        std::to_string(robot) + " " + std::to_string(arguments_.ttl));
    return status.code() == StatusCode::kDisconnected ? Status() : status;
  }

  bool is_round_answered() {
    return std::all_of(round_.begin(), round_.end(),
                       [this](std::uint32_t robot) { return asked_[robot].is_answered; });
  }

  void hear(const Message& message) {
    const auto pong = read_pong(message.payload);
    const auto found = asked_.find(message.sender);
    if (!pong || pong->run != run_ || found == asked_.end()) return;
    Asked& asked = found->second;
    asked.take(*pong);
    if (pong->sequence != sequence_ || asked.is_answered) return;  // came late: it was told as lost
    asked.is_answered = true;
    asked.via = pong->via;
    ++asked.answered;
    const auto round_trip = message.received_at.value_or(Clock::now()) - asked_at_;
    asked.round_trips_ms.push_back(std::chrono::duration<double, std::milli>(round_trip).count());
    if (message.sender == arguments_.robot) tell(&message, pong->hops, round_trip);
  }

  /// For people.
  static std::string way(std::uint32_t hops) {
    if (hops == Message::kHopsUnknown) return "by a way that is not known";
    if (hops == 0) return "directly";
    return "over " + std::to_string(hops) + (hops == 1 ? " robot" : " robots");
  }

  static Json number_of_hops(std::uint32_t hops) {
    return hops == Message::kHopsUnknown ? Json() : Json(hops);
  }

  Json hops_json() {
    Json hops = Json::array();
    if (!arguments_.is_by_hop) return hops;
    for (const std::uint32_t robot : path()) {
      const Asked& asked = asked_[robot];
      const auto ms = median(asked.round_trips_ms);
      hops.push_back({{"robot", robot},
                      {"hops_there", number_of_hops(asked.hops)},
                      {"sent", asked.sent.size()},
                      {"told_of", asked.told_of},
                      {"heard_there", asked.heard_there},
                      {"answered", asked.answered},
                      {"median_ms", ms ? number_of(*ms) : Json()}});
    }
    return hops;
  }

  void tell(const Message* answer, std::uint32_t hops_there, Clock::duration round_trip) {
    const double ms = std::chrono::duration<double, std::milli>(round_trip).count();
    const Asked& asked = asked_[arguments_.robot];
    Json json{{"robot", arguments_.robot},
              {"sequence", sequence_},
              {"round_trip_ms", nullptr},
              {"hops_there", nullptr},
              {"hops_back", nullptr},
              {"distance_m", nullptr},
              {"sent", asked.sent.size()},
              {"told_of", asked.told_of},
              {"heard_there", asked.heard_there},
              {"answered", asked.answered},
              {"hops", hops_json()}};
    std::string line = "robot " + std::to_string(arguments_.robot) + ": " +
                       std::to_string(sequence_) + "  no answer within " +
                       std::to_string(arguments_.period_s).substr(0, 4) + " s";
    if (answer != nullptr) {
      json["round_trip_ms"] = number_of(ms);
      json["hops_there"] = number_of_hops(hops_there);
      if (answer->hops != Message::kHopsUnknown) json["hops_back"] = answer->hops;
      json["distance_m"] = cli::number(answer->distance_m);
      std::ostringstream text;
      text.precision(2);
      text << std::fixed << "robot " << arguments_.robot << ": " << sequence_ << "  " << ms
           << " ms  there " << way(hops_there) << ", back " << way(answer->hops);
      line = text.str();
    }
    written_ = print((common_.is_json ? json.dump() : line) + "\n");
  }

  // Only an answer tells what was heard there: of questions since the last one nobody knows.
  static std::string counts(const Asked& asked) {
    const std::uint64_t back =
        asked.heard_there > asked.answered ? asked.heard_there - asked.answered : 0;
    const std::uint64_t there = asked.told_of - std::min(asked.told_of, asked.heard_there);
    const std::uint64_t sent = asked.sent.size();
    const std::uint64_t lost = sent - std::min(sent, asked.answered);
    std::ostringstream share;  // three digits, so that one of many is not none
    share.precision(3);
    share << 100.0 * static_cast<double>(lost) / static_cast<double>(sent);
    std::string text = std::to_string(sent) + " sent, " + std::to_string(asked.answered) +
                       " answered, " + share.str() + " % lost";
    if (lost == 0) return text;
    text += ": " + std::to_string(there) + " on the way there, " + std::to_string(back) + " back";
    if (asked.told_of < sent)
      text += ", " + std::to_string(sent - asked.told_of) + " unknown where";
    return text;
  }

  /// As ping of other systems ends; empty: nothing has been answered.
  static std::string round_trips(const Asked& asked) {
    if (asked.round_trips_ms.empty()) return "";
    const auto [least, most] =
        std::minmax_element(asked.round_trips_ms.begin(), asked.round_trips_ms.end());
    const double sum =
        std::accumulate(asked.round_trips_ms.begin(), asked.round_trips_ms.end(), 0.0);
    std::ostringstream text;
    text.precision(2);
    text << std::fixed << "round trip min/avg/max " << *least << "/"
         << sum / static_cast<double>(asked.round_trips_ms.size()) << "/" << *most << " ms\n";
    return text.str();
  }

  int end() {
    if (written_ != kExitOk) return written_;
    const Asked& asked = asked_[arguments_.robot];
    if (!common_.is_json && sequence_ > 0) {
      std::string text;
      for (const std::uint32_t robot : path()) {
        if (!arguments_.is_by_hop) break;
        if (asked_[robot].sent.empty()) continue;  // found with the last answer
        std::ostringstream line;
        line.precision(2);
        line << std::fixed << "robot " << robot << ": " << way(asked_[robot].hops) << "  ";
        if (const auto ms = median(asked_[robot].round_trips_ms)) line << *ms << " ms  ";
        text += line.str() + counts(asked_[robot]) + "\n";
      }
      written_ = print(arguments_.is_by_hop ? text : counts(asked) + "\n" + round_trips(asked));
    }
    if (asked.answered == 0 && caught_signal() == 0 && !client_.is_connected()) {
      return fail("robot " + std::to_string(arguments_.robot) +
                      " could not be asked any more: this robot's swarmtalkd is gone",
                  kExitNoDaemon);
    }
    if (asked.answered == 0 && caught_signal() == 0) {
      return fail("robot " + std::to_string(arguments_.robot) +
                  " has not answered: it is out of reach, or neither `report = true` under "
                  "[reserved] nor `swarmtalk-cli ping --answer` is on there");
    }
    return caught_signal() == 0 ? written_ : kExitSignal + caught_signal();
  }

  const Common& common_;
  const PingArguments& arguments_;
  Client& client_;
  const std::uint32_t run_;  // tells our answers from others'
  Publisher publisher_;
  Subscriber subscriber_;
  std::map<std::uint32_t, Asked> asked_;  // by robot
  std::vector<std::uint32_t> round_;      // asked with this sequence number
  std::uint64_t sequence_ = 0;
  Clock::time_point asked_at_{};
  int written_ = kExitOk;
};

/// Answers questions for this robot until a signal.
int answer_pings(Client& client) {
  struct Question {
    std::array<std::uint32_t, 4> numbers;  // run, sequence, robot, TTL
    std::uint32_t sender, hops, via;
  };
  std::vector<Question> questions;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> heard;  // by sender and run
  Channel channel = client.channel(kPingChannel);
  Publisher publisher = channel.publisher([](const Status&) {}, Sending::newest(kMaxQuestions));
  if (const Status status = publisher.status(); !status) return fail(status);
  Subscriber subscriber = channel.subscriber([&](const Message& message) {
    const auto numbers = read_question(message.payload);
    if (numbers && questions.size() < kMaxQuestions) {
      questions.push_back({*numbers, message.sender, message.hops, message.transmitter});
    }
  });
  if (const Status status = subscriber.status(); !status) return fail(status);
  while (caught_signal() == 0) {
    client.run_once(std::chrono::hours(1));
    DaemonStatus daemon;
    if (questions.empty() || !client.get_status(daemon)) continue;  // an automatic id may change
    for (const Question& each : questions) {
      if (each.numbers[2] != daemon.node_id) continue;
      const std::pair key(each.sender, each.numbers[0]);
      if (heard.size() >= kMaxRuns && !heard.contains(key)) heard.clear();
      const std::uint32_t count = ++heard[key];
      const Status status =
          publisher.send("pong " + std::to_string(each.numbers[0]) + " " +
                             std::to_string(each.numbers[1]) + " " + std::to_string(count) + " " +
                             std::to_string(each.hops) + " " + std::to_string(each.via),
                         std::min<std::uint32_t>(each.numbers[3], 255));
      if (!status && status.code() != StatusCode::kDisconnected) fail(status);
    }
    questions.clear();
  }
  return kExitSignal + caught_signal();
}

}  // namespace

int ping(const Common& common, const PingArguments& arguments) {
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  stop_on_signals(client);
  tell_connection(client);
  if (arguments.answers) return answer_pings(client);
  if (arguments.robot == client.node_id()) {
    return fail("robot " + std::to_string(arguments.robot) + " is this one; ping another",
                kExitUsage);
  }
  Pinger pinger(common, arguments, client);
  if (const Status status = pinger.status(); !status) return fail(status);
  return pinger.run();
}

}  // namespace swarmtalk::cli
