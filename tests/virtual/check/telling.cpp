#include "tests/virtual/check/telling.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>

#include "ipc/ipc.pb.h"
#include "loop/clock.hpp"
#include "tests/support/turned_clock.hpp"
#include "tests/virtual/check/actor.hpp"
#include "tests/virtual/key_file.hpp"
#include "tests/virtual/swarm.hpp"

namespace swarmtalk::test {
namespace {

using namespace std::chrono_literals;

constexpr auto kSettling = 12s;      // neighbours, keys, and what waits to be sent on
constexpr auto kLongestWait = 600s;  // many packets at five frames a second
constexpr int kSharedKeys = 2;
/// Of a robot with little memory. Last words and what flushes have room in it.
const std::string kLittle =
    "[limits]\nwaiting_messages = 24\nwaiting_messages_per_user = 20\n"
    "queue_bytes = 65536\nreply_bytes = 65536\n"
    "socket_buffer_bytes = 4096\n";
constexpr std::uint64_t kLittleBytes = 65536;
/// What a daemon has taken out of a program's queues to write, with its last message, and answers.
constexpr std::uint64_t kWritingBytes = 65536 + 16384;
constexpr std::array<int, 4> kRefusals{ENOBUFS, ENETDOWN, EPERM, EMSGSIZE};

/// The whole of it, and its course.
class Telling {
 public:
  explicit Telling(const Story& story) : story_(story), swarm_(story.seed) {
    swarm_.air().set_range(story.range_m);
    for (int key = 1; key <= kSharedKeys + robots(); ++key) {
      keys_.push_back(std::make_unique<KeyFile>(static_cast<std::uint32_t>(key)));
    }
    for (int n = 1; n <= robots(); ++n) {
      const RobotPlan& plan = plan_of(n);
      states_.push_back({plan.beacon_ms, plan.key, 1});
      swarm_.add(n, plan.place, configuration_of(n));
    }
    for (int n = 1; n <= robots(); ++n) {
      for (int p = 0; p < static_cast<int>(plan_of(n).programs.size()); ++p) start_program(n, p);
    }
  }

  Record run() {
    struct Action {
      Milliseconds at{};
      const Event* event = nullptr;
      bool begins = true;
    };
    std::vector<Action> actions;
    for (const Event& event : story_.events) {
      actions.push_back({event.at, &event, true});
      if (event.kind == Kind::kSend) continue;
      actions.push_back({std::min(event.at + event.lasts, story_.troubles), &event, false});
    }
    std::stable_sort(actions.begin(), actions.end(),
                     [](const Action& a, const Action& b) { return a.at < b.at; });
    const auto begin = loop::now();
    for (const Action& action : actions) {
      if (begin + action.at > loop::now()) swarm_.advance(begin + action.at - loop::now());
      if (action.begins) {
        if (action.event->kind != Kind::kSend) {
          strikes_[action.event] = record_.strikes.size();
          record_.strikes.push_back({action.event->kind, action.event->robot, loop::now(), {}});
        }
        strike(*action.event);
      } else {
        repair(*action.event);
        record_.strikes[strikes_.at(action.event)].end = loop::now();
      }
    }
    settle();
    for (const auto& [name, each] : actors_) each->look_for_connection();
    flush();
    say_last_words();
    flush();
    look();
    record_.course = swarm_.course();
    record_.same_after_restart = swarm_.air().same_after_restart();
    record_.seconds = std::chrono::duration<double>(loop::now() - begin).count();
    for (const auto& [name, each] : actors_) each->leave(true);
    return std::move(record_);
  }

 private:
  struct State {
    int beacon_ms = 0;
    int key = 0;
    int run = 1;
    bool owes_reload = false;
  };
  using Name = std::pair<int, int>;  // robot and program

  int robots() const { return static_cast<int>(story_.robots.size()); }
  const RobotPlan& plan_of(int robot) const {
    return story_.robots[static_cast<std::size_t>(robot - 1)];
  }
  State& state_of(int robot) { return states_[static_cast<std::size_t>(robot - 1)]; }
  static std::string name_of_program(int program) { return "p" + std::to_string(program); }

