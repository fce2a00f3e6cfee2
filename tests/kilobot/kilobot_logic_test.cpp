// The parts of the Kilobot firmware that are pure logic, on the host: checksum, decoder, turns,
// distance, serial frames. Vectors are those that robots and controllers in use agree on.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <set>
#include <string>
#include <vector>

#include "kilobot_wire/gateway_frame.hpp"
#include "kilobot_wire/overhead_frame.hpp"
#include "platforms/kilobot/distance.hpp"
#include "platforms/kilobot/ir_decoder.hpp"
#include "platforms/kilobot/turns.hpp"

namespace swarmtalk::kilobot {
namespace {

IrMessage message_of(std::vector<std::uint8_t> data, std::uint8_t type) {
  IrMessage message = {};
  data.resize(kIrDataBytes);
  std::copy(data.begin(), data.end(), message.data);
  message.type = type;
  return message;
}

TEST(IrCrc, IsMcrf4xx) {
  std::uint16_t crc = kIrCrcStart;
  for (const char digit : std::string("123456789"))
    crc = ir_crc_step(crc, static_cast<std::uint8_t>(digit));
  EXPECT_EQ(crc, 0x6F91);
}

TEST(IrCrc, AgreesWithMessagesInUse) {
  EXPECT_EQ(ir_crc(message_of({}, 0x00)), 0x9c87);
  EXPECT_EQ(ir_crc(message_of({}, kIrBoot)), 0x188f);
  EXPECT_EQ(ir_crc(message_of({}, kIrRun)), 0x94c7);
  EXPECT_EQ(ir_crc(message_of({1, 2, 3, 4, 5, 6, 7, 8, 9}, 0)), 0xa718);
  EXPECT_EQ(ir_crc(message_of(std::vector<std::uint8_t>(9, 0xFF), 0xFF)), 0x8765);
}

TEST(IrCrc, IsZeroOverAMessageWithItsChecksum) {
  const IrMessage message = message_of({0x55, 0xAA}, 2);
  std::uint16_t crc = ir_crc(message);
  const std::uint16_t sent = crc;
  crc = ir_crc_step(crc, static_cast<std::uint8_t>(sent));
  EXPECT_EQ(ir_crc_step(crc, static_cast<std::uint8_t>(sent >> 8)), 0);
}

/// Pulse times of a message, in cycles of the sender, from the first pulse on.
std::vector<double> pulses_of(const IrMessage& message) {
  std::vector<std::uint8_t> bytes(message.data, message.data + kIrDataBytes);
  bytes.push_back(message.type);
  bytes.push_back(static_cast<std::uint8_t>(ir_crc(message)));
  bytes.push_back(static_cast<std::uint8_t>(ir_crc(message) >> 8));
  std::vector<double> times = {0, 9};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const double start = 10.0 * static_cast<double>(i + 1);
    times.push_back(start);
    for (int bit = 0; bit < 8; ++bit)
      if ((bytes[i] >> bit & 1) != 0) times.push_back(start + 1 + bit);
    times.push_back(start + 9);
  }
  for (double& time : times) time *= kIrSlotCycles;
  return times;
}

/// What a decoder makes of pulses, timed by a clock that runs `rate` times as fast.
struct Decoded {
  std::vector<std::uint8_t> bytes;
  bool is_message = false;
  bool is_aborted = false;
};

Decoded decode(const std::vector<double>& pulses, double rate) {
  IrDecoder decoder;
  Decoded result;
  decoder.begin();
  double start = pulses.front();
  for (std::size_t i = 1; i < pulses.size() && !result.is_aborted; ++i) {
    const auto event = decoder.on_pulse(static_cast<std::uint16_t>((pulses[i] - start) * rate));
    if (event == IrEvent::kByteStart) start = pulses[i];
    if (event == IrEvent::kByte || event == IrEvent::kLast) result.bytes.push_back(decoder.byte());
    result.is_message = event == IrEvent::kLast && decoder.is_intact();
    result.is_aborted = event == IrEvent::kAbort;
  }
  return result;
}

TEST(IrDecoder, ReadsMessagesOfClocksFivePercentApart) {
  const IrMessage message = message_of({0x00, 0xFF, 0x55, 0xAA, 0x01, 0x80, 7, 8, 9}, 2);
  for (const double rate : {0.95, 0.98, 1.0, 1.02, 1.05}) {
    const Decoded decoded = decode(pulses_of(message), rate);
    EXPECT_TRUE(decoded.is_message) << rate;
    EXPECT_EQ(decoded.bytes.size(), kIrMessageBytes) << rate;
    EXPECT_EQ(std::memcmp(decoded.bytes.data(), &message, kIrBodyBytes), 0) << rate;
  }
  EXPECT_FALSE(decode(pulses_of(message), 1.06).is_message);
  EXPECT_FALSE(decode(pulses_of(message), 0.94).is_message);
}

TEST(IrDecoder, AbortsOnLightInTheLeadingByte) {
  auto pulses = pulses_of(message_of({1}, 2));
  pulses.insert(pulses.begin() + 1, 4.0 * kIrSlotCycles);
  EXPECT_TRUE(decode(pulses, 1).is_aborted);
}

TEST(IrDecoder, RefusesAMessageWithALostOrAddedPulse) {
  const auto good = pulses_of(message_of({0x0F, 0xF0, 3}, 2));
  for (std::size_t lost = 2; lost < good.size(); ++lost) {
    auto pulses = good;
    pulses.erase(pulses.begin() + static_cast<std::ptrdiff_t>(lost));
    EXPECT_FALSE(decode(pulses, 1).is_message) << "pulse " << lost;
  }
  auto pulses = good;
  pulses.insert(pulses.begin() + 3, 12.0 * kIrSlotCycles + 5 * kIrSlotCycles);
  EXPECT_FALSE(decode(pulses, 1).is_message);
}

std::uint16_t high_gain(std::uint8_t entry) {
  return static_cast<std::uint16_t>(1023 - 30 * entry);
}
std::uint16_t low_gain(std::uint8_t entry) {
  return static_cast<std::uint16_t>(900 - 35 * entry);
}

using Gains = std::uint16_t (*)(std::uint8_t);

int distance_of(std::uint16_t high, std::uint16_t low, Gains high_table, Gains low_table) {
  return distance_mm(high, low, high_table, low_table,
                     [](Gains table, std::uint8_t entry) { return table(entry); });
}

TEST(Distance, FollowsTheCalibrationFromTouchToItsEnd) {
  for (int mm = kBodyMm; mm <= kBodyMm + 65; ++mm) {
    const auto high = static_cast<std::uint16_t>(1023 - 6 * (mm - kBodyMm));
    const auto low = static_cast<std::uint16_t>(900 - 7 * (mm - kBodyMm));
    EXPECT_EQ(distance_of(high, low, high_gain, low_gain), mm);
  }
}

TEST(Distance, IsNeverLessThanTouchNorMoreThanAByteHolds) {
  EXPECT_EQ(distance_of(1023, 1023, high_gain, low_gain), kBodyMm);
  const auto flat_end = [](std::uint8_t entry) {
    return static_cast<std::uint16_t>(entry < 13 ? 500 : 499);
  };
  EXPECT_EQ(distance_of(10, 0, flat_end, low_gain), kBodyMm + kMostMm);
}

TEST(Distance, BeyondItsTableTheAmplifiedReadingGoesOnAndThePlainOneIsFar) {
  EXPECT_EQ(distance_of(633, 0, high_gain, low_gain), kBodyMm + 65);  // the last entry
  EXPECT_EQ(distance_of(513, 0, high_gain, low_gain), kBodyMm + 85);  // 120 counts, 30 a step
  EXPECT_EQ(distance_of(10, 0, high_gain, low_gain), kBodyMm + 168);  // 103.8 more than 65
  EXPECT_EQ(distance_of(950, 445, high_gain, low_gain), kBodyMm + kFarMm);
  EXPECT_EQ(distance_of(950, 446, high_gain, low_gain), kBodyMm + 64);
}

/// What kilolib's estimate gives for these readings and tables, computed by hand from its rule:
/// each table by itself in whole millimetres, rounded down, then their mean, rounded down again.
TEST(Distance, IsRoundedDownTwiceAsKilolibDoes) {
  EXPECT_EQ(distance_of(873, 725, high_gain, low_gain), kBodyMm + 25);
  EXPECT_EQ(distance_of(872, 724, high_gain, low_gain), kBodyMm + 25);
  EXPECT_EQ(distance_of(800, 640, high_gain, low_gain), kBodyMm + 37);  // 37 and 37
  EXPECT_EQ(distance_of(800, 600, high_gain, low_gain), kBodyMm + 39);  // 37 and 42: 39.5
}

TEST(Distance, OfARobotWithoutCalibrationIsUnknown) {
  const auto blank = [](std::uint8_t) { return std::uint16_t{0xFFFF}; };
  for (std::uint16_t high = 0; high < 1024; high += 11)
    EXPECT_EQ(distance_of(high, 500, blank, blank), kDistanceUnknown);
}

TEST(Distance, OfATableThatDoesNotFallIsUnknown) {
  const auto flat = [](std::uint8_t) { return std::uint16_t{800}; };
  EXPECT_EQ(distance_of(650, 500, flat, flat), kDistanceUnknown);
}

TEST(Distance, GoesOverFromOneAmplifierToTheOtherWithoutAJump) {
  constexpr std::uint16_t kLow = 550;  // 50 mm between the bodies, whatever the other one says
  int before = kBodyMm + 50;
  for (std::uint16_t high = 1023; high > 640; --high) {
    const int mm = distance_of(high, kLow, high_gain, low_gain);
    if (high >= kHighTrusted) {
      EXPECT_EQ(mm, kBodyMm + 50) << high;
    }
    if (high <= kLowTrusted) {
      EXPECT_NEAR(mm, kBodyMm + (1023 - high) / 6.0, 1) << high;
    }
    EXPECT_NEAR(mm, before, 2) << high;
    before = mm;
  }
}

/// What messages do to a robot whose last turn began at 1000 and whose next is at 1800.
class TurnsTest : public ::testing::Test {
 protected:
  static constexpr std::uint16_t kBegun = 1000;
  static constexpr std::uint16_t kPeriod = 800;

