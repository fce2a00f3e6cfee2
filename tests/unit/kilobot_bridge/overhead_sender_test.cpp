#include "kilobot_bridge/overhead_sender.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include <deque>
#include <map>
#include <utility>

#include "emulation/ohc_double/bench.hpp"

namespace swarmtalk::kilobot_bridge {
namespace {

using namespace std::chrono_literals;
using ohc_double::Bench;
using ohc_double::kByteNs;
using Time = OverheadSender::Time;

/// A sender, a line of 38400 baud and a controller's double at its end, in virtual time.
class SenderTest : public testing::Test, public OverheadLine, public FrameSource {
 protected:
  explicit SenderTest() {
    settings_.boot_ns = 0;
    settings_.robots = 2;
    bench_.emplace(settings_, [this](const Bench::Json& event) {
      if (event["event"] == "infrared" && !event["damaged"]) {
        ++copies_[event["hex"].get<std::string>()];
      }
    });
  }

  std::size_t write_line(std::span<const std::uint8_t> bytes) override {
    if (is_blocked_) return 0;
    std::uint64_t at = std::max(line_free_ns_, now_ns_);
    for (const std::uint8_t byte : bytes) {
      at += kByteNs;
      line_.emplace_back(at, byte);
    }
    const std::size_t type_at = bytes.size() - kOverheadFrameBytes + 1;
    if (bytes[type_at] == 0 && std::exchange(loses_a_byte_of_stop_, false)) line_.pop_back();
    line_free_ns_ = at;
    return bytes.size();
  }
  bool is_drained() override { return now_ns_ >= line_free_ns_; }
  std::optional<TimedFrame> next_frame() override {
    if (waiting_.empty()) return std::nullopt;
    const TimedFrame frame = waiting_.front();
    waiting_.pop_front();
    ++asked_;
    return frame;
  }

  Time time() const { return Time(std::chrono::nanoseconds(now_ns_)); }
  /// Lets `duration` pass: polls when the sender asks for it, and when a frame was added.
  void run(Duration duration) {
    const std::uint64_t end_ns = now_ns_ + static_cast<std::uint64_t>(duration.count());
    for (;;) {
      const Time next = sender_.poll(time());
      const auto next_ns = static_cast<std::uint64_t>(next.time_since_epoch().count());
      const std::uint64_t then_ns = std::min(next == Time::max() ? end_ns : next_ns, end_ns);
      deliver(then_ns);
      now_ns_ = std::max(now_ns_, then_ns);
      if (now_ns_ >= end_ns) return;
    }
  }
  void deliver(std::uint64_t until_ns) {
    while (!line_.empty() && line_.front().first <= until_ns) {
      bench_->put(line_.front().second, line_.front().first);
      line_.pop_front();
    }
    bench_->wait_until(until_ns);
  }
  void open() {
    sender_.open(time(), 0ms);
    run(100ms);
  }
  static TimedFrame user_frame(unsigned number) {
    return {forward_frame(2, {static_cast<std::uint8_t>(number),
                              static_cast<std::uint8_t>(number >> 8), 0x55, 1, 0x55}),
            0ms};
  }
  Bench::Json state() const { return bench_->state(); }

