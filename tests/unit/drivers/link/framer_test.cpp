#include "drivers/link/framer.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/unit/drivers/test_link_user.hpp"

namespace swarmtalk::drivers {
namespace {

constexpr std::size_t kMaxPacketBytes = 200;
constexpr std::size_t kLimitBytes = 500;

class FramerTest : public ::testing::Test {
 protected:
  BuiltFrame build() {
    buffer_.assign(builder_.buffer_bytes(kLimitBytes), 0xEE);
    const BuiltFrame built = builder_.build(sender_, buffer_, kLimitBytes, counters_);
    buffer_.resize(built.size_bytes);
    return built;
  }

  void receive(const Bytes& frame) {
    receiver_.receive(frame, {MonotonicTime(std::chrono::seconds(5))}, hearer_, counters_);
  }

  TestLinkUser sender_{11};
  TestLinkUser hearer_{22};
  FrameBuilder builder_{frame::ProfileId::kKilobot, kMaxPacketBytes};
  FrameReceiver receiver_{frame::ProfileId::kKilobot};
  LinkCounters counters_;
  Bytes buffer_;
};

TEST_F(FramerTest, BuildsNothingWhenNothingWaits) {
  const BuiltFrame built = build();
  EXPECT_EQ(built.size_bytes, 0U);
  EXPECT_FALSE(built.more_waits);
}

TEST_F(FramerTest, PutsAllThatWaitsIntoOneFrame) {
  for (std::uint32_t i = 0; i < 10; ++i) sender_.waiting.push_back(numbered_packet(i, 20));
  const BuiltFrame built = build();
  EXPECT_EQ(built.packets, 10U);
  EXPECT_FALSE(built.more_waits);
  receive(buffer_);
  ASSERT_EQ(hearer_.received.size(), 10U);
  EXPECT_EQ(hearer_.received[9], numbered_packet(9, 20));
}

TEST_F(FramerTest, OpensTheNextFrameWithThePacketThatDoesNotFit) {
  for (std::uint32_t i = 0; i < 5; ++i) sender_.waiting.push_back(numbered_packet(i, 200));
  EXPECT_EQ(build().packets, 2U);
  receive(buffer_);
  const BuiltFrame second = build();
  EXPECT_EQ(second.packets, 2U);
  EXPECT_TRUE(second.more_waits);
  receive(buffer_);
  EXPECT_EQ(build().packets, 1U);
  receive(buffer_);
  ASSERT_EQ(hearer_.received.size(), 5U);
  for (std::uint32_t i = 0; i < 5; ++i) EXPECT_EQ(hearer_.received[i], numbered_packet(i, 200));
}

TEST_F(FramerTest, TellsOfAFrameOnceWhateverItHolds) {
  for (std::uint32_t i = 0; i < 3; ++i) sender_.waiting.push_back(numbered_packet(i, 20));
  build();
  receiver_.receive(buffer_, {MonotonicTime(std::chrono::seconds(5)), 0, true, 0xABCD}, hearer_,
                    counters_);
  ASSERT_EQ(hearer_.frames.size(), 1U);
  EXPECT_EQ(hearer_.frames[0].transmitter, 11);
  EXPECT_EQ(hearer_.frames[0].hardware, 0xABCDU);
}

TEST_F(FramerTest, OwnFrameThatComesBackIsAnEcho) {
  sender_.waiting.push_back(numbered_packet(0, 20));
  build();
  sender_.knows_itself = true;
  receiver_.receive(buffer_, {}, sender_, counters_);
  EXPECT_EQ(counters_.own_echoes, 1U);
  EXPECT_EQ(counters_.frames_received, 0U);
  EXPECT_TRUE(sender_.received.empty());
  EXPECT_TRUE(sender_.frames.empty());
}

TEST_F(FramerTest, BeaconTellsTheLastMessagesThatFit) {
  for (std::uint16_t i = 0; i < 100; ++i) sender_.last.push_back({i, 70000u + i});
  buffer_.resize(builder_.buffer_bytes(kLimitBytes));
  buffer_.resize(builder_.build_beacon(sender_, buffer_, kLimitBytes).size_bytes);
  receive(buffer_);
  ASSERT_EQ(hearer_.last_heard.size(), (kLimitBytes - frame::kHeaderBytes) / 6);
  EXPECT_EQ(hearer_.last_heard[79], (frame::LastMessage{79, 70079}));
  EXPECT_TRUE(hearer_.received.empty());
  EXPECT_EQ(hearer_.frames.size(), 1U);
  EXPECT_EQ(hearer_.frames[0].frame_counter, 1U);
}

TEST_F(FramerTest, BeaconWithoutMessagesIsAFrameWithoutPackets) {
  buffer_.resize(builder_.buffer_bytes(kLimitBytes));
  buffer_.resize(builder_.build_beacon(sender_, buffer_, kLimitBytes).size_bytes);
  EXPECT_EQ(buffer_.size(), frame::kHeaderBytes);
  EXPECT_EQ(buffer_[3], 0) << "flags: what every receiver knows";
  receive(buffer_);
  EXPECT_EQ(hearer_.frames.size(), 1U);
}

TEST_F(FramerTest, PieceOfALastMessageIsCounted) {
  sender_.last = {{1, 1}, {2, 2}};
  buffer_.resize(builder_.buffer_bytes(kLimitBytes));
  buffer_.resize(builder_.build_beacon(sender_, buffer_, kLimitBytes).size_bytes);
  buffer_[5] = static_cast<std::uint8_t>(buffer_[5] - 1);  // the length
  receive(buffer_);
  EXPECT_EQ(hearer_.last_heard.size(), 1U);
  EXPECT_EQ(counters_.frames_bad_packet_length, 1U);
}

TEST_F(FramerTest, FillsAFrameToItsLastByte) {
  const std::size_t header_bytes = frame::kHeaderBytes + frame::kLengthPrefixBytes;
  for (const std::size_t size :
       {std::size_t{200}, std::size_t{200}, kLimitBytes - header_bytes - 404}) {
    sender_.waiting.push_back(numbered_packet(1, size));
  }
  EXPECT_EQ(build().size_bytes, kLimitBytes);
}

TEST_F(FramerTest, LeavesAPacketThatDoesNotFitWhereItsWaitIsMeasured) {
  for (std::uint32_t i = 0; i < 3; ++i) sender_.waiting.push_back(numbered_packet(i, 200));
  const BuiltFrame built = build();
  EXPECT_EQ(built.packets, 2U);
  EXPECT_TRUE(built.more_waits);
  EXPECT_EQ(sender_.waiting.size(), 1U);
}

TEST_F(FramerTest, CountsFramesFromOne) {
  sender_.waiting.push_back(numbered_packet(1, 10));
  build();
  receive(buffer_);
  sender_.waiting.push_back(numbered_packet(2, 10));
  build();
  receive(buffer_);
  ASSERT_EQ(hearer_.receptions.size(), 2U);
  EXPECT_EQ(hearer_.receptions[0].frame_counter, 1U);
  EXPECT_EQ(hearer_.receptions[1].frame_counter, 2U);
}

TEST_F(FramerTest, HandsUpWhatTheFrameSays) {
  sender_.header.pose = frame::FramePose{1, 2, 3, 4};
  sender_.waiting.push_back(numbered_packet(1, 10));
  build();
  receive(buffer_);
  ASSERT_EQ(hearer_.receptions.size(), 1U);
  const FrameReception& reception = hearer_.receptions[0];
  EXPECT_EQ(reception.transmitter, 11);
  EXPECT_EQ(reception.transmitter_epoch, sender_.header.epoch);
  EXPECT_EQ(reception.pose, sender_.header.pose);
  EXPECT_EQ(reception.received_at, MonotonicTime(std::chrono::seconds(5)));
}

TEST_F(FramerTest, DropsAndCountsAPacketThatFitsIntoNoFrame) {
  buffer_.assign(builder_.buffer_bytes(100), 0);
  sender_.waiting.push_back(numbered_packet(1, 150));
  sender_.waiting.push_back(numbered_packet(2, 50));
  const BuiltFrame built = builder_.build(sender_, buffer_, 100, counters_);
  EXPECT_EQ(built.packets, 1U);
  EXPECT_EQ(counters_.packets_over_mtu, 1U);
}

TEST_F(FramerTest, SaysThatMoreWaitsAfterManyDrops) {
  for (std::uint32_t i = 0; i < 100; ++i) sender_.waiting.push_back(numbered_packet(i, 150));
  buffer_.assign(builder_.buffer_bytes(100), 0);
  EXPECT_TRUE(builder_.build(sender_, buffer_, 100, counters_).more_waits);
  EXPECT_FALSE(builder_.build(sender_, buffer_, 100, counters_).more_waits);
  EXPECT_EQ(counters_.packets_over_mtu, 100U);
}

TEST_F(FramerTest, CountsAFrameOfAnotherProfile) {
  sender_.waiting.push_back(numbered_packet(1, 10));
  build();
  FrameReceiver(frame::ProfileId::kWifi).receive(buffer_, {}, hearer_, counters_);
  EXPECT_EQ(counters_.frames_other_profile, 1U);
  EXPECT_TRUE(hearer_.received.empty());
}

TEST_F(FramerTest, CountsWhatItCannotReadByCause) {
  struct {
    std::size_t at;
    std::uint8_t byte;
    std::uint64_t LinkCounters::*counted;
  } const kCauses[] = {{0, 0, &LinkCounters::frames_not_ours},
                       {2, 99, &LinkCounters::frames_other_version},
                       {3, 0x80, &LinkCounters::frames_unknown_flags},
                       {3, 0x02, &LinkCounters::frames_sealed},
                       {4, 0xFF, &LinkCounters::frames_truncated}};
  for (const auto& cause : kCauses) {
    counters_ = {};
    sender_.waiting.push_back(numbered_packet(0, 200));
    build();
    buffer_[cause.at] = cause.byte;
    receive(buffer_);
    EXPECT_EQ(counters_.*cause.counted, 1U) << cause.at;
    std::uint64_t all = 0;
    for (const auto& [name, value] : counters_.list()) {
      all += name.starts_with("frames_") && name != "frames_sent" ? value : 0;
    }
    EXPECT_EQ(all, 1U) << cause.at;
  }
  EXPECT_TRUE(hearer_.received.empty());
  EXPECT_TRUE(hearer_.frames.empty());
}

TEST_F(FramerTest, KeepsThePacketsBeforeABadLength) {
  sender_.waiting.push_back(numbered_packet(1, 10));
  sender_.waiting.push_back(numbered_packet(2, 10));
  build();
  buffer_[frame::kHeaderBytes + 2 + 10] = 0xFF;  // high byte of the second packet's length
  receive(buffer_);
  EXPECT_EQ(hearer_.received.size(), 1U);
  EXPECT_EQ(counters_.frames_bad_packet_length, 1U);
}

class SealedFramerTest : public FramerTest {
 protected:
  SealedFramerTest() {
    use_key(key_, builder_, other_receiver_);
    use_key(key_, other_builder_, receiver_);
  }

