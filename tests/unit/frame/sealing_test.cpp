#include "frame/sealing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

namespace swarmtalk::frame {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::shared_ptr<const SwarmKey> key(std::uint8_t fill) {
  const Bytes bytes(SwarmKey::kBytes, fill);
  return std::make_shared<SwarmKey>(std::span(bytes).first<SwarmKey::kBytes>());
}

Bytes sealed(const Sealer& sealer, std::uint32_t counter, std::size_t packet_bytes = 20) {
  FrameHeader header{ProfileId::kWifi, 7, 99, counter, FramePose{1, 2, 3, 4}};
  Bytes buffer(1500);
  FrameWriter writer(buffer, header, 1500, &sealer);
  EXPECT_TRUE(writer.append(Bytes(packet_bytes, 0x5A)));
  const auto frame = writer.finish();
  return {frame.begin(), frame.end()};
}

class OpenerTest : public ::testing::Test {
 protected:
  ParseResult open(const Bytes& bytes) {
    Frame frame;
    return opener_.open(bytes, frame);
  }

  Sealer sealer_{key(1)};
  Opener opener_{key(1)};
};

TEST_F(OpenerTest, TakesEachFrameOnce) {
  const Bytes frame = sealed(sealer_, 1);
  EXPECT_EQ(open(frame), ParseResult::kOk);
  EXPECT_EQ(open(frame), ParseResult::kReplayed);
  EXPECT_EQ(open(sealed(sealer_, 2)), ParseResult::kOk);
  EXPECT_EQ(open(frame), ParseResult::kReplayed);
}

TEST_F(OpenerTest, TakesFramesOutOfOrderWithinTheWindow) {
  EXPECT_EQ(open(sealed(sealer_, 100)), ParseResult::kOk);
  EXPECT_EQ(open(sealed(sealer_, 37)), ParseResult::kOk);  // 63 behind
  EXPECT_EQ(open(sealed(sealer_, 37)), ParseResult::kReplayed);
  EXPECT_EQ(open(sealed(sealer_, 36)), ParseResult::kReplayed);  // 64 behind: cannot be told
  EXPECT_EQ(open(sealed(sealer_, 99)), ParseResult::kOk);
}

TEST_F(OpenerTest, ForgetsNothingWhenTheCounterJumps) {
  EXPECT_EQ(open(sealed(sealer_, 1)), ParseResult::kOk);
  EXPECT_EQ(open(sealed(sealer_, 4000000000u)), ParseResult::kOk);
  EXPECT_EQ(open(sealed(sealer_, 1)), ParseResult::kReplayed);
  EXPECT_EQ(open(sealed(sealer_, 3999999999u)), ParseResult::kOk);
}

TEST_F(OpenerTest, ReadsAgainWhatACaptureHasTwice) {
  const auto frame = sealed(sealer_, 7);
  EXPECT_EQ(open(frame), ParseResult::kOk);
  opener_.take_repeats();
  EXPECT_EQ(open(frame), ParseResult::kOk);
  EXPECT_EQ(open(frame), ParseResult::kOk);
}

TEST_F(OpenerTest, AForgeryDoesNotUseUpAFramesPlace) {
  const Bytes frame = sealed(sealer_, 5);
  Bytes forged = frame;
  forged.back() ^= 1;
  EXPECT_EQ(open(forged), ParseResult::kNotAuthentic);
  EXPECT_EQ(open(frame), ParseResult::kOk);
}

TEST_F(OpenerTest, AForgeryWithAFarCounterDoesNotMoveTheWindow) {
  EXPECT_EQ(open(sealed(sealer_, 5)), ParseResult::kOk);
  Bytes forged = sealed(sealer_, 6);
  forged[kCounterAt] = 0xFF;
  EXPECT_EQ(open(forged), ParseResult::kNotAuthentic);
  EXPECT_EQ(open(sealed(sealer_, 6)), ParseResult::kOk);
}

TEST_F(OpenerTest, RefusesEveryFrameWithOneBitFlipped) {
  const Bytes frame = sealed(sealer_, 1, 3);
  for (std::size_t bit = 0; bit < frame.size() * 8; ++bit) {
    Bytes flipped = frame;
    flipped[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    EXPECT_NE(open(flipped), ParseResult::kOk) << "bit " << bit;
  }
  EXPECT_EQ(open(frame), ParseResult::kOk);
}

TEST_F(OpenerTest, RefusesEveryFrameCutShort) {
  const Bytes frame = sealed(sealer_, 1);
  for (std::size_t size = 0; size < frame.size(); ++size) {
    EXPECT_NE(open(Bytes(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size))),
              ParseResult::kOk);
  }
}

TEST_F(OpenerTest, RefusesOurOwnFramesPlayedBack) {
  opener_.refuse(sealer_.session());
  EXPECT_EQ(open(sealed(sealer_, 1)), ParseResult::kReplayed);
}

TEST_F(OpenerTest, RemembersAsManySessionsAsItSays) {
  std::vector<Bytes> frames;
  for (std::size_t i = 0; i <= ReplayWindow::kSessions; ++i) {
    frames.push_back(sealed(Sealer(key(1)), 1));
  }
  for (std::size_t i = 0; i < ReplayWindow::kSessions; ++i) {
    EXPECT_EQ(open(frames[i]), ParseResult::kOk);
  }
  EXPECT_EQ(open(frames[0]), ParseResult::kReplayed);  // does not count as heard
  EXPECT_EQ(open(frames.back()), ParseResult::kOk);    // takes the place of the oldest
  EXPECT_EQ(open(frames[1]), ParseResult::kReplayed);
  EXPECT_EQ(open(frames[0]), ParseResult::kOk) << "forgotten, as the page says";
}

TEST_F(OpenerTest, ForgetsTheSessionThatWasUnheardLongest) {
  std::vector<Sealer> sealers;
  for (std::size_t i = 0; i <= ReplayWindow::kSessions; ++i) sealers.emplace_back(key(1));
  const Bytes first = sealed(sealers[0], 1);
  const Bytes second = sealed(sealers[1], 1);
  EXPECT_EQ(open(first), ParseResult::kOk);
  EXPECT_EQ(open(second), ParseResult::kOk);
  for (std::size_t i = 2; i < ReplayWindow::kSessions; ++i) {
    EXPECT_EQ(open(sealed(sealers[i], 1)), ParseResult::kOk);
  }
  EXPECT_EQ(open(sealed(sealers[0], 2)), ParseResult::kOk) << "the oldest is heard again";
  EXPECT_EQ(open(sealed(sealers.back(), 1)), ParseResult::kOk);
  EXPECT_EQ(open(first), ParseResult::kReplayed);
  EXPECT_EQ(open(second), ParseResult::kOk) << "unheard longest";
}

TEST(Sealer, HidesPoseAndPackets) {
  const Bytes frame = sealed(Sealer(key(1)), 1, 40);
  const Bytes plain(8, 0x5A);
  EXPECT_EQ(std::search(frame.begin(), frame.end(), plain.begin(), plain.end()), frame.end());
}

TEST(Sealer, DrawsASessionOfItsOwnForEachLink) {
  EXPECT_NE(Sealer(key(1)).session(), Sealer(key(1)).session());
  Sealer sealer(key(1));
  const SealSession before = sealer.session();
  sealer.draw_session();
  EXPECT_NE(sealer.session(), before);
}

TEST(FrameWriter, KeepsRoomForTheSealWithinTheLimit) {
  const Sealer sealer(key(1));
  FrameHeader header;
  header.pose = FramePose{};
  Bytes buffer(300 + kSealBytes + kFreshBytes);
  const Bytes fresh(kFreshBytes, 0);
  FrameWriter writer(buffer, header, 200, &sealer, fresh);
  const std::size_t fits = max_packet_bytes(200, true);
  EXPECT_FALSE(writer.append(Bytes(fits + 1, 1)));
  EXPECT_TRUE(writer.append(Bytes(fits, 1)));
  EXPECT_EQ(writer.finish().size(), 200U);
  EXPECT_EQ(max_packet_bytes(1500, true), 1439U);
}

TEST(SwarmKey, IdsOfTwoKeysDiffer) {
  EXPECT_NE(key(1)->id(), key(2)->id());
}

}  // namespace
}  // namespace swarmtalk::frame