  std::string configuration_of(int robot) {
    const State& state = state_of(robot);
    std::string text = "beacon_ms = " + std::to_string(state.beacon_ms) + "\n";
    if (const int rate_hz = plan_of(robot).rate_hz; rate_hz > 0) {
      text += "rate_hz = " + std::to_string(rate_hz) + "\n";
    }
    if (state.key != 0) {
      text += "key_file = \"" + keys_[static_cast<std::size_t>(state.key - 1)]->path() + "\"\n";
    }
    if (plan_of(robot).has_little) text += kLittle;
    return text;
  }

  Actor* actor(int robot, int program) {
    const auto found = actors_.find({robot, program});
    return found == actors_.end() ? nullptr : found->second.get();
  }

  void start_program(int robot, int program) {
    const auto& programs = plan_of(robot).programs;
    actors_[{robot, program}] = std::make_unique<Actor>(
        swarm_.robot(robot).program(name_of_program(program)), Actor::Place{robot, program},
        programs[static_cast<std::size_t>(program)], record_, known_, state_of(robot).run);
  }

  void send(int robot, int program, int channel, std::uint32_t ttl, std::size_t bytes,
            bool is_final = false) {
    Actor* const sender = actor(robot, program);
    if (sender == nullptr || sender->is_paused) return;
    const int index = static_cast<int>(record_.sent.size());
    std::string text = std::to_string(robot) + "." + std::to_string(program) + "." +
                       Actor::channel_name(channel) + " " + std::to_string(index) + " ";
    if (text.size() < bytes) text.resize(bytes, static_cast<char>('a' + index % 26));
    known_[text] = index;  // before it is sent: it may be heard at once
    record_.sent.push_back({robot, program, channel, state_of(robot).run, sender->process(), ttl,
                            is_final, program == kFlush, loop::now()});
    if (sender->send(channel, text, ttl)) return;
    known_.erase(text);
    record_.sent.pop_back();
  }

  void reload(int robot) {
    if (!swarm_.robot(robot).machine().is_running()) {
      state_of(robot).owes_reload = true;  // the signal waits
      return;
    }
    swarm_.robot(robot).configure(configuration_of(robot));
    record_.key_changes.push_back({robot, loop::now(), state_of(robot).key});
    if (!swarm_.robot(robot).has_started()) return;
    ipc::Reloaded reply;
    if (const auto refusal = swarm_.robot(robot).parts().operations().reload("a test", reply)) {
      record_.broken.push_back("a reload was refused: " + refusal->text);
    }
  }

  void struck(const Event& event, std::uint64_t times = 1) {
    record_.struck[static_cast<std::size_t>(event.kind)] += times;
  }

  void strike(const Event& event) {
    VirtualRobot* const robot = event.robot == 0 ? nullptr : &swarm_.robot(event.robot);
    const std::string program = name_of_program(event.program);
    switch (event.kind) {
      case Kind::kSend:
        struck(event);
        for (int i = 0; i < event.count; ++i) {
          send(event.robot, event.program, event.channel, event.ttl, event.bytes);
        }
        if (event.count > 1) look_at_uses(event.robot);
        return;
      case Kind::kLoss:
        swarm_.air().set_loss(event.share);
        break;
      case Kind::kTwice:
        swarm_.air().set_duplicates(event.share);
        break;
      case Kind::kAgain:
        swarm_.air().set_duplicates(event.share, kLongestAgain);
        break;
      case Kind::kDelay:
        swarm_.air().set_delays(event.share, kLongestDelay);
        break;
      case Kind::kPieces:
        swarm_.cut_streams(static_cast<std::size_t>(event.count), event.share);
        break;
      case Kind::kLinkDown:
        swarm_.air().set_link(event.robot, false);
        break;
      case Kind::kAway:
        swarm_.air().put(event.robot, {1e6 * event.robot, 0});
        break;
      case Kind::kBusy:
        swarm_.air().set_busy(event.robot, true);
        break;
      case Kind::kStop:
        robot->stop();
        break;
      case Kind::kEnd:
        if (actors_.erase({event.robot, event.program}) == 0) return;
        robot->end_program(program);
        break;
      case Kind::kKill:
        if (actor(event.robot, event.program) == nullptr) return;
        robot->kill_program(program);
        actors_.erase({event.robot, event.program});
        break;
      case Kind::kPause:
        if (Actor* const paused = actor(event.robot, event.program)) {
          paused->is_paused = true;
          robot->program(program).set_running(false);
          break;
        }
        return;
      case Kind::kReload:
        state_of(event.robot).beacon_ms = 20 * event.count + 100;
        reload(event.robot);
        break;
      case Kind::kOtherKey:
        state_of(event.robot).key = kSharedKeys + event.robot;  // nobody else has that
        reload(event.robot);
        break;
      case Kind::kClock:
        robot->step_wall_clock(std::chrono::seconds(event.count));
        break;
      case Kind::kRefuse:
        swarm_.air().set_refusing(
            event.robot, kRefusals.at(static_cast<std::size_t>(event.count) % kRefusals.size()));
        break;
      case Kind::kStall:
        robot->set_running(false);
        break;
    }
    struck(event);
  }

