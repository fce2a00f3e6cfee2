#include "tests/virtual/check/judge.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace swarmtalk::test {
namespace {

/// Whose count of messages: robot, channel, and the run of its daemon.
using Source = std::tuple<std::uint32_t, int, std::uint32_t>;

/// So many missing messages are believed at once, however slow their sender was (decision 0062).
constexpr std::uint32_t kBelieved = 16;
constexpr std::chrono::milliseconds kKeysApart(100);  // nearer to a change of keys it is not judged
constexpr std::chrono::seconds kLongestHeld(5);       // a frame that is not proven (0053)
constexpr std::uint64_t kMissingOfHeard = 9;          // for each that was heard, the same decision

class Judge {
 public:
  Judge(const Story& story, const Record& record) : story_(story), record_(record) {}

  Verdict run() {
    for (const std::string& each : record_.broken) break_promise(Promise::kAlive, each);
    find_flushes();
    for (const Hearing& each : record_.hearings) look_at(each);
    look_for_twice();
    for (const Publishing& each : record_.publishings) {
      if (!each.has_callback) continue;
      decide(Promise::kAnswered);
      if (each.answered > each.accepted || (each.is_open && each.answered < each.accepted)) {
        break_promise(Promise::kAnswered, where(each.robot, each.program, each.channel) + " sent " +
                                              std::to_string(each.accepted) + " and was answered " +
                                              std::to_string(each.answered));
      }
    }
    look_for_last_words();
    for (const Account& each : record_.accounts) look_at(each);
    for (const Leftovers& each : record_.leftovers) look_at(each);
    for (const Use& each : record_.uses) look_at(each);
    return std::move(verdict_);
  }

 private:
  using Time = std::chrono::steady_clock::time_point;
  struct Window {
    Time begin{};
    Time end{};
  };
  struct Span {
    bool has_begun = false;
    bool is_sure = true;  // else the daemon may have heard another first, which the queue dropped
    std::uint32_t first = 0;  // in time, since then
    std::uint32_t last = 0;
    std::set<std::uint32_t> numbers;
  };
  struct Told {
    std::uint64_t lost = 0;
    std::uint64_t late = 0;
    std::uint64_t late_and_older = 0;  // than the subscription: lost, perhaps, before it
  };

  static bool is_older(const HeardMessage& heard, const Hearing& hearing) {
    return heard.sent < static_cast<int>(hearing.sent_before);
  }

  /// A source is followed from the first message on that was sent since the subscription began:
  /// those before may have come before it. Others that came may have higher numbers all the same.
  static void note(const HeardMessage& heard, const Hearing& hearing,
                   std::map<Source, Span>& spans) {
    const Source source{heard.sender, hearing.channel, heard.epoch};
    Span& span = spans[source];
    if (!is_older(heard, hearing) && !std::exchange(span.has_begun, true)) {
      span.first = heard.number;
      span.is_sure = !hearing.is_spared || heard.lost == 0;
    }
    span.last = std::max(span.last, heard.number);
    span.numbers.insert(heard.number);
  }

  /// Of the numbers since the first that was heard.
  static std::uint64_t missing_in(const Span& span) {
    const auto heard = std::distance(span.numbers.lower_bound(span.first), span.numbers.end());
    return span.last - span.first + 1 - static_cast<std::uint64_t>(heard);
  }

  /// Whether all that is missing is believed, whatever its sender's pace.
  static bool is_believed(const Span& span) {
    if (!span.has_begun || !span.is_sure) return false;
    std::uint32_t before = span.first;
    std::uint32_t longest = span.last - *span.numbers.rbegin();
    for (auto at = span.numbers.lower_bound(span.first); at != span.numbers.end(); ++at) {
      longest = std::max(longest, *at == span.first ? 0 : *at - before - 1);
      before = *at;
    }
    return longest <= kBelieved && missing_in(span) <= kMissingOfHeard * span.numbers.size();
  }

