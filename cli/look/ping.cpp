// `swarmtalk-cli ping`: questions and answers are lines of text on the ordinary channel "ping"
// (docs/wire-format.md), so a robot that answers runs `ping --answer`, or any program of its own.
#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <optional>
#include <random>
#include <sstream>
#include <vector>

#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/common/looking.hpp"
#include "cli/text/format.hpp"
#include "cli/text/numbers.hpp"

namespace swarmtalk::cli {
namespace {

constexpr const char* kPingChannel = "ping";
constexpr std::size_t kMaxRuns = 64;  // that an answering robot counts questions of
constexpr std::size_t kMaxQuestions = 16;

/// The numbers behind the first word, if it is this one and all are there.
template <std::size_t kCount>
std::optional<std::array<std::uint32_t, kCount>> numbers_behind(const std::string& word,
                                                                std::string_view payload) {
  std::array<std::uint32_t, kCount> numbers{};
  if (!payload.starts_with(word)) return std::nullopt;
  payload.remove_prefix(word.size());
  for (std::uint32_t& number : numbers) {
    if (!payload.starts_with(' ')) return std::nullopt;
    payload.remove_prefix(1);
    const auto result = std::from_chars(payload.data(), payload.data() + payload.size(), number);
    if (result.ec != std::errc()) return std::nullopt;
    payload.remove_prefix(static_cast<std::size_t>(result.ptr - payload.data()));
  }
  return payload.empty() ? std::make_optional(numbers) : std::nullopt;
}

class Pinger {
 public:
  Pinger(const Common& common, const PingArguments& arguments, Client& client)
      : common_(common), arguments_(arguments), client_(client), run_(std::random_device{}()) {
    ChannelOptions options;
    options.ttl = arguments.ttl;
    Channel channel = client.channel(kPingChannel, options);
    publisher_ = channel.publisher([](const Status&) {}, Sending::newest(4));
    subscriber_ = channel.subscriber([this](const Message& message) { hear(message); });
  }
  Status status() const {
    Status publishing = publisher_.status();
    return publishing ? subscriber_.status() : publishing;
  }

  int run() {
    auto next = Clock::now();
    while (written_ == kExitOk && caught_signal() == 0 &&
           (arguments_.count == 0 || sent_ < arguments_.count)) {
      ++sent_;
      is_answered_ = false;
      asked_at_ = Clock::now();
      const Status status =
          publisher_.send("ping " + std::to_string(run_) + " " + std::to_string(sent_) + " " +
                          std::to_string(arguments_.robot) + " " + std::to_string(arguments_.ttl));
      if (!status && status.code() != StatusCode::kDisconnected) return fail(status);
      next = after(next, seconds(arguments_.period_s));
      const bool is_last = sent_ == arguments_.count;
      while (caught_signal() == 0 && Clock::now() < next && !(is_last && is_answered_)) {
        client_.run_once(next - Clock::now());
      }
      if (!is_answered_ && (caught_signal() == 0)) tell(nullptr, 0, {});
    }
    return end();
  }

 private:
  void hear(const Message& message) {
    const auto answer = numbers_behind<4>("pong", message.payload);
    if (!answer || (*answer)[0] != run_ || message.sender != arguments_.robot) return;
    heard_there_ = std::max<std::uint64_t>(heard_there_, (*answer)[2]);
    if ((*answer)[1] != sent_ || is_answered_) return;  // came late: it was told as lost
    is_answered_ = true;
    ++answered_;
    tell(&message, (*answer)[3], message.received_at.value_or(Clock::now()) - asked_at_);
  }

  void tell(const Message* answer, std::uint32_t hops_there, Clock::duration round_trip) {
    const double ms = std::chrono::duration<double, std::milli>(round_trip).count();
    Json json{{"robot", arguments_.robot},
              {"sequence", sent_},
              {"round_trip_ms", nullptr},
              {"hops_there", nullptr},
              {"hops_back", nullptr},
              {"distance_m", nullptr},
              {"sent", sent_},
              {"heard_there", heard_there_},
              {"answered", answered_}};
    std::string line = "robot " + std::to_string(arguments_.robot) + ": " + std::to_string(sent_) +
                       "  no answer within " + std::to_string(arguments_.period_s).substr(0, 4) +
                       " s";
    if (answer != nullptr) {
      json["round_trip_ms"] = number_of(ms);
      if (hops_there != Message::kHopsUnknown) json["hops_there"] = hops_there;
      if (answer->hops != Message::kHopsUnknown) json["hops_back"] = answer->hops;
      json["distance_m"] = cli::number(answer->distance_m);
      std::ostringstream text;
      text.precision(2);
      text << std::fixed << "robot " << arguments_.robot << ": " << sent_ << "  " << ms
           << " ms  hops there " << json["hops_there"] << " back " << json["hops_back"];
      line = text.str();
    }
    written_ = print((common_.is_json ? json.dump() : line) + "\n");
  }

  int end() {
    if (written_ != kExitOk) return written_;
    const std::uint64_t lost_back = heard_there_ > answered_ ? heard_there_ - answered_ : 0;
    if (!common_.is_json && sent_ > 0) {
      written_ = print(std::to_string(sent_) + " sent, " + std::to_string(answered_) +
                       " answered; lost on the way there " +
                       std::to_string(sent_ - std::min(sent_, heard_there_)) + ", back " +
                       std::to_string(lost_back) + "\n");
    }
    if (answered_ == 0 && caught_signal() == 0) {
      return fail("robot " + std::to_string(arguments_.robot) +
                  " has not answered: it is out of reach, or `swarmtalk-cli ping --answer` does "
                  "not run there");
    }
    return caught_signal() == 0 ? written_ : kExitSignal + caught_signal();
  }

  const Common& common_;
  const PingArguments& arguments_;
  Client& client_;
  const std::uint32_t run_;  // tells our answers from others'
  Publisher publisher_;
  Subscriber subscriber_;
  std::uint64_t sent_ = 0;
  std::uint64_t answered_ = 0;
  std::uint64_t heard_there_ = 0;
  bool is_answered_ = false;
  Clock::time_point asked_at_{};
  int written_ = kExitOk;
};

/// Answers questions for this robot until a signal.
int answer_pings(Client& client) {
  struct Question {
    std::array<std::uint32_t, 4> numbers;  // run, sequence, robot, TTL
    std::uint32_t sender, hops;
  };
  std::vector<Question> questions;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> heard;  // by sender and run
  Channel channel = client.channel(kPingChannel);
  Publisher publisher = channel.publisher([](const Status&) {}, Sending::newest(kMaxQuestions));
  if (const Status status = publisher.status(); !status) return fail(status);
  Subscriber subscriber = channel.subscriber([&](const Message& message) {
    const auto numbers = numbers_behind<4>("ping", message.payload);
    if (numbers && questions.size() < kMaxQuestions) {
      questions.push_back({*numbers, message.sender, message.hops});
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
      const Status status = publisher.send(
          "pong " + std::to_string(each.numbers[0]) + " " + std::to_string(each.numbers[1]) + " " +
              std::to_string(count) + " " + std::to_string(each.hops),
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