  void repair(const Event& event) {
    const RobotPlan* const plan = event.robot == 0 ? nullptr : &plan_of(event.robot);
    if (event.kind != Kind::kSend) look_at_uses(event.robot);
    switch (event.kind) {
      case Kind::kSend:
        return;
      case Kind::kLoss:
        return swarm_.air().set_loss(0);
      case Kind::kTwice:
      case Kind::kAgain:
        return swarm_.air().set_duplicates(0);
      case Kind::kDelay:
        return swarm_.air().set_delays(0, {});
      case Kind::kPieces:
        return swarm_.cut_streams(SIZE_MAX);
      case Kind::kLinkDown:
        return swarm_.air().set_link(event.robot, true);
      case Kind::kAway:
        return swarm_.air().put(event.robot, plan->place);
      case Kind::kBusy:
        return swarm_.air().set_busy(event.robot, false);
      case Kind::kStop:
        ++state_of(event.robot).run;
        return swarm_.robot(event.robot).start();
      case Kind::kEnd:
      case Kind::kKill:
        if (actor(event.robot, event.program) == nullptr) start_program(event.robot, event.program);
        return;
      case Kind::kPause:
        if (Actor* const paused = actor(event.robot, event.program)) {
          paused->is_paused = false;
          swarm_.robot(event.robot).program(name_of_program(event.program)).set_running(true);
        }
        return;
      case Kind::kReload:
        state_of(event.robot).beacon_ms = plan->beacon_ms;
        return reload(event.robot);
      case Kind::kOtherKey:
        state_of(event.robot).key = plan->key;
        return reload(event.robot);
      case Kind::kClock:
        return;
      case Kind::kRefuse:
        return swarm_.air().set_refusing(event.robot, 0);
      case Kind::kStall:
        swarm_.robot(event.robot).set_running(true);
        if (std::exchange(state_of(event.robot).owes_reload, false)) reload(event.robot);
        return;
    }
  }

  /// Until what waits has left, and beacons have told of it.
  void settle() {
    swarm_.advance(kSettling);
    for (int n = 1; n <= robots(); ++n) {
      for (auto left = kLongestWait; left > 0s && leftovers_of(n).waiting_messages > 0;
           left -= 1s) {
        swarm_.advance(1s);
      }
    }
    swarm_.advance(2s);
  }

  /// What its daemon says; nothing, if it does not answer.
  Leftovers leftovers_of(int robot) {
    DaemonStatus status;
    (void)swarm_.robot(robot).program("observer").client().get_status(status);
    return leftovers_of(robot, status);
  }
  static Leftovers leftovers_of(int robot, const DaemonStatus& status) {
    Leftovers left;
    left.robot = robot;
    for (const UserStatus& user : status.users) {
      for (const ShareStatus& share : user.shares) {
        if (share.name == "waiting_messages") left.waiting_messages += share.used;
        if (share.name == "publishers") left.publishers += share.used;
        if (share.name == "subscriptions") left.subscriptions += share.used;
      }
    }
    for (const ChannelStatus& channel : status.channels) {
      if (channel.name.size() > 1) continue;  // none of the story's
      left.channel_publishers += channel.publishers;
      left.channel_subscriptions += channel.subscribers;
    }
    return left;
  }

