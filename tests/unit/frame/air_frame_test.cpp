#include "frame/air_frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <string_view>
#include <vector>

namespace swarmtalk::frame {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr double kPi = std::numbers::pi;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(FramePose, RoundsToTheNearestStep) {
  const FramePose pose = FramePose::from_metres(1.2344, -0.0006, kPi / 2.0, 0.026);
  EXPECT_EQ(pose.x_mm, 1234);
  EXPECT_EQ(pose.y_mm, -1);
  EXPECT_EQ(pose.theta_turns16, 16384);
  EXPECT_EQ(pose.age_10ms, 3);
}

TEST(FramePose, TakesAnglesModuloATurn) {
  EXPECT_EQ(FramePose::from_metres(0, 0, -kPi / 2, 0).theta_turns16, 49152);
  EXPECT_EQ(FramePose::from_metres(0, 0, 2 * kPi - 1e-9, 0).theta_turns16, 0);
  EXPECT_EQ(FramePose::from_metres(0, 0, 7 * kPi, 0).theta_turns16, 32768);
}

TEST(FramePose, GivesAnglesBetweenMinusPiAndPi) {
  EXPECT_DOUBLE_EQ((FramePose{0, 0, 32768, 0}.theta_rad()), kPi);
  EXPECT_LT((FramePose{0, 0, 32769, 0}.theta_rad()), 0.0);
  EXPECT_DOUBLE_EQ((FramePose{0, 0, 49152, 0}.theta_rad()), -kPi / 2);
}

TEST(FramePose, SaturatesTheAgeBelowStale) {
  EXPECT_EQ(FramePose::from_metres(0, 0, 0, 2.53).age_10ms, 253);
  EXPECT_EQ(FramePose::from_metres(0, 0, 0, 2.55).age_10ms, FramePose::kOldest);
  EXPECT_EQ(FramePose::from_metres(0, 0, 0, 1e9).age_10ms, FramePose::kOldest);
  EXPECT_EQ(FramePose::from_metres(0, 0, 0, -1.0).age_10ms, 0);
}

TEST(FramePose, IsStaleBeyondTheRangeOfTheWire) {
  EXPECT_FALSE(FramePose::from_metres(32.767, -32.767, 0, 0).is_stale());
  EXPECT_TRUE(FramePose::from_metres(32.768, 0, 0, 0).is_stale());
  EXPECT_TRUE(FramePose::from_metres(0, -32.768, 0, 0).is_stale());
}

TEST(FramePose, IsStaleWhenAnythingIsUnknown) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(FramePose::from_metres(kNan, 0, 0, 0).is_stale());
  EXPECT_TRUE(FramePose::from_metres(0, kInfinity, 0, 0).is_stale());
  EXPECT_TRUE(FramePose::from_metres(0, 0, kNan, 0).is_stale());
  EXPECT_TRUE(FramePose::from_metres(0, 0, 0, kNan).is_stale());
}

// By hand from docs/wire-format.md, beacons.
const Bytes kBeacon{0x53, 0x54, 1,    0x05, 0,    37,   0,
                    0,                                   // magic, version, flags, length, profile
                    0x01, 0x02, 0x0A, 0x0B, 0x0C, 0x0D,  // node, epoch
                    0,    0,    0,    9,                 // counter
                    0x03, 0xE8, 0xFF, 0x06, 0x40, 0x00, 3,  // pose
                    0x00, 0x07, 0x00, 0x01, 0x11, 0x70,     // channel 7: 70000
                    0xA0, 0x28, 0x00, 0x00, 0x00, 0x01};    // channel 41000: 1

TEST(Beacon, IsWrittenAsTheManualSays) {
  FrameHeader header;
  header.node = 0x0102;
  header.epoch = 0x0A0B0C0D;
  header.counter = 9;
  header.pose = FramePose{1000, -250, 16384, 3};
  header.is_beacon = true;
  Bytes buffer(kBeacon.size());
  FrameWriter writer(buffer, header, buffer.size());
  EXPECT_TRUE(writer.append_last({7, 70000}));
  EXPECT_TRUE(writer.append_last({41000, 1}));
  EXPECT_FALSE(writer.append_last({1, 1})) << "no room";
  writer.finish();
  EXPECT_EQ(buffer, kBeacon);
}