  Bench::Settings settings_;
  std::optional<Bench> bench_;
  std::map<std::string, unsigned> copies_;  // undamaged ones of each infrared message
  Pacing pacing_;
  OverheadSender sender_{pacing_, *this, *this};
  std::deque<TimedFrame> waiting_;
  std::deque<std::pair<std::uint64_t, std::uint8_t>> line_;
  std::uint64_t now_ns_ = 0;
  std::uint64_t line_free_ns_ = 0;
  unsigned asked_ = 0;
  bool is_blocked_ = false;
  bool loses_a_byte_of_stop_ = false;  // of the next one
};

constexpr unsigned kRateHz = 14;

TEST_F(SenderTest, HoldsFourteenMessagesPerSecondInThreeCopiesForTenMinutes) {
  open();
  const unsigned messages = kRateHz * 600;
  for (unsigned i = 0; i < messages; ++i) waiting_.push_back(user_frame(i));
  run(600s);
  EXPECT_EQ(asked_, messages) << "the rate is not held";
  run(1s);
  ASSERT_EQ(copies_.size(), messages) << "a message was not heard at all";
  unsigned least = UINT_MAX;
  for (const auto& [hex, count] : copies_) least = std::min(least, count);
  EXPECT_GE(least, pacing_.copies);
  EXPECT_EQ(state()["dangerous_frames"], 0);
  EXPECT_EQ(state()["lost_bytes"], 0);
  EXPECT_EQ(state()["replaced_frames"], 0);
  EXPECT_FALSE(state()["repeating"]) << "the controller was left repeating";
}

TEST_F(SenderTest, LosesMessagesToTheDamageRuleWhenItDoesNotPace) {
  pacing_.silences = {0ms, 0ms, 0ms, 0ms, 0ms, 0ms, 0ms};
  open();
  for (unsigned i = 0; i < 200; ++i) waiting_.push_back(user_frame(i));
  run(60s);
  EXPECT_EQ(asked_, 200u);
  EXPECT_LT(copies_.size(), 10u) << "the double lets an unpaced bridge pass";
}

TEST_F(SenderTest, SendsTwentyThreeSingleMessagesPerSecondUndamaged) {
  open();
  for (unsigned i = 0; i < 230; ++i) {
    waiting_.push_back({forward_single_frame(2, {static_cast<std::uint8_t>(i)}), 0ms});
  }
  run(10s);
  EXPECT_EQ(asked_, 230u);
  run(1s);
  EXPECT_EQ(state()["good"], 230);
  EXPECT_EQ(state()["damaged"], 0);
}

TEST_F(SenderTest, SendsProgramPagesWithoutALostByte) {
  open();
  std::vector<std::uint8_t> image(40 * 128, 0x55);
  const Sequence program = program_sequence(image, 1, false);
  for (const TimedFrame& frame : program.repeated) waiting_.push_back(frame);
  run(60s);
  EXPECT_EQ(asked_, 41u);
  EXPECT_EQ(state()["lost_bytes"], 0);
  EXPECT_EQ(state()["dangerous_frames"], 0);
}

TEST_F(SenderTest, LoadsAProgramByteForByteAndItWaitsForRun) {
  open();
  std::vector<std::uint8_t> image(1000);
  for (std::size_t i = 0; i < image.size(); ++i) image[i] = static_cast<std::uint8_t>(7 * i + 3);
  const auto play = [&](Sequence sequence) {
    Player player(std::move(sequence), pacing_);
    while (const auto frame = player.next()) waiting_.push_back(*frame);
    run(60s);
  };
  play(program_sequence(image, 3, false));
  const auto& robot = bench_->robots().at(1);
  EXPECT_TRUE(std::equal(image.begin(), image.end(), robot.flash().begin()));
  EXPECT_EQ(robot.starts(), 2u) << "the program begins anew";
  EXPECT_EQ(robot.state(), ohc_double::KilobotDouble::State::kIdle);
  play(command_sequence(Command::kRun));
  EXPECT_EQ(robot.state(), ohc_double::KilobotDouble::State::kRunning);
  EXPECT_EQ(state()["dangerous_frames"], 0);
}

TEST_F(SenderTest, EndsARepetitionWithStopWhenNothingFollows) {
  open();
  waiting_.push_back(user_frame(1));
  run(10s);
  EXPECT_FALSE(state()["repeating"]);
  EXPECT_GE(copies_.size(), 1u);
  const auto good = state()["good"].get<unsigned>();
  EXPECT_GE(good, 3u);
  EXPECT_LE(good, 8u);
}

TEST_F(SenderTest, EndsARepetitionThoughAByteOfStopIsLost) {
  open();
  waiting_.push_back(user_frame(1));
  loses_a_byte_of_stop_ = true;
  run(1s);
  EXPECT_FALSE(loses_a_byte_of_stop_);
  EXPECT_FALSE(state()["repeating"]);
  EXPECT_EQ(sender_.counters().frames, 1u + 1 + 2)
      << "one STOP after opening, two for the repetition";
  EXPECT_EQ(state()["dangerous_frames"], 0);
}

TEST_F(SenderTest, IsSilentWhileTheControllerStartsAndThenSaysStop) {
  sender_.open(time(), 3500ms);
  waiting_.push_back(user_frame(1));
  run(3400ms);
  EXPECT_EQ(line_free_ns_, 0u) << "something was sent";
  EXPECT_FALSE(sender_.is_ready());
  run(200ms);
  EXPECT_TRUE(sender_.is_ready());
  EXPECT_EQ(sender_.counters().frames, 2u) << "STOP and the message";
}

TEST_F(SenderTest, LastWordsAreTwoStops) {
  open();
  const auto bytes = sender_.last_words();
  ASSERT_GE(bytes.size(), 2 * kOverheadFrameBytes);
  const auto stop = stop_frame();
  EXPECT_TRUE(std::equal(stop.begin(), stop.end(), bytes.end() - kOverheadFrameBytes));
  const auto first = std::search(bytes.begin(), bytes.end(), stop.begin(), stop.end());
  EXPECT_LE(first + kOverheadFrameBytes, bytes.end() - kOverheadFrameBytes) << "one behind another";
  sender_.close();
  EXPECT_TRUE(sender_.last_words().empty());
}

TEST_F(SenderTest, WithholdsWhatMustNotLeave) {
  open();
  waiting_.push_back({page_frame(220, {}), 0ms});
  waiting_.push_back({page_frame(255, {}), 0ms});
  waiting_.push_back({forward_frame(0x8B), 0ms});
  waiting_.push_back({forward_frame(0x81), 0ms});
  waiting_.push_back(user_frame(1));
  run(1s);
  EXPECT_EQ(sender_.counters().withheld_frames, 4u);
  EXPECT_EQ(copies_.size(), 1u);
}

TEST_F(SenderTest, KeepsAHoldAndCutsItShortWhenAsked) {
  open();
  waiting_.push_back({forward_frame(0x85), 12s});
  run(2s);
  waiting_.push_back({stop_frame(), 0ms});
  run(2s);
  EXPECT_TRUE(state()["repeating"]);
  sender_.cut_hold();
  run(50ms);
  EXPECT_FALSE(state()["repeating"]);
}

TEST_F(SenderTest, SaysWhenTheLineTakesNoBytes) {
  open();
  is_blocked_ = true;
  waiting_.push_back(user_frame(1));
  run(400ms);
  EXPECT_FALSE(sender_.has_stalled());
  run(400ms);
  EXPECT_TRUE(sender_.has_stalled());
  // Opened again, it is as one that never stalled.
  sender_.close();
  EXPECT_FALSE(sender_.has_stalled());
  is_blocked_ = false;
  sender_.open(time(), 0ms);
  EXPECT_FALSE(sender_.is_ready());
  run(200ms);
  EXPECT_TRUE(sender_.is_ready());
  const int asked = asked_;
  waiting_.push_back(user_frame(2));
  run(200ms);
  EXPECT_EQ(asked_, asked + 1);
  EXPECT_FALSE(sender_.has_stalled());
}

TEST_F(SenderTest, WaitsLongerForASlowController) {
  pacing_.time_scale = 0.5;
  sender_.open(time(), 0ms);
  run(1s);
  const std::uint64_t before_ns = now_ns_;
  waiting_.push_back(user_frame(1));
  waiting_.push_back(user_frame(2));
  while (asked_ < 2) run(1ms);
  EXPECT_NEAR(static_cast<double>(now_ns_ - before_ns) / 1e6, 2 * (34.4 + 35.8), 3);
}

}  // namespace
}  // namespace swarmtalk::kilobot_bridge