  void SetUp() override {
    turns_.start(kBegun);
    ASSERT_TRUE(turns_.is_due(kBegun));
    turns_.on_turn(kBegun, kPeriod);
  }

  /// A message that began at `begun` and reports what was heard `age` reports' units before.
  bool hear_report(std::uint16_t begun, int age) {
    return turns_.on_heard(begun, static_cast<std::uint8_t>(kIrReports + age));
  }

  Turns turns_;
};

TEST_F(TurnsTest, ATurnComesOnceInAPeriodHoweverLateTheLastOneWas) {
  EXPECT_FALSE(turns_.is_due(kBegun + kPeriod - 1));
  EXPECT_TRUE(turns_.is_due(kBegun + kPeriod));
  turns_.on_turn(kBegun + kPeriod + 7, kPeriod);
  EXPECT_EQ(turns_.due(), kBegun + 2 * kPeriod);
}

TEST_F(TurnsTest, WhoHasMissedTurnsDoesNotMakeUpForThem) {
  const std::uint16_t late = kBegun + 3 * kPeriod + 5;
  turns_.on_turn(late, kPeriod);
  EXPECT_EQ(turns_.due(), kBegun + 4 * kPeriod);
}

TEST_F(TurnsTest, OfTheBeatOfOthersHalfIsTaken) {
  for (const int offset : {-19, -8, -2, 0, 2, 8, 19}) {
    Turns turns = turns_;
    const int slots = 7;
    turns.on_heard(static_cast<std::uint16_t>(kBegun + slots * Turns::kSlotUnits + offset),
                   kIrSwarmtalk);
    EXPECT_NEAR(turns.due() - (kBegun + kPeriod), offset / 2.0, 0.51) << offset;
  }
}

TEST_F(TurnsTest, SixRobotsWithClocksHalfAPercentApartFindOneBeat) {
  // Each in its slot of a period that is 20 of them, and each a little fast or slow.
  constexpr int kRobots = 6;
  Turns turns[kRobots];
  double due[kRobots];
  std::uint16_t now = 0;
  for (int i = 0; i < kRobots; ++i) turns[i].start(static_cast<std::uint16_t>(i * 133));
  int worst = 0;
  for (int period = 0; period < 100; ++period) {
    for (int turn = 0; turn < kRobots; ++turn) {
      int next = 0;
      for (int i = 0; i < kRobots; ++i) {
        due[i] = static_cast<std::int16_t>(turns[i].due() - now);
        if (due[i] < due[next]) next = i;
      }
      now = turns[next].due();
      turns[next].on_turn(now, static_cast<std::uint16_t>(kPeriod + 2 * next - 5));
      for (int i = 0; i < kRobots; ++i) {
        if (i != next) turns[i].on_heard(now, kIrSwarmtalk);
      }
      if (period < 50) continue;
      for (int i = 0; i < kRobots; ++i) {
        const int phase = static_cast<std::uint16_t>(turns[i].due() - now) % Turns::kSlotUnits;
        worst = std::max(worst, std::min(phase, Turns::kSlotUnits - phase));
      }
    }
  }
  EXPECT_LE(worst, 5) << "of 40 units to a slot, 4 of them gap";
}

TEST_F(TurnsTest, OnlyWhoHasSentThenIsMeantByAReport) {
  // Heard at 1600, of something at 1600 - 32 * age: the robot's message lasted until 1034.
  for (int age = 0; age <= kIrMostReport; ++age) {
    int moves = 0;
    for (const int begun : {1600, 1601}) {
      Turns turns = turns_;
      moves += turns.on_heard(static_cast<std::uint16_t>(begun),
                              static_cast<std::uint8_t>(kIrReports + age));
    }
    const int then = 1601 - age * kIrReportUnits;
    const bool is_meant = then >= kBegun + 4 && then < kBegun + 4 + 35 + 32;
    EXPECT_EQ(moves, is_meant ? 1 : 0) << age << ": half of those who are meant move";
  }
}

TEST_F(TurnsTest, AMessageMovesItsSenderOnce) {
  ASSERT_TRUE(hear_report(1601, 18));
  EXPECT_FALSE(hear_report(1641, 19)) << "another robot says the same";
}

TEST_F(TurnsTest, AMoveIsOneToSixteenSlots) {
  std::set<int> slots;
  for (int noise = 0; noise < 64; ++noise) {
    Turns turns = turns_;
    turns.move(static_cast<std::uint16_t>(noise));
    slots.insert((turns.due() - turns_.due()) / Turns::kSlotUnits);
    EXPECT_EQ((turns.due() - turns_.due()) % Turns::kSlotUnits, 0);
  }
  EXPECT_EQ(slots.size(), 16u);
  EXPECT_EQ(*slots.begin(), 1);
  EXPECT_EQ(*slots.rbegin(), 16);
}

TEST_F(TurnsTest, TheFirstGarbledMessageIsReportedOnce) {
  EXPECT_EQ(turns_.type(1500), kIrSwarmtalk);
  turns_.on_garbled(1500);
  turns_.on_garbled(1600);
  EXPECT_EQ(turns_.type(1500 + 10 * kIrReportUnits), kIrReports + 10);
  EXPECT_EQ(turns_.type(1500 + 11 * kIrReportUnits), kIrSwarmtalk);
  turns_.on_garbled(2000);
  EXPECT_EQ(turns_.type(2000 + 32 * kIrReportUnits), kIrSwarmtalk) << "too long ago to be told";
  turns_.on_garbled(4000);
  EXPECT_EQ(turns_.type(4000), kIrReports) << "an old one does not stand in its way";
}

TEST(IrType, MessagesWithReportsAreSwarmtalkMessages) {
  int count = 0;
  for (int type = 0; type < 256; ++type) count += is_swarmtalk(static_cast<std::uint8_t>(type));
  EXPECT_EQ(count, 33);
  EXPECT_TRUE(is_swarmtalk(kIrSwarmtalk));
  EXPECT_TRUE(is_swarmtalk(kIrReports));
  EXPECT_TRUE(is_swarmtalk(kIrReports + kIrMostReport));
  EXPECT_FALSE(is_swarmtalk(kIrFirstControl));
}

}  // namespace
}  // namespace swarmtalk::kilobot

