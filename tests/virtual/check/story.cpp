#include "tests/virtual/check/story.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <sstream>

namespace swarmtalk::test {
namespace {

/// What std's distributions draw is left to each library; this is the same everywhere.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : bits_(seed * 0x9E3779B97F4A7C15u + 1) {}

  /// @return of low to high, both included
  int between(int low, int high) {
    return low + static_cast<int>(bits_() % static_cast<std::uint64_t>(high - low + 1));
  }
  Milliseconds between(Milliseconds low, Milliseconds high) {
    return Milliseconds(between(static_cast<int>(low.count()), static_cast<int>(high.count())));
  }
  double upto(double most) { return most * (static_cast<double>(bits_() >> 11) / 0x1p53); }
  bool one_of(int count) { return between(1, count) == 1; }

 private:
  std::mt19937_64 bits_;
};

RobotPlan draw_robot(Dice& dice, double side_m, int key) {
  RobotPlan robot;
  robot.place = {dice.upto(side_m), dice.upto(side_m)};
  robot.beacon_ms = dice.between(2, 10) * 100;
  robot.key = key;
  if (dice.one_of(4)) robot.rate_hz = dice.between(5, 30);
  robot.has_little = dice.one_of(2);
  const int programs = dice.between(1, 3);
  for (int i = 0; i < programs; ++i) {
    ProgramPlan program;
    for (int channel = 0; channel < kChannels; ++channel) {
      if (dice.one_of(3)) program.sends.push_back(channel);
      if (!dice.one_of(3)) program.hears.push_back(channel);
    }
    if (dice.one_of(4)) program.queue = dice.one_of(2) ? Queue::kNewest : Queue::kOneAtATime;
    if (dice.one_of(6)) program.redundancy = static_cast<std::uint32_t>(dice.between(1, 3));
    if (dice.one_of(6)) program.copies = static_cast<std::uint32_t>(dice.between(2, 3));
    program.has_callback = !dice.one_of(5);
    if (dice.one_of(5)) program.keeps = static_cast<std::uint32_t>(dice.between(1, 4));
    if (dice.one_of(5)) program.wants = dice.one_of(2) ? Wants::kNewestOfEach : Wants::kFresh;
    program.max_age = dice.between(Milliseconds(50), Milliseconds(3000));
    robot.programs.push_back(program);
  }
  return robot;
}

/// Each sender its own pace, TTL and length. Many robots are slower, so that a story of them is not
/// many times as long.
void draw_sends(Dice& dice, Story& story) {
  const int slower = 1 + static_cast<int>(story.robots.size()) / 6;
  for (int robot = 1; robot <= static_cast<int>(story.robots.size()); ++robot) {
    const auto& programs = story.robots[static_cast<std::size_t>(robot - 1)].programs;
    for (int program = 0; program < static_cast<int>(programs.size()); ++program) {
      for (const int channel : programs[static_cast<std::size_t>(program)].sends) {
        Event send;
        send.kind = Kind::kSend;
        send.robot = robot;
        send.program = program;
        send.channel = channel;
        send.ttl = dice.one_of(2) ? 0 : static_cast<std::uint32_t>(dice.between(1, 4));
        const bool is_long = dice.one_of(6);
        const Milliseconds pause =
            slower * dice.between(Milliseconds(is_long ? 1000 : 300), Milliseconds(3000));
        for (Milliseconds at = dice.between(Milliseconds(0), pause); at < story.troubles;
             at += dice.between(pause / 2, pause * 3 / 2)) {
          send.at = at;
          send.count = dice.one_of(60) ? dice.between(5, 40) : 1;
          send.bytes =
              static_cast<std::size_t>(is_long ? dice.between(20, 5000) : dice.between(0, 200));
          story.events.push_back(send);
        }
      }
    }
  }
}

/// What is said in quick succession when a fault begins, or is over.
void draw_spell(Dice& dice, Story& story, const Event& fault) {
  const int robots = static_cast<int>(story.robots.size());
  Event send;
  send.robot = dice.one_of(4) ? dice.between(1, robots) : fault.robot;
  const auto& programs = story.robots[static_cast<std::size_t>(send.robot - 1)].programs;
  send.program = dice.between(0, static_cast<int>(programs.size()) - 1);
  const auto& channels = programs[static_cast<std::size_t>(send.program)].sends;
  if (channels.empty()) return;
  send.channel =
      channels[static_cast<std::size_t>(dice.between(0, static_cast<int>(channels.size()) - 1))];
  send.ttl = dice.one_of(4) ? 1 : 0;
  send.count = 1;
  send.bytes = static_cast<std::size_t>(dice.between(0, 200));
  const Milliseconds pause = dice.between(Milliseconds(5), Milliseconds(60));
  const Milliseconds middle = dice.one_of(2) ? fault.at : fault.at + fault.lasts;
  send.at = middle - pause * dice.between(0, 5);
  for (int i = dice.between(5, 15); i > 0 && send.at < story.troubles; --i, send.at += pause) {
    story.events.push_back(send);
  }
}

/// More than there is room for, while it has to wait: at a robot whose medium is full, or for a
/// program that reads nothing.
void draw_flood(Dice& dice, Story& story, const Event& fault) {
  Event send;
  const bool is_heard = fault.kind == Kind::kPause;
  send.robot = is_heard ? dice.between(1, static_cast<int>(story.robots.size())) : fault.robot;
  const auto& programs = story.robots[static_cast<std::size_t>(send.robot - 1)].programs;
  send.program = dice.between(0, static_cast<int>(programs.size()) - 1);
  send.bytes = static_cast<std::size_t>(is_heard ? dice.between(2000, 5000) : dice.between(0, 500));
  send.count = dice.between(4, 16);
  const Milliseconds end = std::min(fault.at + fault.lasts, story.troubles);
  for (send.at = fault.at; send.at < end && send.at < fault.at + Milliseconds(1000);
       send.at += Milliseconds(100)) {
    for (const int channel : programs[static_cast<std::size_t>(send.program)].sends) {
      send.channel = channel;
      story.events.push_back(send);
    }
  }
}

Event draw_fault(Dice& dice, const Story& story, int robot, Milliseconds at) {
  Event fault;
  fault.kind = static_cast<Kind>(dice.between(1, kKinds - 1));
  fault.at = at;
  fault.lasts = dice.one_of(3) ? dice.between(Milliseconds(1), Milliseconds(300))
                               : dice.between(Milliseconds(300), Milliseconds(8000));
  fault.robot = robot;
  const auto& plan = story.robots[static_cast<std::size_t>(robot - 1)];
  fault.program = dice.between(0, static_cast<int>(plan.programs.size()) - 1);
  fault.share = 0.02 + dice.upto(0.6);
  fault.count = fault.kind == Kind::kClock ? dice.between(-100000, 100000) : dice.between(1, 64);
  return fault;
}

/// At each moment a robot has one fault of a kind at most.
void add_fault(Dice& dice, Story& story, const Event& fault) {
  const bool has_key = story.robots[static_cast<std::size_t>(fault.robot - 1)].key != 0;
  if (fault.at >= story.troubles || (fault.kind == Kind::kOtherKey && !has_key)) return;
  const bool is_of_all = fault.kind <= Kind::kPieces;
  const bool overlaps =
      std::any_of(story.events.begin(), story.events.end(), [&](const Event& other) {
        return other.kind == fault.kind && (is_of_all || other.robot == fault.robot) &&
               other.at <= fault.at + fault.lasts && fault.at <= other.at + other.lasts;
      });
  if (overlaps) return;
  story.events.push_back(fault);
  if (dice.one_of(3)) draw_spell(dice, story, fault);
  const bool makes_wait = fault.kind == Kind::kPause || fault.kind == Kind::kBusy;
  if (makes_wait && dice.one_of(3)) draw_flood(dice, story, fault);
}

/// Some come again soon, and with some comes another of the same robot.
void draw_faults(Dice& dice, Story& story) {
  const int robots = static_cast<int>(story.robots.size());
  for (int left = dice.between(2, 6 + robots); left > 0; --left) {
    const Milliseconds at = dice.between(Milliseconds(2000), story.troubles);
    Event fault = draw_fault(dice, story, dice.between(1, robots), at);
    add_fault(dice, story, fault);
    if (dice.one_of(4)) {
      const Milliseconds moment = dice.between(fault.at, fault.at + fault.lasts);
      add_fault(dice, story, draw_fault(dice, story, fault.robot, moment));
    }
    if (!dice.one_of(4)) continue;
    fault.at += fault.lasts + dice.between(Milliseconds(20), Milliseconds(3000));
    add_fault(dice, story, fault);
  }
}

}  // namespace

