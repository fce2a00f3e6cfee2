// What robots with a swarm key say before they have shown that they live, and swarms of them that
// start, restart and are played back, with a simulated clock: frames as links build and read them.
#include "drivers/link/held_frames.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "drivers/link/framer.hpp"
#include "tests/unit/drivers/test_link_user.hpp"

namespace swarmtalk::drivers {
namespace {

using Ms = std::chrono::milliseconds;

constexpr std::size_t kFrameLimitBytes = 1400;
constexpr std::size_t kWordBytes = 20;
constexpr std::uint64_t kSwarmSeed = 1;

HeldFrames::Held frame_of(std::uint8_t robot, std::uint32_t counter, Ms at = Ms(0),
                          std::size_t bytes = 100) {
  HeldFrames::Held made;
  made.voice[0] = robot;
  made.counter = counter;
  made.arrival.received_at = MonotonicTime(at);
  made.bytes.assign(bytes, robot);
  return made;
}

std::vector<std::uint32_t> counters_of(const std::vector<HeldFrames::Held>& frames) {
  std::vector<std::uint32_t> counters;
  for (const HeldFrames::Held& each : frames) counters.push_back(each.counter);
  return counters;
}

TEST(HeldFrames, GivesBackEachFrameOfARobotOnceInItsOrder) {
  HeldFrames sut;
  for (const std::uint32_t counter : {3u, 1u, 2u, 3u}) sut.keep(frame_of(1, counter));
  sut.keep(frame_of(2, 9));
  EXPECT_EQ(counters_of(sut.take(frame_of(1, 0).voice)), (std::vector<std::uint32_t>{1, 2, 3}));
  EXPECT_TRUE(sut.take(frame_of(1, 0).voice).empty());
  EXPECT_EQ(sut.size(), 1U);
  EXPECT_EQ(sut.bytes(), 100U);
}

TEST(HeldFrames, ForgetsWhatIsTooOldToBeTaken) {
  HeldFrames sut;
  sut.keep(frame_of(1, 1, Ms(1000)));
  sut.keep(frame_of(1, 2, Ms(1000) + HeldFrames::kLongest + Ms(1)));
  EXPECT_EQ(counters_of(sut.take(frame_of(1, 0).voice)), (std::vector<std::uint32_t>{2}));
}

TEST(HeldFrames, ManyFramesOfOthersTakeNobodysPart) {
  HeldFrames sut;
  for (std::uint32_t counter = 1; counter <= 4; ++counter) sut.keep(frame_of(255, counter));
  for (std::uint8_t robot = 0; robot < 100; ++robot) {
    for (std::uint32_t counter = 0; counter < 200; ++counter) sut.keep(frame_of(robot, counter));
  }
  EXPECT_LE(sut.size(), HeldFrames::kMost);
  EXPECT_EQ(sut.take(frame_of(255, 0).voice).size(), 4U);
}

TEST(HeldFrames, TakesNoMoreMemoryThanItSays) {
  HeldFrames sut;
  for (std::uint32_t counter = 0; counter < 20; ++counter) {
    for (std::uint8_t robot = 0; robot < 20; ++robot) {
      sut.keep(frame_of(robot, counter, Ms(0), 9000));
    }
  }
  EXPECT_GT(sut.bytes(), HeldFrames::kMostBytes / 2);
  EXPECT_LE(sut.bytes(), HeldFrames::kMostBytes);
  sut.keep(frame_of(99, 1, Ms(0), HeldFrames::kMostBytes + 1));
  EXPECT_TRUE(sut.take(frame_of(99, 0).voice).empty());
}

/// What one robot said, and when.
struct Said {
  std::size_t robot;
  int start;  // its how many-th
  std::uint32_t number;
  bool operator<(const Said& other) const {
    return std::tie(robot, start, number) < std::tie(other.robot, other.start, other.number);
  }
};

struct OnAir {
  Bytes bytes;
  MonotonicTime sent_at;
};

/// Robots that all hear each other; each frame has a message that tells who, in which start, when.
class KeyedSwarm {
 public:
  KeyedSwarm(std::size_t robots, double rate_hz)
      : interval_(static_cast<int>(1000 / rate_hz)), draws_(kSwarmSeed) {
    for (std::size_t i = 0; i < robots; ++i) {
      robots_.push_back(std::make_unique<Robot>());
      start(i);
    }
  }

  /// A new run of a robot. What it heard before stays in its list.
  /// @param is_first  it says something before anything else
  void start(std::size_t i, bool is_first = false) {
    Robot& robot = *robots_[i];
    ++robot.starts;
    robot.user = std::make_unique<TestLinkUser>(static_cast<std::uint16_t>(i + 1), draw());
    robot.builder = FrameBuilder(frame::ProfileId::kKilobot, kWordBytes);
    robot.receiver = FrameReceiver(frame::ProfileId::kKilobot);
    robot.freshness.reset();
    use_key_freshly(key_, nullptr, robot.user->header.epoch, now, robot.freshness, robot.builder,
                    robot.receiver);
    robot.said = 0;
    robot.next_at = now + Ms(draw() % static_cast<std::uint32_t>(interval_.count()));
    if (is_first) robot.next_at = now;
    robot.user->on_received = [this, &robot](const Bytes& packet) { note(robot, packet); };
  }