TEST(Beacon, IsReadAsTheManualSays) {
  Frame frame;
  ASSERT_EQ(parse(kBeacon, frame), ParseResult::kOk);
  EXPECT_TRUE(frame.header.is_beacon);
  EXPECT_TRUE(frame.packets.empty());
  LastMessageReader reader(frame.last_messages);
  LastMessage last;
  ASSERT_TRUE(reader.next(last));
  EXPECT_EQ(last, (LastMessage{7, 70000}));
  ASSERT_TRUE(reader.next(last));
  EXPECT_EQ(last, (LastMessage{41000, 1}));
  EXPECT_FALSE(reader.next(last));
  EXPECT_FALSE(reader.is_malformed());
}

TEST(FrameWriter, LeavesAPacketThatDoesNotFitReadableInTheRoom) {
  Bytes buffer(200);
  FrameWriter writer(buffer, FrameHeader{}, 100);
  ASSERT_GE(writer.room().size(), 81U);
  writer.room()[0] = 0x77;
  EXPECT_FALSE(writer.commit(100 - kHeaderBytes - kLengthPrefixBytes + 1));
  EXPECT_EQ(writer.packets(), 0U);
  EXPECT_EQ(writer.room()[0], 0x77);
  EXPECT_TRUE(writer.commit(100 - kHeaderBytes - kLengthPrefixBytes));
  EXPECT_EQ(writer.finish().size(), 100U);
}

TEST(FrameWriter, RefusesAnEmptyPacket) {
  Bytes buffer(200);
  FrameWriter writer(buffer, FrameHeader{}, 200);
  EXPECT_FALSE(writer.commit(0));
  EXPECT_FALSE(writer.append({}));
}

TEST(FrameWriter, HasNoRoomInABufferOfTheHeaderAlone) {
  Bytes buffer(kHeaderBytes);
  FrameWriter writer(buffer, FrameHeader{}, 1500);
  EXPECT_TRUE(writer.room().empty());
  EXPECT_FALSE(writer.commit(1));
  EXPECT_EQ(writer.finish().size(), kHeaderBytes);
}

TEST(FrameWriter, NeverExceedsTheLengthField) {
  Bytes buffer(70000);
  FrameWriter writer(buffer, FrameHeader{}, buffer.size());
  EXPECT_FALSE(writer.commit(65535));
  EXPECT_TRUE(writer.commit(65535 - kHeaderBytes - kLengthPrefixBytes));
  EXPECT_EQ(writer.finish().size(), kMaxFrameBytes);
}

TEST(MaxPacketBytes, LeavesSpaceForAPose) {
  EXPECT_EQ(max_packet_bytes(1500), 1473U);
  EXPECT_EQ(max_packet_bytes(28), 1U);
  EXPECT_EQ(max_packet_bytes(27), 0U);
  EXPECT_EQ(max_packet_bytes(0), 0U);
}

class RandomFrame {
 public:
  explicit RandomFrame(std::uint64_t seed) : random_(seed) {}

  std::uint32_t below(std::uint32_t limit) { return static_cast<std::uint32_t>(random_() % limit); }

  FrameHeader header() {
    FrameHeader header{static_cast<ProfileId>(below(256)), static_cast<std::uint16_t>(random_()),
                       static_cast<std::uint32_t>(random_()), static_cast<std::uint32_t>(random_()),
                       std::nullopt};
    if (below(2) == 0) {
      header.pose =
          FramePose{static_cast<std::int16_t>(random_()), static_cast<std::int16_t>(random_()),
                    static_cast<std::uint16_t>(random_()), static_cast<std::uint8_t>(random_())};
    }
    header.is_ghost = below(2) == 0;
    return header;
  }

  Bytes packet() {
    Bytes bytes(1 + below(400));
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random_());
    return bytes;
  }

 private:
  std::mt19937_64 random_;
};

