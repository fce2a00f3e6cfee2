#include "emulation/kilobot/medium.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

namespace swarmtalk::emulator {
namespace {

struct Receiver : LightSink {
  struct Edge {
    std::uint64_t time_ns;
    std::uint16_t high_gain;
    bool is_rising;
  };
  std::vector<Edge> edges;
  void on_light(std::uint64_t time_ns, SignalStrength strength, bool is_rising) override {
    edges.push_back({time_ns, strength.high_gain, is_rising});
  }
};

const IrMessage kMessage = make_ir_message(std::array<std::uint8_t, 2>{1, 2}, 3);
constexpr std::uint64_t kPeriodNs = 10'000'000;

void send(Medium& medium, unsigned sender, std::uint64_t start_ns) {
  for (const std::uint64_t pulse_ns : ir_pulses(kMessage)) {
    medium.switch_light(sender, start_ns + pulse_ns, true);
    medium.switch_light(sender, start_ns + pulse_ns + kIrPulseNs, false);
  }
}

std::size_t messages_in(const Receiver& receiver) {
  FrameDecoder decoder;
  std::size_t count = 0;
  for (const Receiver::Edge& edge : receiver.edges)
    if (edge.is_rising && decoder.on_pulse(edge.time_ns) == FrameDecoder::Event::kMessage &&
        decoder.message() == kMessage)
      ++count;
  return count;
}

class MediumTest : public testing::Test {
 protected:
  void make(const MediumSettings& settings) {
    medium_ = std::make_unique<Medium>(settings);
    medium_->add_station({0, 0, 0}, &receivers_[0]);
    medium_->add_station({50, 0, 0}, &receivers_[1]);
    medium_->add_station({150, 0, 0}, &receivers_[2]);
  }
  std::unique_ptr<Medium> medium_;
  Receiver receivers_[3];
};

TEST_F(MediumTest, ReachesRobotsInRangeAfterTheDelay) {
  make({});
  send(*medium_, 0, 1000);
  ASSERT_FALSE(receivers_[1].edges.empty());
  EXPECT_EQ(receivers_[1].edges[0].time_ns, 1000u + 8000u);
  EXPECT_EQ(receivers_[1].edges[0].high_gain, signal_at(50).high_gain);
  EXPECT_EQ(messages_in(receivers_[1]), 1u);
  EXPECT_TRUE(receivers_[2].edges.empty());
}

TEST_F(MediumTest, LetsARobotHearItselfOnlyIfAsked) {
  make({});
  send(*medium_, 0, 0);
  EXPECT_EQ(messages_in(receivers_[0]), 1u);
  MediumSettings deaf_to_itself;
  deaf_to_itself.hears_itself = false;
  receivers_[0].edges.clear();
  make(deaf_to_itself);
  send(*medium_, 0, 0);
  EXPECT_TRUE(receivers_[0].edges.empty());
}

TEST_F(MediumTest, ReachesEverybodyFromAbove) {
  make({});
  const unsigned above = medium_->add_station({0, 0, 1e9}, nullptr);
  send(*medium_, above, 0);
  for (const Receiver& receiver : receivers_) EXPECT_EQ(messages_in(receiver), 1u);
}

TEST_F(MediumTest, FollowsARobotThatMoves) {
  make({});
  medium_->move(1, 140, 0);
  send(*medium_, 0, 0);
  EXPECT_TRUE(receivers_[1].edges.empty());
  send(*medium_, 1, kPeriodNs);
  EXPECT_EQ(messages_in(receivers_[2]), 1u);
}

TEST_F(MediumTest, LosesWholeFramesForEachReceiverWithTheGivenProbability) {
  MediumSettings settings;
  settings.loss = 0.2;
  make(settings);
  constexpr unsigned kFrames = 2000;
  for (unsigned i = 0; i < kFrames; ++i) send(*medium_, 0, i * kPeriodNs);
  EXPECT_NEAR(static_cast<double>(messages_in(receivers_[1])), 1600, 80);
  EXPECT_EQ(messages_in(receivers_[1]) + medium_->counters(0).lost, kFrames);
  EXPECT_EQ(messages_in(receivers_[0]), kFrames) << "its own light does not get lost";
  EXPECT_EQ(medium_->counters(0).frames, kFrames);
}

TEST_F(MediumTest, LosesSinglePulses) {
  MediumSettings settings;
  settings.pulse_loss = 0.01;
  make(settings);
  for (unsigned i = 0; i < 300; ++i) send(*medium_, 0, i * kPeriodNs);
  const std::size_t pulses = ir_pulses(kMessage).size();
  const double survivors = 300 * std::pow(0.99, static_cast<double>(pulses));
  EXPECT_NEAR(static_cast<double>(messages_in(receivers_[1])), survivors, 40);
  for (std::size_t i = 0; i < receivers_[1].edges.size(); ++i)
    ASSERT_EQ(receivers_[1].edges[i].is_rising, i % 2 == 0) << "an edge without its partner";
}

TEST_F(MediumTest, AddsStrayPulses) {
  MediumSettings settings;
  settings.stray_pulses_per_s = 100;
  make(settings);
  medium_->advance(10'000'000'000);
  for (const Receiver& receiver : receivers_)
    EXPECT_NEAR(static_cast<double>(receiver.edges.size()) / 2, 1000, 120);
}

TEST_F(MediumTest, LosesTheSameFramesWithTheSameSeed) {
  MediumSettings settings;
  settings.loss = 0.3;
  std::size_t counts[3];
  for (std::size_t round = 0; round < 3; ++round) {
    settings.seed = round < 2 ? 7 : 8;
    receivers_[1].edges.clear();
    make(settings);
    for (unsigned i = 0; i < 500; ++i) send(*medium_, 0, i * kPeriodNs);
    counts[round] = messages_in(receivers_[1]);
  }
  EXPECT_EQ(counts[0], counts[1]);
  EXPECT_NE(counts[0], counts[2]);
}

TEST_F(MediumTest, ReportsEachMessageThatWasSent) {
  make({});
  std::vector<std::uint64_t> starts;
  medium_->on_message = [&](unsigned sender, std::uint64_t start_ns, const IrMessage& message) {
    EXPECT_EQ(sender, 0u);
    EXPECT_EQ(message, kMessage);
    starts.push_back(start_ns);
  };
  send(*medium_, 0, 5000);
  send(*medium_, 0, 5000 + kPeriodNs);
  EXPECT_EQ(starts, (std::vector<std::uint64_t>{5000, 5000 + kPeriodNs}));
}

}  // namespace
}  // namespace swarmtalk::emulator