  void run_until(MonotonicTime end) {
    for (; now < end; now += Ms(1)) {
      for (std::size_t i = 0; i < robots_.size(); ++i) {
        Robot& robot = *robots_[i];
        const bool is_turn = robot.next_at <= now;
        const MonotonicTime asked_at{Ms(robot.freshness->speak_at())};
        if (is_turn) robot.next_at += interval_;
        if (is_turn)
          say(i);
        else if (asked_at <= now)
          say_nothing(i);
      }
    }
  }

  void hear(std::size_t i, const Bytes& bytes) {
    robots_[i]->receiver.receive(bytes, {now}, *robots_[i]->user, robots_[i]->counters);
  }

  /// How many of what robot `i` has said since its last start others have heard of, at least.
  std::size_t least_heard_of(std::size_t i) const {
    std::size_t least = SIZE_MAX;
    for (std::size_t other = 0; other < robots_.size(); ++other) {
      if (other == i) continue;
      std::size_t heard = 0;
      for (std::uint32_t number = 1; number <= robots_[i]->said; ++number) {
        heard += robots_[other]->heard.count({i, robots_[i]->starts, number});
      }
      least = std::min(least, heard);
    }
    return least;
  }
  /// Frames that were held and taken, by all together.
  std::uint64_t later() const {
    std::uint64_t sum = 0;
    for (const auto& each : robots_) sum += each->counters.frames_proven_later;
    return sum;
  }
  std::uint32_t said(std::size_t i) const { return robots_[i]->said; }
  std::size_t heard(std::size_t by, std::size_t of) const {
    std::size_t count = 0;
    for (std::uint32_t number = 1; number <= robots_[of]->said; ++number) {
      count += robots_[by]->heard.count({of, robots_[of]->starts, number});
    }
    return count;
  }
  std::size_t size() const { return robots_.size(); }
  std::uint32_t draw() { return static_cast<std::uint32_t>(draws_()); }

  MonotonicTime now{std::chrono::seconds(1000)};
  std::uint64_t loss_permille = 0;
  std::size_t hearers = SIZE_MAX;  // of each frame, robot 0 first; robot 0's all hear
  std::vector<OnAir>* record = nullptr;
  std::size_t delivered = 0;
  std::size_t twice = 0;
  std::size_t late = 0;
  std::chrono::nanoseconds latest{0};

 private:
  struct Robot {
    std::unique_ptr<TestLinkUser> user;
    FrameBuilder builder{frame::ProfileId::kKilobot, kWordBytes};
    FrameReceiver receiver{frame::ProfileId::kKilobot};
    std::shared_ptr<frame::Freshness> freshness;
    LinkCounters counters;
    int starts = 0;
    std::uint32_t said = 0;
    MonotonicTime next_at{};
    std::set<Said> heard;  // over all its starts
  };

  void say(std::size_t i) {
    Robot& robot = *robots_[i];
    Bytes packet = numbered_packet(++robot.said, kWordBytes);
    packet[4] = static_cast<std::uint8_t>(i);
    packet[5] = static_cast<std::uint8_t>(robot.starts);
    const auto at = static_cast<std::uint32_t>(milliseconds(now));
    for (std::size_t byte = 0; byte < 4; ++byte) {
      packet[6 + byte] = static_cast<std::uint8_t>(at >> 8 * byte);
    }
    robot.user->waiting.push_back(packet);
    Bytes bytes(robot.builder.buffer_bytes(kFrameLimitBytes));
    bytes.resize(
        robot.builder.build(*robot.user, bytes, kFrameLimitBytes, robot.counters, now).size_bytes);
    transmit(i, bytes);
  }
  void say_nothing(std::size_t i) {
    Robot& robot = *robots_[i];
    Bytes bytes(robot.builder.buffer_bytes(kFrameLimitBytes));
    bytes.resize(robot.builder.build_beacon(*robot.user, bytes, kFrameLimitBytes, now).size_bytes);
    transmit(i, bytes);
  }
  void transmit(std::size_t from, const Bytes& bytes) {
    if (record != nullptr) record->push_back({bytes, now});
    for (std::size_t i = 0, told = 0; i < robots_.size(); ++i) {
      if (i == from || draws_() % 1000 < loss_permille) continue;
      if (from != 0 && ++told > hearers) break;
      hear(i, bytes);
    }
  }
  void note(Robot& robot, const Bytes& packet) {
    std::uint32_t at = 0;
    for (std::size_t byte = 0; byte < 4; ++byte) at |= std::uint32_t{packet[6 + byte]} << 8 * byte;
    const auto age = now - MonotonicTime(Ms(at));
    latest = std::max<std::chrono::nanoseconds>(latest, age);
    ++delivered;
    late += age > HeldFrames::kLongest ? 1U : 0U;
    twice += robot.heard.insert({packet[4], packet[5], packet_number(packet)}).second ? 0U : 1U;
    robot.user->received.clear();
    robot.user->receptions.clear();
    robot.user->frames.clear();
  }