  static std::string where(int robot, int program, int channel) {
    return "robot " + std::to_string(robot) + " program " + std::to_string(program) + " channel " +
           std::to_string(channel);
  }
  static std::string where(const Hearing& hearing) {
    return where(hearing.robot, hearing.program, hearing.channel);
  }
  void decide(Promise promise) { ++verdict_.decided[static_cast<std::size_t>(promise)]; }
  void break_promise(Promise promise, const std::string& text) {
    verdict_.violations.push_back({promise, text});
  }
  int key_of(int robot) const { return story_.robots[static_cast<std::size_t>(robot - 1)].key; }

  /// Whether its hearer had a key that its sender, heard directly, had at no time since send().
  bool is_beyond_keys(const SentMessage& sent, const HeardMessage& heard,
                      const Hearing& hearing) const {
    if (heard.is_local || heard.hops > 0 || !heard.received_at) return false;
    const auto received = *heard.received_at;
    for (const Strike& strike : record_.strikes) {  // what comes meanwhile is opened later
      const bool stands_still = strike.kind == Kind::kStall && strike.robot == hearing.robot &&
                                received >= strike.begin && received <= strike.end;
      if (stands_still) return false;
    }
    int key = key_of(hearing.robot);
    std::set<int> senders{key_of(sent.robot)};
    for (const KeyChange& change : record_.key_changes) {  // in the order of time
      const bool is_near = change.at > received - kKeysApart && change.at < received + kKeysApart;
      if (change.robot == hearing.robot && is_near) return false;
      if (change.robot == hearing.robot && change.at < received) key = change.key;
      if (change.robot != sent.robot || change.at > received) continue;
      if (change.at < sent.at) senders.clear();
      senders.insert(change.key);
    }
    return !senders.contains(key);
  }

  /// Where each source stood when it flushed.
  void find_flushes() {
    for (const Hearing& hearing : record_.hearings) {
      for (const HeardMessage& heard : hearing.heard) {
        if (heard.number == 0) continue;
        if (heard.sent < 0 || !record_.sent[static_cast<std::size_t>(heard.sent)].is_flush)
          continue;
        const Source source{heard.sender, hearing.channel, heard.epoch};
        auto& before = last_before_flush_.emplace(source, heard.number - 1).first->second;
        before = std::min(before, heard.number - 1);
      }
    }
  }

  void look_at(const Hearing& hearing) {
    std::map<Source, Span> spans;
    Told told;
    for (const HeardMessage& heard : hearing.heard) {
      told.lost += heard.lost;
      told.late += heard.late;
      if (is_older(heard, hearing)) told.late_and_older += heard.late;
      decide(Promise::kGenuine);
      if (heard.sent < 0) {
        break_promise(Promise::kGenuine, where(hearing) + " heard what nobody sent: " + heard.text);
        continue;
      }
      const SentMessage& sent = record_.sent[static_cast<std::size_t>(heard.sent)];
      const bool is_own = sent.robot == hearing.robot;
      const bool is_of_former_run = is_own && sent.run < hearing.run;  // others sent it on
      if (sent.channel != hearing.channel || static_cast<int>(heard.sender) != sent.robot ||
          heard.hops > sent.ttl || heard.is_local != (is_own && !is_of_former_run) ||
          (heard.is_local && sent.process == hearing.process)) {
        break_promise(Promise::kGenuine, where(hearing) + " heard '" + heard.text + "' with hops " +
                                             std::to_string(heard.hops) + " of " +
                                             std::to_string(sent.ttl));
      }
      decide(Promise::kKeysPart);
      if (key_of(sent.robot) != key_of(hearing.robot) || is_beyond_keys(sent, heard, hearing)) {
        break_promise(Promise::kKeysPart, where(hearing) + " heard '" + heard.text +
                                              "', which is sealed with another key");
      }
      if (!heard.is_local && !record_.same_after_restart.contains(sent.robot)) {
        note(heard, hearing, spans);
      }
    }
    look_at_losses(hearing, spans, told);
    look_at_beacons(hearing);
    look_at_order(hearing);
  }