TEST(AirFrame, SurvivesARoundTripWithRandomContents) {
  RandomFrame random(1);
  for (int round = 0; round < 2000; ++round) {
    const FrameHeader header = random.header();
    Bytes buffer(1500);
    FrameWriter writer(buffer, header, buffer.size());
    std::vector<Bytes> sent;
    for (Bytes packet = random.packet(); writer.append(packet); packet = random.packet()) {
      sent.push_back(packet);
    }
    const std::span<const std::uint8_t> bytes = writer.finish();
    // In a block of its own exact size, so that a sanitizer sees a read beyond it.
    const Bytes received(bytes.begin(), bytes.end());
    Frame frame;
    ASSERT_EQ(parse(received, frame), ParseResult::kOk);
    ASSERT_EQ(frame.header, header);
    std::vector<Bytes> packets;
    PacketReader reader(frame.packets);
    for (std::span<const std::uint8_t> packet; reader.next(packet);) {
      packets.emplace_back(packet.begin(), packet.end());
    }
    ASSERT_EQ(packets, sent);
    ASSERT_FALSE(reader.is_malformed());
  }
}

TEST(AirFrame, TheMarkOfAGhostIsOneBitOfByteSevenAndTheOthersAreNotRead) {
  Bytes buffer(100);
  FrameHeader header;
  for (const bool is_ghost : {false, true}) {
    header.is_ghost = is_ghost;
    FrameWriter writer(buffer, header, buffer.size());
    const std::span<const std::uint8_t> bytes = writer.finish();
    EXPECT_EQ(bytes[7], is_ghost ? 1 : 0);
    EXPECT_EQ(bytes[3], 0) << "no flag: robots of today would drop the frame";
    Bytes received(bytes.begin(), bytes.end());
    received[7] |= 0xFE;
    Frame frame;
    ASSERT_EQ(parse(received, frame), ParseResult::kOk);
    EXPECT_EQ(frame.header.is_ghost, is_ghost);
  }
}

TEST(AirFrame, CutAnywhereIsNeverRead) {
  Bytes buffer(100);
  FrameHeader header;
  header.pose = FramePose{1, 2, 3, 4};
  FrameWriter writer(buffer, header, buffer.size());
  ASSERT_TRUE(writer.append(Bytes{1, 2, 3}));
  const std::span<const std::uint8_t> bytes = writer.finish();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    Frame frame;
    EXPECT_NE(parse(cut, frame), ParseResult::kOk) << size;
  }
}

TEST(PlainCopy, HoldsWhatAFrameHeld) {
  FrameHeader header;
  header.node = 7;
  header.epoch = 0x01020304;
  header.counter = 9;
  header.pose = FramePose{1, -2, 3, 4};
  for (const bool is_beacon : {false, true}) {
    header.is_beacon = is_beacon;
    Bytes buffer(200);
    FrameWriter writer(buffer, header, buffer.size());
    const Bytes packet{1, 2, 3};
    if (is_beacon) {
      EXPECT_TRUE(writer.append_last({5, 70'000}));
      EXPECT_TRUE(writer.append_last({6, 1}));
    } else {
      EXPECT_TRUE(writer.append(packet));
      EXPECT_TRUE(writer.append(Bytes{4}));
    }
    buffer.resize(writer.finish().size());
    Frame frame;
    ASSERT_EQ(parse(buffer, frame), ParseResult::kOk);
    EXPECT_EQ(plain_copy(frame), buffer) << is_beacon;
  }
}

TEST(CounterName, IsOfItsOwnForEachCause) {
  std::set<std::string_view> names;
  for (int each = 0; each <= static_cast<int>(ParseResult::kNotAuthentic); ++each) {
    const std::string_view name = counter_name(static_cast<ParseResult>(each));
    EXPECT_TRUE(each == 0 ? name.empty() : name.starts_with("frames_")) << each;
    EXPECT_TRUE(names.insert(name).second) << name;
  }
  EXPECT_EQ(counter_name(ParseResult::kNotOurs), "frames_not_ours");
  EXPECT_EQ(counter_name(ParseResult::kReplayed), "frames_replayed");
  EXPECT_EQ(counter_name(ParseResult::kTooOld), "frames_too_old");
  EXPECT_EQ(counter_name(ParseResult::kNotProven), "frames_not_proven");
}

}  // namespace
}  // namespace swarmtalk::frame