namespace swarmtalk::kilobot_bridge {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes frame(OverheadType type, const Bytes& payload = {}) {
  Bytes bytes(kOverheadFrameBytes);
  bytes[0] = kOverheadHeader;
  bytes[1] = static_cast<std::uint8_t>(type);
  std::copy(payload.begin(), payload.end(), bytes.begin() + 2);
  std::uint8_t sum = 0;
  for (const std::uint8_t byte : bytes) sum ^= byte;
  bytes.back() = sum;
  return bytes;
}

/// Types of the frames found in a stream.
Bytes types_in(const std::vector<Bytes>& pieces) {
  OverheadFrameFinder finder;
  Bytes types;
  for (const Bytes& piece : pieces)
    for (const std::uint8_t byte : piece)
      if (finder.on_byte(byte)) types.push_back(finder.frame_byte(1));
  return types;
}

TEST(OverheadFrameFinder, FindsFramesBehindGarbageAndLostBytes) {
  const Bytes run = frame(OverheadType::kForward, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0x88});
  EXPECT_EQ(run.back(), 0xdf);
  EXPECT_EQ(types_in({run}), (Bytes{2}));
  EXPECT_EQ(types_in({Bytes(132, 0), run}), (Bytes{2}));
  Bytes damaged = run;
  damaged.erase(damaged.begin() + 60);
  EXPECT_EQ(types_in({damaged, frame(OverheadType::kForwardSingle)}), (Bytes{6}));
  Bytes wrong = run;
  wrong.back() ^= 1;
  EXPECT_EQ(types_in({wrong, run}), (Bytes{2}));
}