  static std::shared_ptr<const frame::SwarmKey> new_key(std::uint8_t fill) {
    const Bytes bytes(frame::SwarmKey::kBytes, fill);
    return std::make_shared<frame::SwarmKey>(std::span(bytes).first<frame::SwarmKey::kBytes>());
  }

  std::shared_ptr<const frame::SwarmKey> key_ = new_key(1);
  FrameBuilder other_builder_{frame::ProfileId::kKilobot, kMaxPacketBytes};
  FrameReceiver other_receiver_{frame::ProfileId::kKilobot};
};

TEST_F(SealedFramerTest, PacketsCrossWithinTheLimit) {
  for (std::uint32_t i = 0; i < 5; ++i) sender_.waiting.push_back(numbered_packet(i, 200));
  while (build().size_bytes > 0) {
    EXPECT_LE(buffer_.size(), kLimitBytes);
    receive(buffer_);
  }
  ASSERT_EQ(hearer_.received.size(), 5U);
  EXPECT_EQ(hearer_.received[4], numbered_packet(4, 200));
}

TEST_F(SealedFramerTest, BeaconIsSealedToo) {
  sender_.last = {{7, 70000}};
  buffer_.resize(builder_.buffer_bytes(kLimitBytes));
  buffer_.resize(builder_.build_beacon(sender_, buffer_, kLimitBytes).size_bytes);
  receive(buffer_);
  ASSERT_EQ(hearer_.last_heard.size(), 1U);
  EXPECT_EQ(hearer_.last_heard[0], (frame::LastMessage{7, 70000}));
  EXPECT_EQ(buffer_.size(), frame::kHeaderBytes + frame::kSealBytes + 6);
}

TEST_F(SealedFramerTest, CountsWhatItRefusesByCause) {
  sender_.waiting.push_back(numbered_packet(0, 20));
  build();
  const Bytes good = buffer_;
  Bytes damaged = good;
  damaged.back() ^= 1;
  receive(damaged);
  EXPECT_EQ(counters_.frames_not_authentic, 1U);
  receive(good);
  receive(good);
  EXPECT_EQ(counters_.frames_replayed, 1U);
  other_receiver_.receive(good, {}, hearer_, counters_);
  EXPECT_EQ(counters_.frames_replayed, 2U) << "its own session";
  sender_.knows_itself = true;
  other_receiver_.receive(good, {}, sender_, counters_);
  EXPECT_EQ(counters_.own_echoes, 1U) << "and its own id";
  use_key(new_key(2), other_builder_, receiver_);
  receive(good);
  EXPECT_EQ(counters_.frames_other_key, 1U);
  use_key(nullptr, other_builder_, receiver_);
  receive(good);
  EXPECT_EQ(counters_.frames_sealed, 1U);
  use_key(key_, other_builder_, receiver_);
  use_key(nullptr, builder_, other_receiver_);
  sender_.waiting.push_back(numbered_packet(1, 20));
  build();
  receive(buffer_);
  EXPECT_EQ(counters_.frames_without_key, 1U);
  EXPECT_EQ(hearer_.received.size(), 1U);
  EXPECT_EQ(counters_.frames_received, 1U);
}

/// Two robots whose frames are fresh: `builder_` and `receiver_` are of different ones.
class FreshFramerTest : public SealedFramerTest {
 protected:
  FreshFramerTest() {
    use_key_freshly(key_, nullptr, 11, now_, ours_, builder_, other_receiver_);
    use_key_freshly(key_, nullptr, 22, now_, theirs_, other_builder_, receiver_);
  }