  /// Of a robot with little memory, now.
  void look_at_uses(int robot) {
    VirtualRobot& owner = swarm_.robot(robot);
    if (!plan_of(robot).has_little || !owner.has_started() || !owner.machine().is_running()) return;
    DaemonStatus status;
    (void)owner.program("observer").client().get_status(status);
    const auto note = [&](const std::string& what, std::uint64_t used, std::uint64_t limit) {
      record_.uses.push_back({robot, what, used, limit});
    };
    for (const UserStatus& user : status.users) {
      for (const ShareStatus& share : user.shares) {
        if (share.name == "waiting_messages") note(share.name, share.used, share.limit);
      }
    }
    for (const ClientStatus& client : status.clients_served) {
      note("bytes that wait for a program", client.queued_bytes, kLittleBytes + kWritingBytes);
    }
  }

  /// What all must hear.
  void say_last_words() {
    for (const std::uint32_t ttl : {0u, 4u}) {
      for (int n = 1; n <= robots(); ++n) {
        for (int p = 0; p < static_cast<int>(plan_of(n).programs.size()); ++p) {
          for (const int channel : plan_of(n).programs[static_cast<std::size_t>(p)].sends) {
            send(n, p, channel, ttl, 0, true);
          }
        }
        swarm_.advance(20ms);
      }
      swarm_.advance(1s);
    }
    swarm_.advance(3s);
  }

  /// A message of each robot, which its own programs hear: before it each subscription is told of
  /// what it has not been yet.
  void flush() {
    ProgramPlan plan;
    for (int channel = 0; channel < kChannels; ++channel) plan.sends.push_back(channel);
    for (int n = 1; n <= robots(); ++n) {
      std::unique_ptr<Actor>& made = actors_[{n, kFlush}];
      if (made == nullptr) {
        made = std::make_unique<Actor>(swarm_.robot(n).program("flush"), Actor::Place{n, kFlush},
                                       plan, record_, known_, state_of(n).run);
      }
      for (const int channel : plan.sends) send(n, kFlush, channel, 0, 0);
      swarm_.advance(20ms);
    }
    swarm_.advance(2s);
  }

  /// What the daemons say, when all is over.
  void look() {
    for (int n = 1; n <= robots(); ++n) {
      DaemonStatus status;
      if (const Status asked = swarm_.robot(n).program("flush").client().get_status(status);
          !asked) {
        record_.broken.push_back("robot " + std::to_string(n) +
                                 " does not answer: " + std::string(asked.text()));
        continue;
      }
      const Air::Frames frames = swarm_.air().frames_of(n);
      Account account;
      account.robot = n;
      account.sent = frames.sent;
      account.heard = frames.heard;
      account.different = frames.different;
      std::uint64_t taken_later = 0;
      for (const Counter& counter : status.links.at(0).counters) {
        if (counter.name == "frames_sent") {
          account.told_sent = counter.value;
        } else if (counter.name.starts_with("frames_")) {
          account.told_heard += counter.value;
        }
        if (counter.name == "frames_proven_later") taken_later = counter.value;
        if (counter.name == "frames_received") account.taken = counter.value;
      }
      account.told_heard -= 2 * taken_later;  // it is also counted as not proven and as received
      for (const Counter& counter : status.counters) {
        if (counter.name == "deliveries_queued") account.deliveries = counter.value;
        if (counter.name == "deliveries_sent" || counter.name.starts_with("deliveries_dropped_")) {
          account.deliveries_ended += counter.value;
        }
      }
      record_.accounts.push_back(account);
      record_.leftovers.push_back(leftovers_of(n, status));
    }
  }

  static constexpr int kFlush = 9;

  const Story& story_;
  std::vector<std::unique_ptr<KeyFile>> keys_;
  Record record_;
  std::map<const Event*, std::size_t> strikes_;  // in the record
  std::unordered_map<std::string, int> known_;   // messages sent, by their text
  std::deque<State> states_;
  Swarm swarm_;
  std::map<Name, std::unique_ptr<Actor>> actors_;
};

}  // namespace

Record tell(const Story& story) {
  return Telling(story).run();
}

}  // namespace swarmtalk::test