  /// Each message that did not come is told, and no other.
  void look_at_losses(const Hearing& hearing, const std::map<Source, Span>& spans,
                      const Told& told) {
    if (hearing.heard.empty()) return;
    std::uint64_t least = 0;
    for (const auto& [source, span] : spans) {
      if (is_believed(span)) least += missing_in(span);
    }
    std::set<int> heard;
    for (const HeardMessage& each : hearing.heard) heard.insert(each.sent);
    std::uint64_t most = 0;
    for (std::size_t i = 0; i < record_.sent.size(); ++i) {
      const SentMessage& sent = record_.sent[i];
      const bool is_to_itself = sent.process == hearing.process && sent.run == hearing.run;
      if (sent.channel == hearing.channel && !is_to_itself &&
          !heard.contains(static_cast<int>(i))) {
        ++most;
      }
    }
    for (const Publishing& each : record_.publishings) {
      if (each.channel == hearing.channel && each.robot != hearing.robot) {
        most -= std::min(most, each.unsent);
      }
    }
    decide(Promise::kTold);
    const std::uint64_t gone = told.lost - std::min(told.lost, told.late);
    if (gone + told.late_and_older < least || gone > most) {
      break_promise(Promise::kTold, where(hearing) + " run " + std::to_string(hearing.run) +
                                        " was told of " + std::to_string(told.lost) + " lost and " +
                                        std::to_string(told.late) + " late; missing are " +
                                        std::to_string(least) + " to " + std::to_string(most));
    }
  }

  /// What was lost of a neighbour without a later message is told by its beacons alone.
  void look_at_beacons(const Hearing& hearing) {
    if (!hearing.is_open) return;
    std::map<Source, Span> spans;  // until this robot's own first message after the troubles
    std::uint64_t told = 0;
    for (const HeardMessage& heard : hearing.heard) {
      told += heard.lost - (is_older(heard, hearing) ? 0 : std::min(heard.lost, heard.late));
      if (heard.sent < 0) return;
      const SentMessage& sent = record_.sent[static_cast<std::size_t>(heard.sent)];
      if (heard.is_local) {
        if (sent.is_flush) break;
        continue;
      }
      if (!record_.same_after_restart.contains(sent.robot)) note(heard, hearing, spans);
    }
    const std::vector<int> distance = distances_to(hearing.robot);
    std::uint64_t least = 0;
    for (auto& [source, span] : spans) {
      const auto before_flush = last_before_flush_.find(source);
      const bool is_near = distance[std::get<0>(source)] == 1;
      if (is_near && before_flush != last_before_flush_.end()) {
        span.last = std::max(span.last, before_flush->second);
      }
      if (!is_believed(span)) continue;
      least += missing_in(span);
      if (missing_in(span) > 0) decide(Promise::kTold);
    }
    if (told >= least) return;
    break_promise(Promise::kTold, where(hearing) + " was told of " + std::to_string(told) +
                                      " lost by beacons; missing are " + std::to_string(least));
  }

  /// While what comes to this hearer may overtake other messages: by the air, or since what it
  /// cannot prove yet waits with it.
  std::vector<Window> overtaking(const Hearing& hearing) const {
    std::vector<Window> windows;
    for (const Strike& strike : record_.strikes) {
      const bool begins_anew = strike.kind == Kind::kStop || strike.kind == Kind::kOtherKey;
      Milliseconds after{};
      if (strike.kind == Kind::kDelay) {
        after = kLongestDelay;
      } else if (strike.kind == Kind::kAgain) {
        after = kLongestAgain;
      } else if (begins_anew && strike.robot == hearing.robot && key_of(hearing.robot) != 0) {
        after = kLongestHeld;
      } else {
        continue;
      }
      windows.push_back({strike.begin, strike.end + after});
    }
    return windows;
  }

