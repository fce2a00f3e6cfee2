// Freshness with a simulated clock: robots that start, restart, are stopped and are played back.
#include "frame/freshness.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace swarmtalk::frame {
namespace {

using Ms = Freshness::Ms;
using Verdict = Freshness::Verdict;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kRoom = 1200;

/// What is heard of a frame, without its packets.
struct Recorded {
  Freshness::Voice voice;
  std::uint32_t counter;
  Bytes plaintext;
  Ms sent_at;
};

/// A robot over several starts.
class Robot {
 public:
  Robot(std::uint16_t node, std::mt19937_64& draws) : node_(node), draws_(draws) {}

  void start(Ms now) {
    voice_.fill(0);
    for (int i = 0; i < 10; ++i) voice_[static_cast<std::size_t>(i)] = random_byte();
    voice_[10] = static_cast<std::uint8_t>(node_ >> 8);
    voice_[11] = static_cast<std::uint8_t>(node_);
    counter_ = 0;
    sut_ = std::make_unique<Freshness>(voice_, now, [this](std::span<std::uint8_t> out) {
      for (std::uint8_t& byte : out) byte = random_byte();
    });
  }
  Recorded speak(Ms now, std::size_t room = kRoom) {
    Recorded frame{voice_, ++counter_, Bytes(room), now};
    frame.plaintext.resize(sut_->write(now, frame.plaintext));
    return frame;
  }
  Verdict hear(const Recorded& frame, Ms at) {
    std::size_t used = 0;
    const Verdict verdict = sut_->receive(frame.voice, frame.counter, frame.plaintext, at, used);
    if (verdict != Verdict::kMalformed) {
      EXPECT_EQ(used, frame.plaintext.size());
    }
    return verdict;
  }
  Freshness& sut() { return *sut_; }
  const Freshness::Voice& voice() const { return voice_; }

 private:
  std::uint8_t random_byte() { return static_cast<std::uint8_t>(draws_()); }

  std::uint16_t node_;
  std::mt19937_64& draws_;
  Freshness::Voice voice_{};
  std::uint32_t counter_ = 0;
  std::unique_ptr<Freshness> sut_;
};

/// Robots that all hear each other, each with a few frames a second.
class Swarm {
 public:
  Swarm(std::uint16_t robots, double rate_hz, std::uint64_t seed)
      : draws_(seed), interval_ms_(static_cast<Ms>(1000 / rate_hz)) {
    for (std::uint16_t i = 0; i < robots; ++i) {
      robots_.push_back(std::make_unique<Robot>(i, draws_));
      robots_.back()->start(0);
      next_.push_back(draws_() % interval_ms_);
    }
  }
  Robot& robot(std::size_t i) { return *robots_[i]; }
  std::size_t size() const { return robots_.size(); }
  std::mt19937_64& draws() { return draws_; }

  void restart(std::size_t i) {
    robots_[i]->start(now);
    next_[i] = now + draws_() % interval_ms_;
    heard_by_.clear();
  }
  /// Runs until `end`. Each robot speaks at its turns.
  void run_until(Ms end) {
    for (; now < end; ++now) {
      for (std::size_t i = 0; i < robots_.size(); ++i) {
        if (next_[i] > now) continue;
        next_[i] += interval_ms_;
        transmit(i);
      }
    }
  }
  void transmit(std::size_t from) {
    const Recorded frame = robots_[from]->speak(now);
    bytes += frame.plaintext.size();
    ++frames;
    if (records) record.push_back(frame);
    for (std::size_t i = 0; i < robots_.size(); ++i) {
      if (i == from || draws_() % 1000 < loss_permille) continue;
      if (hearers != 0 && i != 0 && from != 0 && (i * 7 + from) % robots_.size() >= hearers)
        continue;
      const Verdict verdict = robots_[i]->hear(frame, now + 1);
      ++verdicts[static_cast<std::size_t>(verdict)];
      if (verdict == Verdict::kFresh) heard_by_.insert({from, i});
    }
  }
  /// Of how many others robot `i` is believed, since the last restart.
  std::size_t believed_by(std::size_t i) const {
    return static_cast<std::size_t>(std::count_if(
        heard_by_.begin(), heard_by_.end(), [i](const auto& pair) { return pair.first == i; }));
  }
  std::size_t pairs() const { return heard_by_.size(); }
  void forget_pairs() { heard_by_.clear(); }

  Ms now = 0;
  std::uint64_t loss_permille = 0;
  std::size_t hearers = 0;  // of each frame, beside robot 0; 0: all
  bool records = false;
  std::vector<Recorded> record;
  std::uint64_t bytes = 0;
  std::uint64_t frames = 0;
  std::array<std::uint64_t, 5> verdicts{};

