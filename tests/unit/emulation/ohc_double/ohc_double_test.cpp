#include "emulation/ohc_double/ohc_double.hpp"

#include <gtest/gtest.h>

#include "emulation/ohc_double/bench.hpp"
#include "tests/unit/emulation/ohc_double/vectors.hpp"

namespace swarmtalk::ohc_double {
namespace {

constexpr std::uint64_t kMs = 1'000'000;

class OhcDoubleTest : public testing::Test {
 protected:
  OhcDoubleTest() {
    ohc_.on_transmission = [this](const Transmission& sent) { sent_.push_back(sent); };
  }

  /// Bytes at the line's pace, from now on.
  template <class Bytes>
  void send(const Bytes& bytes) {
    for (const std::uint8_t byte : bytes) ohc_.put(byte, now_ns_ += kByteNs);
  }
  void wait_ms(double ms) { ohc_.advance(now_ns_ += static_cast<std::uint64_t>(ms * kMs)); }
  std::size_t good() const { return ohc_.counters().good; }

  OhcDouble ohc_{0};
  std::uint64_t now_ns_ = 0;
  std::vector<Transmission> sent_;
};

const std::array<std::uint8_t, 9> kData{1, 2, 3, 4, 5, 6, 7, 8, 9};

TEST_F(OhcDoubleTest, TurnsEveryVectorIntoItsInfraredMessages) {
  for (const vectors::Vector& vector : vectors::kVectors) {
    OhcDouble fresh(0);
    std::vector<std::vector<std::uint8_t>> heard;
    fresh.on_transmission = [&](const Transmission& sent) {
      heard.emplace_back(sent.message.begin(), sent.message.end());
    };
    std::uint64_t now_ns = 0;
    for (const std::uint8_t byte : vectors::frame_of(vector)) fresh.put(byte, now_ns += kByteNs);
    fresh.advance(now_ns + 9 * kMs);  // one copy
    std::vector<std::vector<std::uint8_t>> expected;
    for (const char* message : vector.messages) expected.push_back(vectors::from_hex(message));
    EXPECT_EQ(heard, expected) << vector.name;
  }
}

TEST_F(OhcDoubleTest, SendsAPageAsItsTwentyTwoMessages) {
  send(make_frame(FrameType::kBootPage, vectors::page_payload(0, 160)));
  ASSERT_EQ(sent_.size(), vectors::kPageMessages.size());
  for (std::size_t i = 0; i < sent_.size(); ++i) {
    const auto expected = vectors::from_hex(vectors::kPageMessages[i]);
    const std::vector<std::uint8_t> message(
        sent_[i].message.begin(),
        sent_[i].message.begin() + static_cast<std::ptrdiff_t>(expected.size()));
    EXPECT_EQ(message, expected) << "message " << i;
    EXPECT_EQ(sent_[i].message[8], 0);
    EXPECT_EQ(sent_[i].message[9], kIrBootPage);
    EXPECT_EQ(sent_[i].start_ns, now_ns_ + kStartNs + i * kPageMessageNs);
  }
}

TEST_F(OhcDoubleTest, RepeatsAMessageEachPassUntilStop) {
  send(make_message_frame(FrameType::kForward, kIrRun));
  const std::uint64_t accepted_ns = now_ns_;
  wait_ms(100);
  ASSERT_EQ(sent_.size(), 10u);
  for (std::size_t i = 0; i < sent_.size(); ++i)
    EXPECT_EQ(sent_[i].start_ns, accepted_ns + kStartNs + i * kPassNs);
  send(make_frame(FrameType::kStop));
  wait_ms(11);
  const std::size_t before = sent_.size();
  wait_ms(1000);
  EXPECT_EQ(sent_.size(), before);
}

TEST_F(OhcDoubleTest, SendsASingleMessageOnce) {
  send(make_message_frame(FrameType::kSingle, 0, kData));
  wait_ms(1000);
  EXPECT_EQ(good(), 1u);
}

TEST_F(OhcDoubleTest, StopsRepeatingForAnUnknownFrame) {
  send(make_message_frame(FrameType::kForward, kIrRun));
  wait_ms(20);
  send(make_frame(9));
  wait_ms(11);
  const std::size_t before = sent_.size();
  wait_ms(1000);
  EXPECT_EQ(sent_.size(), before);
}

TEST_F(OhcDoubleTest, SingleNeedsFiveMillisecondsOfSilence) {
  for (const auto& [silence_ms, expected] : {std::pair{4.0, 0u}, std::pair{5.0, 10u}}) {
    OhcDouble fresh(0);
    std::uint64_t now_ns = 0;
    for (int i = 0; i < 10; ++i) {
      for (const std::uint8_t byte : make_message_frame(FrameType::kSingle, 0, kData))
        fresh.put(byte, now_ns += kByteNs);
      now_ns += static_cast<std::uint64_t>(silence_ms * kMs);
      fresh.advance(now_ns);
    }
    // What follows the last frame is not silence that was asked for.
    fresh.put(0, now_ns += kByteNs);
    fresh.advance(now_ns + 100 * kMs);
    EXPECT_EQ(fresh.counters().good, expected) << silence_ms << " ms";
  }
}

/// Readable copies of ten messages with a silence after each, as counted on the standard image.
TEST_F(OhcDoubleTest, FramesInQuickSuccessionDamageTheLight) {
  const std::vector<std::pair<double, int>> measured = {{0, 0},   {5, 1},   {10, 5},  {15, 12},
                                                        {20, 14}, {25, 20}, {30, 25}, {40, 33}};
  for (const auto& [hold_ms, copies] : measured) {
    OhcDouble fresh(0);
    std::uint64_t now_ns = 0;
    for (int i = 0; i < 10; ++i) {
      for (const std::uint8_t byte : make_message_frame(FrameType::kForward, 0, kData))
        fresh.put(byte, now_ns += kByteNs);
      now_ns += static_cast<std::uint64_t>(hold_ms * kMs);
      fresh.advance(now_ns);
    }
    fresh.put(0, now_ns += kByteNs);
    EXPECT_NEAR(static_cast<double>(fresh.counters().good), copies, 3) << hold_ms << " ms";
  }
}

TEST_F(OhcDoubleTest, LosesBytesWhileItSendsAPage) {
  send(make_frame(FrameType::kBootPage, vectors::page_payload(0, 160)));
  EXPECT_TRUE(ohc_.is_deaf());
  send(make_frame(FrameType::kLedToggle));
  EXPECT_EQ(ohc_.counters().lost_bytes, kFrameBytes - kDeafBytes);
  wait_ms(100);
  EXPECT_FALSE(ohc_.is_led_on());
  EXPECT_EQ(ohc_.counters().frames, 1u);
}

TEST_F(OhcDoubleTest, HearsTheNextPageAfter105Milliseconds) {
  for (std::uint8_t page = 0; page < 2; ++page) {
    send(make_frame(FrameType::kBootPage, vectors::page_payload(page, 160)));
    wait_ms(105);
  }
  EXPECT_EQ(sent_.size(), 2u * kPageMessages);
  EXPECT_EQ(ohc_.counters().lost_bytes, 0u);
}

TEST_F(OhcDoubleTest, ActsOnTheLastFrameAfterItsStart) {
  OhcDouble slow;
  std::vector<Transmission> sent;
  slow.on_transmission = [&](const Transmission& one) { sent.push_back(one); };
  std::uint64_t now_ns = 100 * kMs;
  for (const std::uint8_t byte : make_frame(FrameType::kLedToggle))
    slow.put(byte, now_ns += kByteNs);
  for (const std::uint8_t byte : make_message_frame(FrameType::kForward, kIrRun))
    slow.put(byte, now_ns += kByteNs);
  slow.advance(2010 * kMs);
  EXPECT_FALSE(slow.is_repeating() && sent.empty());
  EXPECT_EQ(slow.counters().replaced_frames, 1u);
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0].start_ns, kBootNs + kStartNs);
}