TEST(OverheadFrameFinder, FindsTheFalseFramesThatTheStockOneFinds) {
  const Bytes stop = frame(OverheadType::kStop);
  EXPECT_EQ(types_in({stop, stop}), (Bytes{0, 0x55, 0}));
  const Bytes single = frame(OverheadType::kForwardSingle, {0x55, 1, 0, 0, 0, 0, 0, 0, 0, 7});
  EXPECT_EQ(types_in({single, single}), (Bytes{6, 1, 6}));
}

TEST(OverheadFrameFinder, KeepsAFrameWhileFurtherBytesArrive) {
  OverheadFrameFinder finder;
  Bytes page = frame(OverheadType::kPage);
  for (std::uint8_t i = 0; i < 128; ++i) page[3 + i] = i;
  page.back() = 0;
  for (std::size_t i = 0; i + 1 < page.size(); ++i) page.back() ^= page[i];
  for (const std::uint8_t byte : page) finder.on_byte(byte);
  for (int i = 0; i < OverheadFrameFinder::kLag; ++i) finder.on_byte(0);
  for (std::uint8_t i = 0; i < kOverheadFrameBytes; ++i)
    EXPECT_EQ(finder.frame_byte(i), page[i]) << int{i};
}

Bytes wire(const GatewayFrame& frame) {
  Bytes bytes;
  for (std::uint8_t i = 0; i < frame.size(); ++i) bytes.push_back(frame.byte(i));
  return bytes;
}