  /// What a robot says to its neighbours, in one packet each time, comes in the order of sending.
  void look_at_order(const Hearing& hearing) {
    const std::vector<Window> windows = overtaking(hearing);
    const auto may_overtake = [&](const HeardMessage& heard) {
      if (!heard.received_at) return !heard.is_local;  // its clock was set: nobody knows when
      return std::any_of(windows.begin(), windows.end(), [&](const Window& each) {
        return *heard.received_at >= each.begin && *heard.received_at <= each.end;
      });
    };
    std::map<int, int> last;  // by process, of TTL 0
    for (const HeardMessage& heard : hearing.heard) {
      if (heard.sent < 0 || may_overtake(heard)) continue;
      const SentMessage& sent = record_.sent[static_cast<std::size_t>(heard.sent)];
      const auto& plan = story_.robots[static_cast<std::size_t>(sent.robot - 1)].programs;
      if (sent.ttl != 0 || sent.program >= static_cast<int>(plan.size())) continue;
      const ProgramPlan& sender = plan[static_cast<std::size_t>(sent.program)];
      if (sender.redundancy > 0 || sender.copies > 1) continue;
      int& before = last.emplace(sent.process, -1).first->second;
      decide(Promise::kInOrder);
      if (heard.sent < before) {
        break_promise(Promise::kInOrder, where(hearing) + " heard '" + heard.text + "' late");
      }
      before = std::max(before, heard.sent);
    }
  }

  /// Of one message a program hears one, while its robot's daemon runs.
  void look_for_twice() {
    std::set<std::tuple<int, int, int, int, int>> heard;
    for (const Hearing& hearing : record_.hearings) {
      for (const HeardMessage& each : hearing.heard) {
        if (each.sent < 0) continue;
        decide(Promise::kOnce);
        if (!heard.emplace(hearing.robot, hearing.program, hearing.channel, hearing.run, each.sent)
                 .second) {
          break_promise(Promise::kOnce, where(hearing) + " heard '" + each.text + "' twice");
        }
      }
    }
  }

  /// Transmissions that it takes from each robot to this one, among those that share its key.
  std::vector<int> distances_to(int robot) const {
    const auto count = static_cast<int>(story_.robots.size());
    std::vector<int> distance(static_cast<std::size_t>(count) + 1, INT32_MAX);
    std::vector<int> next{robot};
    distance[static_cast<std::size_t>(robot)] = 0;
    for (std::size_t i = 0; i < next.size(); ++i) {
      const Place a = story_.robots[static_cast<std::size_t>(next[i] - 1)].place;
      for (int n = 1; n <= count; ++n) {
        const Place b = story_.robots[static_cast<std::size_t>(n - 1)].place;
        if (distance[static_cast<std::size_t>(n)] != INT32_MAX || key_of(n) != key_of(robot) ||
            std::hypot(a.x_m - b.x_m, a.y_m - b.y_m) > story_.range_m) {
          continue;
        }
        distance[static_cast<std::size_t>(n)] = distance[static_cast<std::size_t>(next[i])] + 1;
        next.push_back(n);
      }
    }
    return distance;
  }