 private:
  std::mt19937_64 draws_;
  Ms interval_ms_;
  std::vector<std::unique_ptr<Robot>> robots_;
  std::vector<Ms> next_;
  std::set<std::pair<std::size_t, std::size_t>> heard_by_;
};

constexpr std::uint64_t kSeed = 1;

/// The bytes on the air: docs/wire-format.md, fresh frames.
TEST(Freshness, WritesWhatIsDrawn) {
  std::uint8_t next = 0xA0;
  const auto count = [&next](std::span<std::uint8_t> out) {
    for (std::uint8_t& byte : out) byte = next++;
  };
  const Freshness::Voice own{0x11, 0x12, 0x13, 0x14, 0x15, 0x16, 1, 2, 3, 4, 0, 0};
  Freshness sut(own, 5000, count);
  Bytes bytes(kRoom);
  bytes.resize(sut.write(5000 + 0x010203 * 10, bytes));
  EXPECT_EQ(bytes, (Bytes{1, 2, 3, 0xA6, 0xA7, 0xA8, 0xA9, 0xAA, 0xAB, 0}))
      << "stamp in 10 ms, nonce (the second: the first is too old), nothing else";
  const Freshness::Voice other{0x21, 0x22, 0x23, 0x24, 0x25, 0x26, 5, 6, 7, 8, 0, 0};
  const Bytes heard{0, 0, 9, 0xC0, 0xC1, 0xC2, 0xC3, 0xC4, 0xC5, 1, 1, 0, 0x11, 0x12};
  std::size_t used = 0;
  const Ms now = 5000 + 0x010203 * 10;
  EXPECT_EQ(sut.receive(other, 1, heard, now, used), Verdict::kNotProven);
  EXPECT_EQ(used, heard.size());
  bytes.resize(kRoom);
  bytes.resize(sut.write(now, bytes));
  EXPECT_EQ(bytes, (Bytes{1, 2, 3,    0xA6, 0xA7, 0xA8, 0xA9, 0xAA, 0xAB, 1,
                          1, 1, 0x21, 0x22, 0xC0, 0xC1, 0xC2, 0xC3, 0xC4, 0xC5}))
      << "it asks the other by its session, and answers with its nonce";
}

TEST(Freshness, TwoRobotsBelieveEachOtherAfterAFrameEachAndAnAnswer) {
  std::mt19937_64 draws(kSeed);
  Robot a(1, draws);
  Robot b(2, draws);
  a.start(0);
  b.start(0);
  EXPECT_EQ(b.hear(a.speak(10), 11), Verdict::kNotProven);
  EXPECT_EQ(a.hear(b.speak(20), 21), Verdict::kFresh) << "it sends back our nonce";
  EXPECT_EQ(b.hear(a.speak(30), 31), Verdict::kFresh);
  EXPECT_EQ(b.hear(a.speak(40), 41), Verdict::kFresh);
}

TEST(Freshness, AFrameIsTakenOnceAndNothingFromBeforeTheProof) {
  std::mt19937_64 draws(kSeed);
  Robot a(1, draws);
  Robot b(2, draws);
  a.start(0);
  b.start(0);
  const Recorded early = a.speak(10);
  a.hear(b.speak(20), 21);
  const Recorded proof = a.speak(30);
  EXPECT_EQ(b.hear(proof, 31), Verdict::kFresh);
  EXPECT_EQ(b.hear(proof, 32), Verdict::kReplayed);
  EXPECT_TRUE(b.sut().was_heard(a.voice(), proof.counter));
  EXPECT_EQ(b.hear(early, 33), Verdict::kReplayed);
  const Recorded late = a.speak(40);
  EXPECT_EQ(b.hear(a.speak(50), 51), Verdict::kFresh);
  EXPECT_EQ(b.hear(late, 52), Verdict::kFresh) << "overtaken, not replayed";
  EXPECT_EQ(b.hear(late, 53), Verdict::kReplayed);
}

TEST(Freshness, AFrameThatWasHeldBackIsDropped) {
  Swarm swarm(2, 5, kSeed);
  swarm.run_until(2000);
  const Recorded held = swarm.robot(1).speak(2000);
  EXPECT_EQ(swarm.robot(0).hear(held, 2000 + Freshness::kBoundMs + 1), Verdict::kTooOld);
  const Recorded also = swarm.robot(1).speak(3000);
  EXPECT_EQ(swarm.robot(0).hear(also, 63000), Verdict::kTooOld);
  const Recorded quick = swarm.robot(1).speak(64000);
  EXPECT_EQ(swarm.robot(0).hear(quick, 64000 + Freshness::kBoundMs - OwnNonces::kAnswerMs - 20),
            Verdict::kFresh);
}

TEST(Freshness, FramesThatWaitedInTheKernelAreJudgedByItsStamp) {
  Swarm swarm(2, 5, kSeed);
  swarm.run_until(2000);
  std::vector<Recorded> waiting;
  for (Ms at = 2000; at < 22000; at += 20) waiting.push_back(swarm.robot(1).speak(at));
  for (const Recorded& frame : waiting) {  // read at 22000
    EXPECT_EQ(swarm.robot(0).hear(frame, frame.sent_at + 1), Verdict::kFresh) << frame.sent_at;
  }
  swarm.now = 22000;
  EXPECT_EQ(swarm.robot(1).hear(swarm.robot(0).speak(22000), 22001), Verdict::kFresh);
}

TEST(Freshness, OneOfAHundredThatRestartsIsBelievedByAllWithinASecond) {
  for (const std::uint64_t loss : {0u, 20u}) {
    Swarm swarm(100, 5, kSeed);
    swarm.loss_permille = loss;
    swarm.run_until(6000);
    swarm.restart(17);
    swarm.run_until(7000);
    EXPECT_EQ(swarm.believed_by(17), 99u) << "loss " << loss << ", seed " << kSeed;
    std::size_t believed = 0;  // by robot 17
    swarm.forget_pairs();
    swarm.run_until(7400);
    for (std::size_t i = 0; i < 100; ++i) believed += swarm.believed_by(i) >= 97 ? 1 : 0;
    EXPECT_GE(believed, 98u);
  }
}

TEST(Freshness, AHundredThatStartAtOnceBelieveEachOtherWithinFiveSeconds) {
  Swarm swarm(100, 5, kSeed);  // 500 frames a second
  swarm.loss_permille = 20;
  swarm.run_until(4000);
  swarm.forget_pairs();
  swarm.run_until(5000);
  EXPECT_EQ(swarm.pairs(), 100u * 99u) << "seed " << kSeed;
}

TEST(Freshness, CostsAtMostTwelveBytesAFrame) {
  Swarm swarm(20, 5, kSeed);
  swarm.run_until(10'000);
  swarm.bytes = swarm.frames = 0;
  swarm.verdicts.fill(0);
  swarm.run_until(700'000);  // every voice is proven anew at least once
  EXPECT_LE(swarm.bytes, 12 * swarm.frames);
  EXPECT_EQ(swarm.verdicts[static_cast<std::size_t>(Verdict::kFresh)], swarm.frames * 19);
}

/// Recorded traffic, played to a robot that may be any of those that were there when it was
/// recorded.
TEST(Freshness, NothingThatWasRecordedIsTakenAgainWhateverStartsMeanwhile) {
  constexpr std::size_t kStarts = 20;
  Swarm swarm(100, 5, kSeed);
  swarm.hearers = 4;
  swarm.records = true;
  for (std::size_t start = 0; start < kStarts; ++start) {
    for (std::size_t i = 1; i < swarm.size(); ++i) swarm.restart(i);
    swarm.run_until(swarm.now + 1000);
  }
  std::vector<Recorded> record;
  record.swap(swarm.record);
  EXPECT_GT(record.size(), 9000u);
  std::size_t taken = 0;
  std::size_t played = 0;
  const auto play = [&](std::size_t frames) {
    for (std::size_t i = 0; i < frames; ++i, ++played) {
      const Recorded& frame = record[swarm.draws()() % record.size()];
      taken += swarm.robot(0).hear(frame, swarm.now + 1) == Verdict::kFresh ? 1u : 0u;
    }
  };
  for (int round = 0; round < 12; ++round) {
    play(500);
    if (round % 3 == 1) swarm.restart(0);
    play(500);
    swarm.run_until(swarm.now + 300);  // the living go on, and so does what was recorded of them
    play(500);
    std::copy_n(swarm.record.begin(), std::min<std::size_t>(swarm.record.size(), 100),
                std::back_inserter(record));
    swarm.record.clear();
  }
  std::sort(record.begin(), record.end(),
            [](const Recorded& a, const Recorded& b) { return a.sent_at < b.sent_at; });
  for (const Recorded& frame : record) {  // in order, as they were
    taken += swarm.robot(0).hear(frame, swarm.now + 1) == Verdict::kFresh ? 1u : 0u;
  }
  EXPECT_EQ(taken, 0u) << "seed " << kSeed;
  swarm.forget_pairs();
  swarm.run_until(swarm.now + 2000);
  std::size_t still_heard = 0;
  for (std::size_t i = 1; i < swarm.size(); ++i) still_heard += swarm.believed_by(i) > 0 ? 1 : 0;
  EXPECT_EQ(still_heard, 99u) << "the living are heard all the same";
}

TEST(Freshness, ALivingVoiceIsNeverForgottenForDeadOnes) {
  std::mt19937_64 draws(kSeed);
  Robot sut(0, draws);
  Robot living(1, draws);
  sut.start(0);
  living.start(0);
  living.hear(sut.speak(0), 1);
  Ms now = 10;
  ASSERT_EQ(sut.hear(living.speak(now), now), Verdict::kFresh);
  for (std::size_t i = 0; i < Freshness::kVoices + 500; ++i) {
    Robot other(static_cast<std::uint16_t>(2 + i % 100), draws);
    other.start(now);
    other.hear(sut.speak(now), now);
    ASSERT_EQ(sut.hear(other.speak(now), now + 1), Verdict::kFresh);
    now += 20;
    if (i % 10 == 0) {
      living.hear(sut.speak(now), now);
      ASSERT_EQ(sut.hear(living.speak(now), now + 1), Verdict::kFresh);
    }
  }
  EXPECT_EQ(sut.sut().evicted(), 501u);
}

TEST(Freshness, AVoiceWhoseClockStoodStillIsBelievedAgainAfterAProof) {
  Swarm swarm(2, 5, kSeed);
  swarm.run_until(2000);
  // Robot 1 slept for a minute: its stamps are behind by that from now on.
  Ms own = 2000;
  int fresh = 0;
  for (Ms now = 62'000; now < 64'000; now += 200, own += 200) {
    const Recorded frame = swarm.robot(1).speak(own);
    fresh += swarm.robot(0).hear(frame, now) == Verdict::kFresh ? 1 : 0;
    swarm.robot(1).hear(swarm.robot(0).speak(now + 100), own + 100);
  }
  EXPECT_GE(fresh, 5);
}

TEST(Freshness, SpeaksSoonWhenAStrangerIsHeardAndNotForeverForOneThatIsDead) {
  std::mt19937_64 draws(kSeed);
  Robot sut(1, draws);
  Robot other(2, draws);
  sut.start(0);
  other.start(0);
  sut.speak(0);
  EXPECT_GE(sut.sut().speak_at(), Freshness::kSilenceMs) << "nobody is there";
  Ms now = 500;
  const Recorded frame = other.speak(now);
  sut.hear(frame, now);
  EXPECT_LE(sut.sut().speak_at(), now + Freshness::kGapMs);
  int spoken = 0;
  for (; now < 60'000; ++now) {
    if (now % 20 == 0) sut.hear(frame, now);  // played again and again
    if (sut.sut().speak_at() > now) continue;
    sut.speak(now);
    ++spoken;
  }
  EXPECT_LE(spoken, 10);
}

TEST(Freshness, FirstBytesThatAreCutOrUnknownAreMalformed) {
  std::mt19937_64 draws(kSeed);
  Robot sut(1, draws);
  Robot other(2, draws);
  sut.start(0);
  other.start(0);
  other.hear(sut.speak(0), 0);
  Recorded frame = other.speak(10);
  ASSERT_GT(frame.plaintext.size(), Freshness::kLeastBytes) << "it answers";
  Recorded cut = frame;
  for (std::size_t size = 0; size < frame.plaintext.size(); ++size) {
    cut.plaintext.resize(size);
    EXPECT_EQ(sut.hear(cut, 11), Verdict::kMalformed) << size;
    cut.plaintext = frame.plaintext;
  }
  frame.plaintext[9] = 2;
  EXPECT_EQ(sut.hear(frame, 11), Verdict::kMalformed);
}

TEST(Freshness, WritesWhatFitsAndTheRestLater) {
  Swarm swarm(40, 5, kSeed);
  swarm.run_until(400);
  Robot late(100, swarm.draws());
  late.start(400);
  for (std::size_t i = 0; i < 40; ++i) late.hear(swarm.robot(i).speak(400), 401);
  EXPECT_GT(late.sut().wanted_bytes(402), 40 * Freshness::kAnswerBytes);
  EXPECT_EQ(late.speak(402, Freshness::kLeastBytes).plaintext.size(), Freshness::kLeastBytes);
  EXPECT_LE(late.speak(403, 60).plaintext.size(), 60u);
  EXPECT_GT(late.speak(404).plaintext.size(), 100u);
}

}  // namespace
}  // namespace swarmtalk::frame