const char* name_of(Kind kind) {
  static constexpr std::array<const char*, kKinds> kNames{
      "send", "loss", "twice", "again", "delay",  "pieces",    "link-down", "away",   "busy",
      "stop", "end",  "kill",  "pause", "reload", "other-key", "clock",     "refuse", "stall"};
  return kNames.at(static_cast<std::size_t>(kind));
}

Story draw_story(std::uint64_t seed) {
  Dice dice(seed);
  Story story;
  story.seed = seed;
  const int robots = dice.one_of(6) ? dice.between(9, 20) : dice.between(2, 8);
  story.troubles = dice.between(Milliseconds(10000), Milliseconds(25000));
  story.range_m = 10;
  const double side_m = 4 + 3 * std::sqrt(robots);
  const int keys = dice.one_of(2) ? 0 : dice.between(1, 2);
  for (int n = 1; n <= robots; ++n) {
    const int key = keys == 2 ? dice.between(0, 2) : keys;
    story.robots.push_back(draw_robot(dice, side_m, key));
  }
  draw_sends(dice, story);
  draw_faults(dice, story);
  std::stable_sort(story.events.begin(), story.events.end(),
                   [](const Event& a, const Event& b) { return a.at < b.at; });
  return story;
}

std::string told(const Story& story) {
  std::ostringstream text;
  text << "seed " << story.seed << ", range " << story.range_m << " m\n";
  for (std::size_t i = 0; i < story.robots.size(); ++i) {
    const RobotPlan& robot = story.robots[i];
    text << "robot " << i + 1 << " at " << robot.place.x_m << ", " << robot.place.y_m << ", beacon "
         << robot.beacon_ms << " ms, key " << robot.key << ", rate " << robot.rate_hz
         << (robot.has_little ? ", little memory" : "") << '\n';
    for (std::size_t p = 0; p < robot.programs.size(); ++p) {
      const ProgramPlan& program = robot.programs[p];
      text << "  program " << p << ": sends";
      for (const int channel : program.sends) text << ' ' << channel;
      text << "; hears";
      for (const int channel : program.hears) text << ' ' << channel;
      text << "; queue " << static_cast<int>(program.queue) << ", redundancy " << program.redundancy
           << ", copies " << program.copies << (program.has_callback ? "" : ", no callback")
           << ", wants " << static_cast<int>(program.wants) << ", keeps " << program.keeps
           << ", max age " << program.max_age.count() << " ms\n";
    }
  }
  for (const Event& event : story.events) {
    text << event.at.count() << " ms: " << name_of(event.kind);
    if (event.kind == Kind::kSend) {
      text << " robot " << event.robot << " program " << event.program << " channel "
           << event.channel << ", " << event.count << " of " << event.bytes << " B, ttl "
           << event.ttl << '\n';
      continue;
    }
    if (event.kind > Kind::kPieces) text << " robot " << event.robot;
    if (event.kind >= Kind::kEnd && event.kind <= Kind::kPause)
      text << " program " << event.program;
    if (event.kind >= Kind::kLoss && event.kind <= Kind::kPieces) text << ' ' << event.share;
    if (event.kind == Kind::kPieces || event.kind == Kind::kClock) text << ' ' << event.count;
    text << " for " << event.lasts.count() << " ms\n";
  }
  return text.str();
}

}  // namespace swarmtalk::test