  /// When all is repaired, everybody in reach hears what is sent.
  void look_for_last_words() {
    for (const Hearing& hearing : record_.hearings) {
      if (!hearing.is_open || hearing.is_spared) continue;
      const std::vector<int> distance = distances_to(hearing.robot);
      std::set<int> heard;
      for (const HeardMessage& each : hearing.heard) heard.insert(each.sent);
      for (std::size_t i = 0; i < record_.sent.size(); ++i) {
        const SentMessage& sent = record_.sent[i];
        if (!sent.is_final || sent.channel != hearing.channel ||
            (sent.robot == hearing.robot && sent.program == hearing.program)) {
          continue;
        }
        const int way = distance[static_cast<std::size_t>(sent.robot)];
        const bool is_due = way <= static_cast<int>(sent.ttl) + 1;
        decide(Promise::kRepaired);
        const bool is_recognised = !record_.same_after_restart.contains(sent.robot);
        if (heard.contains(static_cast<int>(i)) == is_due || (is_due && !is_recognised)) continue;
        break_promise(Promise::kRepaired,
                      where(hearing) + (is_due ? " has not heard" : " has heard") + " message " +
                          std::to_string(i) + " of robot " + std::to_string(sent.robot) + ", " +
                          std::to_string(way) + " hops away, ttl " + std::to_string(sent.ttl));
      }
    }
  }

  void look_at(const Account& account) {
    decide(Promise::kAddUp);
    if (account.deliveries != account.deliveries_ended) {
      break_promise(Promise::kAddUp, "robot " + std::to_string(account.robot) + " queued " +
                                         std::to_string(account.deliveries) + " deliveries, and " +
                                         std::to_string(account.deliveries_ended) + " ended");
    }
    if (key_of(account.robot) != 0 && account.taken > account.different) {
      break_promise(Promise::kGenuine, "robot " + std::to_string(account.robot) + " has taken " +
                                           std::to_string(account.taken) + " sealed frames of " +
                                           std::to_string(account.different));
    }
    if (account.told_sent == account.sent && account.told_heard == account.heard) return;
    break_promise(Promise::kAddUp, "robot " + std::to_string(account.robot) + " counts " +
                                       std::to_string(account.told_sent) + " frames sent and " +
                                       std::to_string(account.told_heard) + " heard; there were " +
                                       std::to_string(account.sent) + " and " +
                                       std::to_string(account.heard));
  }

  /// Nothing waits for ever, and of programs that have ended nothing is left.
  void look_at(const Leftovers& left) {
    std::uint64_t publishers = kChannels;  // those of the program that flushes
    std::uint64_t subscriptions = 0;
    for (const ProgramPlan& each :
         story_.robots[static_cast<std::size_t>(left.robot - 1)].programs) {
      publishers += each.sends.size();
      subscriptions += each.hears.size();
    }
    decide(Promise::kAlive);
    if (left.waiting_messages == 0 && left.publishers == publishers &&
        left.subscriptions == subscriptions && left.channel_publishers == publishers &&
        left.channel_subscriptions == subscriptions) {
      return;
    }
    break_promise(
        Promise::kAlive,
        "robot " + std::to_string(left.robot) + " has " + std::to_string(left.waiting_messages) +
            " messages waiting, " + std::to_string(left.publishers) + " publishers (by channels " +
            std::to_string(left.channel_publishers) + ") and " +
            std::to_string(left.subscriptions) + " (" + std::to_string(left.channel_subscriptions) +
            ") subscriptions; " + std::to_string(publishers) + " and " +
            std::to_string(subscriptions) + " there are");
  }

  void look_at(const Use& use) {
    if (use.used >= use.limit / 2) decide(Promise::kWithin);
    if (use.used <= use.limit) return;
    break_promise(Promise::kWithin, "robot " + std::to_string(use.robot) + " holds " +
                                        std::to_string(use.used) + " " + use.what + " of " +
                                        std::to_string(use.limit));
  }

  const Story& story_;
  const Record& record_;
  std::map<Source, std::uint32_t> last_before_flush_;
  Verdict verdict_;
};

}  // namespace

const char* name_of(Promise promise) {
  static constexpr std::array<const char*, kPromises> kNames{
      "genuine",  "once",      "in-order", "told",  "answered",
      "repaired", "keys-part", "add-up",   "alive", "within"};
  return kNames.at(static_cast<std::size_t>(promise));
}

Verdict judge(const Story& story, const Record& record) {
  return Judge(story, record).run();
}

}  // namespace swarmtalk::test