  /// The sender's next frame arrives. @return its bytes, 0 if there was none
  std::size_t send() {
    buffer_.assign(builder_.buffer_bytes(kLimitBytes), 0xEE);
    buffer_.resize(builder_.build(sender_, buffer_, kLimitBytes, counters_, now_).size_bytes);
    if (!buffer_.empty()) receiver_.receive(buffer_, {now_}, hearer_, counters_);
    return buffer_.size();
  }
  /// A frame without packets the other way.
  void answer() {
    Bytes frame(other_builder_.buffer_bytes(kLimitBytes));
    frame.resize(other_builder_.build_beacon(hearer_, frame, kLimitBytes, now_).size_bytes);
    other_receiver_.receive(frame, {now_}, sender_, other_counters_);
  }

  MonotonicTime now_{std::chrono::seconds(100)};
  std::shared_ptr<frame::Freshness> ours_, theirs_;
  LinkCounters other_counters_;
};

TEST_F(FreshFramerTest, PacketsCrossOnceTheOthersNonceWasSentBack) {
  sender_.waiting.push_back(numbered_packet(0, 20));
  send();
  EXPECT_EQ(counters_.frames_not_proven, 1U);
  answer();
  sender_.waiting.push_back(numbered_packet(1, 20));
  EXPECT_LE(send(), kLimitBytes);
  ASSERT_EQ(hearer_.received.size(), 1U);
  EXPECT_EQ(hearer_.received[0], numbered_packet(1, 20));
  receiver_.receive(buffer_, {now_}, hearer_, counters_);
  EXPECT_EQ(counters_.frames_replayed, 1U);
  sender_.waiting.push_back(numbered_packet(2, 20));
  buffer_.assign(builder_.buffer_bytes(kLimitBytes), 0);
  buffer_.resize(builder_.build(sender_, buffer_, kLimitBytes, counters_, now_).size_bytes);
  receiver_.receive(buffer_, {now_ + std::chrono::seconds(60)}, hearer_, counters_);
  EXPECT_EQ(counters_.frames_too_old, 1U);
  EXPECT_EQ(hearer_.received.size(), 1U);
}

TEST_F(FreshFramerTest, LongPacketsAreNotDroppedForManyNonces) {
  answer();
  for (std::uint32_t i = 0; i < 60; ++i) {  // as if as many robots were heard
    const auto stranger = std::make_shared<frame::Freshness>(
        frame::voice_of({static_cast<std::uint8_t>(i), 9, 9, 9, 9, 9}, i), milliseconds(now_),
        frame::draw_random);
    Bytes plaintext(frame::kFreshBytes);
    stranger->write(milliseconds(now_), plaintext);
    std::size_t used = 0;
    ours_->receive(frame::voice_of({static_cast<std::uint8_t>(i), 9, 9, 9, 9, 9}, i), 1, plaintext,
                   milliseconds(now_), used);
  }
  for (std::uint32_t i = 0; i < 6; ++i) sender_.waiting.push_back(numbered_packet(i, 200));
  for (int frames = 0; frames < 10; ++frames) EXPECT_LE(send(), kLimitBytes);
  EXPECT_EQ(hearer_.received.size(), 6U);
  EXPECT_EQ(counters_.packets_over_mtu, 0U);
}

TEST_F(FreshFramerTest, AnotherKeyLosesNoFrame) {
  answer();
  const auto other_key = new_key(2);
  std::uint32_t sent = 0;
  const auto step = [&](const auto& first, const auto& second) {
    use_key_freshly(first, second, 22, now_, theirs_, other_builder_, receiver_);
    sender_.waiting.push_back(numbered_packet(sent++, 20));
    send();
    use_key_freshly(first, second, 11, now_, ours_, builder_, other_receiver_);
    sender_.waiting.push_back(numbered_packet(sent++, 20));
    send();
  };
  step(key_, other_key);
  step(other_key, key_);
  step(other_key, std::shared_ptr<const frame::SwarmKey>());
  EXPECT_EQ(hearer_.received.size(), sent);
  EXPECT_EQ(counters_.frames_other_key, 0U);
}

TEST_F(FreshFramerTest, WhatAnOlderReleaseSealedIsCountedAsThat) {
  FrameBuilder old_builder(frame::ProfileId::kKilobot, kMaxPacketBytes);
  FrameReceiver old_receiver(frame::ProfileId::kKilobot);
  use_key(key_, old_builder, old_receiver);
  sender_.waiting.push_back(numbered_packet(0, 20));
  buffer_.assign(old_builder.buffer_bytes(kLimitBytes), 0);
  buffer_.resize(old_builder.build(sender_, buffer_, kLimitBytes, counters_).size_bytes);
  receiver_.receive(buffer_, {now_}, hearer_, counters_);
  EXPECT_EQ(counters_.frames_not_fresh, 1U);
  EXPECT_TRUE(hearer_.received.empty());
  sender_.waiting.push_back(numbered_packet(1, 20));
  buffer_.assign(builder_.buffer_bytes(kLimitBytes), 0);
  buffer_.resize(builder_.build(sender_, buffer_, kLimitBytes, counters_, now_).size_bytes);
  old_receiver.receive(buffer_, {now_}, hearer_, counters_);
  EXPECT_EQ(hearer_.received.size(), 1U) << "a link that does not check takes fresh ones as well";
}

}  // namespace
}  // namespace swarmtalk::drivers
