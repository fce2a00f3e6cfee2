#include "cli/doctor/survey.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <fstream>
#include <memory>
#include <random>
#include <sstream>

#include "cli/common/deadline.hpp"
#include "cli/common/pong.hpp"

namespace swarmtalk::cli::doctor {
namespace {

constexpr const char* kHead =
    "time_unix_s,distance_m,asked,heard_there,answered,loss_there,loss_back,round_trip_ms,"
    "signal_dbm\n";
constexpr std::size_t kMostRounds = 3;  // that are still waited for

/// What was asked within one period, and what has come back of it.
struct Round {
  double time_unix_s = 0;
  std::uint32_t first = 0;  // sequence
  std::uint64_t asked = 0;
  std::uint64_t answered = 0;
  std::uint32_t heard_first = 0, heard_last = 0;  // its count, in the first and last answer
  std::uint32_t sequence_first = 0, sequence_last = 0;
  double round_trip_ms = 0;  // sum
  double distance_m = 0;     // sum
  std::uint64_t distances = 0;
  std::optional<int> signal_dbm;
};

double unix_now() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double>(now).count();
}

class Surveyor {
 public:
  Surveyor(Client& client, const SurveyArguments& arguments, std::ostream* file)
      : client_(client), arguments_(arguments), file_(file), run_(std::random_device{}()) {
    Channel channel = client.channel("ping");
    publisher_ = channel.publisher([](const Status&) {}, Sending::newest(4));
    subscriber_ = channel.subscriber([this](const Message& message) { hear(message); });
  }

  int run() {
    if (const Status status = publisher_.status(); !status) return fail(status);
    if (const Status status = subscriber_.status(); !status) return fail(status);
    int written = write(kHead);
    std::uint64_t lines = 0;
    while (written == kExitOk && caught_signal() == 0 && !is_enough(lines)) {
      ask_for_a_period();
      if (rounds_.size() == kMostRounds) {
        written = write(line_of(rounds_.front()));
        rounds_.pop_front();
        ++lines;
      }
    }
    // What was asked is told, also when a signal ended it.
    wait_until(Clock::now() + seconds(0.2));
    for (; written == kExitOk && !rounds_.empty() && !is_enough(lines); ++lines) {
      written = write(line_of(rounds_.front()));
      rounds_.pop_front();
    }
    if (written != kExitOk) return written;
    if (answered_ == 0) {
      return fail("robot " + std::to_string(arguments_.robot) +
                  " has not answered: it is out of reach, or `swarmtalk-cli ping --answer` does "
                  "not run there");
    }
    return caught_signal() == 0 ? kExitOk : kExitSignal + caught_signal();
  }

 private:
  bool is_enough(std::uint64_t lines) const {
    return arguments_.count != 0 && lines >= arguments_.count;
  }

  void ask_for_a_period() {
    Round& round = rounds_.emplace_back();
    round.time_unix_s = unix_now();
    round.first = static_cast<std::uint32_t>(asked_at_.size()) + 1;
    const auto end = after(Clock::now(), seconds(arguments_.period_s));
    auto next = Clock::now();
    while (caught_signal() == 0 && Clock::now() < end) {
      asked_at_.push_back(Clock::now());
      const Status status =
          publisher_.send("ping " + std::to_string(run_) + " " + std::to_string(asked_at_.size()) +
                              " " + std::to_string(arguments_.robot) + " 0",
                          0);
      // A question that was not taken is none.
      status ? static_cast<void>(++round.asked) : asked_at_.pop_back();
      next = after(next, seconds(1 / arguments_.rate_hz));
      wait_until(std::min(next, end));
    }
    std::vector<Neighbour> heard;
    if (!client_.get_neighbours(heard)) return;
    for (const Neighbour& each : heard) {
      if (each.node_id == arguments_.robot) rounds_.back().signal_dbm = each.signal_dbm;
    }
  }

  void wait_until(Clock::time_point end) {
    // At least once: a loop without a wait would never hear.
    do {
      client_.run_once(
          std::max<std::chrono::nanoseconds>(end - Clock::now(), std::chrono::milliseconds(1)));
    } while (caught_signal() == 0 && Clock::now() < end);
  }

  void hear(const Message& message) {
    const auto pong = read_pong(message.payload);
    if (!pong || pong->run != run_ || message.sender != arguments_.robot) return;
    if (pong->sequence == 0 || pong->sequence > asked_at_.size()) return;
    ++answered_;
    for (auto round = rounds_.rbegin(); round != rounds_.rend(); ++round) {
      if (pong->sequence < round->first) continue;
      add(*round, *pong, message);
      return;
    }
  }

  void add(Round& round, const Pong& pong, const Message& message) {
    if (round.answered++ == 0) {
      round.heard_first = pong.heard;
      round.sequence_first = pong.sequence;
    }
    round.heard_last = std::max(round.heard_last, pong.heard);
    round.sequence_last = std::max(round.sequence_last, pong.sequence);
    const auto came_at = message.received_at.value_or(Clock::now());
    round.round_trip_ms +=
        std::chrono::duration<double, std::milli>(came_at - asked_at_[pong.sequence - 1]).count();
    if (!std::isfinite(message.distance_m)) return;
    round.distance_m += static_cast<double>(message.distance_m);
    ++round.distances;
  }

  /// Its count tells what was heard there between two answers; what is outside is put down alike.
  static std::string line_of(const Round& round) {
    std::ostringstream line;
    line.setf(std::ios::fixed);
    line.precision(3);
    line << round.time_unix_s << ',';
    if (round.distances > 0) line << round.distance_m / static_cast<double>(round.distances);
    line << ',' << round.asked << ',';
    if (round.answered == 0) {
      line << ",0,,,,";
    } else {
      const double between = round.sequence_last - round.sequence_first + 1;
      const double heard = round.heard_last - round.heard_first + 1;
      const double share = std::min(1.0, heard / between);
      const double most = static_cast<double>(round.asked);
      const double there = std::max(std::round(share * most), static_cast<double>(round.answered));
      line << static_cast<std::uint64_t>(there) << ',' << round.answered << ','
           << 1 - std::min(1.0, there / most) << ','
           << 1 - static_cast<double>(round.answered) / there << ','
           << round.round_trip_ms / static_cast<double>(round.answered) << ',';
    }
    if (round.signal_dbm) line << *round.signal_dbm;
    line << '\n';
    return line.str();
  }

  int write(const std::string& text) {
    if (file_ == nullptr) return print(text);
    *file_ << text << std::flush;
    return file_->good() ? kExitOk : fail("cannot write " + arguments_.file);
  }

  Client& client_;
  const SurveyArguments& arguments_;
  std::ostream* file_;
  const std::uint32_t run_;
  std::vector<Clock::time_point> asked_at_;
  std::deque<Round> rounds_;
  std::uint64_t answered_ = 0;
  Publisher publisher_;
  Subscriber subscriber_;
};

}  // namespace

int survey(const Common& common, const SurveyArguments& arguments) {
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  if (arguments.robot == client.node_id()) {
    return fail("robot " + std::to_string(arguments.robot) + " is this one; name another",
                kExitUsage);
  }
  stop_on_signals(client);
  tell_connection(client);
  std::ofstream file;
  if (!arguments.file.empty()) {
    file.open(arguments.file);
    if (!file) return fail("cannot write " + arguments.file);
  }
  Surveyor surveyor(client, arguments, arguments.file.empty() ? nullptr : &file);
  return surveyor.run();
}

}  // namespace swarmtalk::cli::doctor