TEST_F(OhcDoubleTest, CountsDangerousFalseFrames) {
  const std::array<std::uint8_t, 2> data{0x55, 0x01};
  const Frame single = make_message_frame(FrameType::kSingle, 7, data);
  send(single);
  wait_ms(8);
  send(single);
  EXPECT_EQ(ohc_.counters().false_frames, 1u);
  EXPECT_EQ(ohc_.counters().dangerous_frames, 1u);
  send(make_frame(FrameType::kStop));
  send(make_frame(FrameType::kStop));
  EXPECT_EQ(ohc_.counters().dangerous_frames, 1u);
}

TEST_F(OhcDoubleTest, TogglesItsLed) {
  send(make_frame(FrameType::kLedToggle));
  EXPECT_TRUE(ohc_.is_led_on());
  send(make_frame(FrameType::kLedToggle));
  EXPECT_FALSE(ohc_.is_led_on());
}

/// As the stock controller: what it sends puts the LED out and leaves the flag as it was.
TEST_F(OhcDoubleTest, TogglesAFlagOfItsOwnAndNotTheLight) {
  send(make_frame(FrameType::kLedToggle));
  send(make_message_frame(FrameType::kSingle, 7));
  wait_ms(20);
  EXPECT_FALSE(ohc_.is_led_on());
  send(make_frame(FrameType::kLedToggle));
  EXPECT_FALSE(ohc_.is_led_on());
  send(make_frame(FrameType::kLedToggle));
  EXPECT_TRUE(ohc_.is_led_on());
}

TEST(Bench, LoadsAProgramIntoRobotsWithLoss) {
  Bench::Settings settings;
  settings.robots = 2;
  settings.boot_ns = 0;
  settings.loss = 0.01;
  Bench bench(settings, [](const Bench::Json&) {});
  const auto send = [&](const Frame& frame, double hold_ms) {
    bench.send(frame);
    bench.wait_until(bench.now_ns() + static_cast<std::uint64_t>(hold_ms * kMs));
  };
  send(make_message_frame(FrameType::kForward, kIrBoot), 500);
  const std::array<std::uint8_t, 1> pages{2};
  for (int pass = 0; pass < 12; ++pass) {
    send(make_message_frame(FrameType::kForward, kIrBootSize, pages), 131);
    for (std::uint8_t page = 0; page < 2; ++page)
      send(make_frame(FrameType::kBootPage, vectors::page_payload(page, 160)), 131);
  }
  send(make_frame(FrameType::kStop), 50);
  for (const KilobotDouble& robot : bench.robots()) {
    EXPECT_EQ(robot.state(), KilobotDouble::State::kIdle);
    EXPECT_EQ(robot.starts(), 2u);
    for (unsigned i = 0; i < 160; ++i)
      ASSERT_EQ(robot.flash()[i], static_cast<std::uint8_t>(7 * i + 3)) << "byte " << i;
  }
}

}  // namespace
}  // namespace swarmtalk::ohc_double