Bytes from_hex(const std::string& text) {
  Bytes bytes;
  for (std::size_t i = 0; i < text.size(); i += 3)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

TEST(GatewayFrame, WritesReceptionsAsSpecified) {
  GatewayFrame frame;
  frame.begin(GatewayKind::kReception, 7);
  frame.append16(0x0120);
  for (std::uint8_t i = 1; i <= 9; ++i) frame.append(i);
  frame.append(0);
  frame.append16(612);
  frame.append16(845);
  frame.append(48);
  frame.end();
  EXPECT_EQ(wire(frame), from_hex("0e 01 07 20 01 01 02 03 04 05 06 07 08 09 08 64 02 4d 03 30 f8 "
                                  "ff 00"));
}

TEST(GatewayFrame, WritesHellosAsSpecified) {
  GatewayFrame frame;
  frame.begin(GatewayKind::kHello, 9);
  frame.append16(0x0140);
  frame.append16(1234);
  frame.append(1);
  frame.append16(0);
  frame.append16(690);
  frame.append(0);
  frame.end();
  EXPECT_EQ(wire(frame), from_hex("08 02 09 40 01 d2 04 01 01 03 b2 02 03 34 f1 00"));
}

TEST(GatewayFrame, NeverGrowsBeyondItsMemory) {
  GatewayFrame frame;
  frame.begin(GatewayKind::kText, 0);
  for (int i = 0; i < 300; ++i) frame.append(0);
  frame.end();
  EXPECT_LE(frame.size(), kGatewayFrameMax);
  EXPECT_EQ(frame.byte(static_cast<std::uint8_t>(frame.size() - 1)), 0);
}

}  // namespace
}  // namespace swarmtalk::kilobot_bridge