  Ms interval_;
  std::mt19937_64 draws_;
  std::vector<std::unique_ptr<Robot>> robots_;
  std::shared_ptr<const frame::SwarmKey> key_ = [] {
    const Bytes bytes(frame::SwarmKey::kBytes, 7);
    return std::make_shared<frame::SwarmKey>(std::span(bytes).first<frame::SwarmKey::kBytes>());
  }();
};

TEST(KeyedSwarm, FirstMessagesOfOneThatRestartsReachAllOthersWithinASecond) {
  KeyedSwarm swarm(100, 5);  // 500 frames a second
  swarm.run_until(swarm.now + Ms(7000));
  swarm.start(17, true);
  swarm.run_until(swarm.now + Ms(1000));
  EXPECT_GE(swarm.said(17), 4U);
  EXPECT_GE(swarm.later(), 99U) << "held by all";
  EXPECT_EQ(swarm.least_heard_of(17), swarm.said(17)) << "each, from the first on";
  EXPECT_EQ(swarm.twice, 0U);
  EXPECT_EQ(swarm.late, 0U);
}

TEST(KeyedSwarm, MessagesOfAHundredThatStartAtOnceAreHeard) {
  KeyedSwarm swarm(100, 5);
  swarm.loss_permille = 20;
  swarm.run_until(swarm.now + Ms(5000));
  std::size_t pairs = 0;
  std::size_t heard = 0;
  std::size_t said = 0;
  for (std::size_t by = 0; by < swarm.size(); ++by) {
    for (std::size_t of = 0; of < swarm.size(); ++of) {
      if (by == of) continue;
      const std::size_t count = swarm.heard(by, of);
      pairs += count > 0 ? 1 : 0;
      heard += count;
      said += swarm.said(of);
    }
  }
  EXPECT_EQ(pairs, 100U * 99U);
  EXPECT_GT(swarm.later(), 0U);
  // 2 % are lost on the air.
  EXPECT_GE(heard * 100, said * 97) << heard << " of " << said;
  EXPECT_EQ(swarm.twice, 0U);
  EXPECT_EQ(swarm.late, 0U);
}

/// Robot 0 hears all, is started again and again, and is played what it heard, or what it could
/// have heard while it was off.
TEST(KeyedSwarm, NothingThatWasRecordedIsDeliveredTwiceOrLate) {
  KeyedSwarm swarm(100, 5);
  swarm.hearers = 3;
  std::vector<OnAir> record;
  swarm.record = &record;
  const auto play = [&](std::size_t frames, std::size_t newest) {
    const std::size_t reach = std::min(newest, record.size());
    for (std::size_t i = 0; i < frames; ++i) {
      const std::size_t back = 1 + swarm.draw() % reach;
      swarm.hear(0, record[record.size() - back].bytes);
    }
  };
  for (int start = 1; start < 20; ++start) {
    for (std::size_t i = 1; i < swarm.size(); ++i) swarm.start(i);
    for (int part = 0; part < 4; ++part) {
      if (part == start % 4) {
        swarm.start(0);
        play(200, 300);  // the last seconds: it may have heard them before it went off
      }
      swarm.run_until(swarm.now + Ms(250));
      play(60, 500);
      play(60, SIZE_MAX);
    }
  }
  const std::vector<OnAir> all = record;
  for (const OnAir& each : all) swarm.hear(0, each.bytes);  // in order, as it was
  EXPECT_GT(all.size(), 9000U);
  EXPECT_EQ(swarm.twice, 0U) << "seed " << kSwarmSeed;
  EXPECT_EQ(swarm.late, 0U) << "the latest after "
                            << std::chrono::duration_cast<Ms>(swarm.latest).count() << " ms";
  const std::size_t heard = swarm.heard(0, 99);
  const std::uint32_t said = swarm.said(99);
  swarm.run_until(swarm.now + Ms(3000));
  EXPECT_GE(swarm.said(99) - said, 14U);
  EXPECT_EQ(swarm.heard(0, 99) - heard, swarm.said(99) - said) << "the living are heard";
  EXPECT_GT(swarm.delivered, 3000U) << "and were";
}

TEST(KeyedSwarm, WhatWasHeldWithoutAProofIsNeverDelivered) {
  KeyedSwarm swarm(3, 5);
  std::vector<OnAir> record;
  swarm.record = &record;
  swarm.run_until(swarm.now + Ms(3000));
  swarm.record = nullptr;
  swarm.start(1);
  swarm.start(2);
  for (const OnAir& each : record) swarm.hear(0, each.bytes);
  swarm.run_until(swarm.now + Ms(8000));
  EXPECT_EQ(swarm.twice, 0U);
  EXPECT_EQ(swarm.late, 0U);
}

}  // namespace
}  // namespace swarmtalk::drivers
