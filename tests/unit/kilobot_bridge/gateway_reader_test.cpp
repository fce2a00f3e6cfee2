#include "kilobot_bridge/gateway_reader.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "tests/unit/emulation/ohc_double/vectors.hpp"

namespace swarmtalk::kilobot_bridge {
namespace {

using ohc_double::vectors::from_hex;

class GatewayReaderTest : public testing::Test, public GatewayUser {
 protected:
  void on_reception(const GatewayReception& reception) override { heard.push_back(reception); }
  void on_hello(const GatewayHello& hello) override { hellos.push_back(hello); }
  void on_version(const ControllerVersion& version) override { versions.push_back(version); }
  void on_text(std::string_view text) override { texts.emplace_back(text); }

  void synchronise() { reader.put(std::array<std::uint8_t, 1>{0}); }
  void put(GatewayFrame& frame) {
    frame.end();
    for (std::uint8_t i = 0; i < frame.size(); ++i) {
      reader.put(std::array<std::uint8_t, 1>{frame.byte(i)});
    }
  }
  void report(std::uint8_t sequence, std::uint16_t ticks, std::uint8_t number = 0) {
    GatewayFrame frame;
    frame.begin(GatewayKind::kReception, sequence);
    frame.append16(ticks);
    for (int i = 0; i < 9; ++i) frame.append(number);
    frame.append(2);
    frame.append16(600);
    frame.append16(800);
    frame.append(48);
    put(frame);
  }
  void hello(std::uint8_t sequence, std::uint16_t ticks, std::uint16_t drops) {
    GatewayFrame frame;
    frame.begin(GatewayKind::kHello, sequence);
    frame.append16(ticks);
    frame.append16(1234);
    frame.append(1);
    frame.append16(drops);
    frame.append16(690);
    frame.append(0);
    put(frame);
  }

  GatewayReader reader{*this};
  std::vector<GatewayReception> heard;
  std::vector<GatewayHello> hellos;
  std::vector<ControllerVersion> versions;
  std::vector<std::string> texts;
};

TEST_F(GatewayReaderTest, ReadsTheControllersVersionAmongTheGatewaysNumbers) {
  synchronise();
  report(5, 100);
  GatewayFrame frame;
  frame.begin(GatewayKind::kVersion, 0);
  frame.append(kProductOverhead);
  frame.append(2);
  frame.append16(0x00FF);
  frame.append(kHearsWhileSending | kEndsByItself);
  put(frame);
  report(6, 100);
  ASSERT_EQ(versions.size(), 1u);
  EXPECT_EQ(versions[0].product, kProductOverhead);
  EXPECT_EQ(versions[0].version, 2);
  EXPECT_EQ(versions[0].frame_types, 0xFF);
  EXPECT_EQ(versions[0].flags, 3);
  EXPECT_EQ(reader.counters().missing_frames, 0u) << "the controller has numbers of its own";
  EXPECT_EQ(reader.counters().unreadable_frames, 0u);
}

TEST_F(GatewayReaderTest, ReadsTheReferenceVectors) {
  synchronise();
  reader.put(from_hex("0e010720010102030405060708090864024d0330f8ff00"));
  reader.put(from_hex("0a01082101 68656c6c6f01010102050106be02ff3e9600"));
  reader.put(from_hex("0802094001d204010103b2020334f100"));
  ASSERT_EQ(heard.size(), 2u);
  EXPECT_EQ(heard[0].data, (IrData{1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(heard[0].ir_type, 0);
  EXPECT_EQ(heard[0].low_gain, 612);
  EXPECT_EQ(heard[0].high_gain, 845);
  EXPECT_EQ(heard[0].distance_mm, 48);
  EXPECT_EQ(heard[1].data, (IrData{'h', 'e', 'l', 'l', 'o'}));
  EXPECT_EQ(heard[1].ir_type, 5);
  EXPECT_EQ(heard[1].high_gain, 702);
  EXPECT_FALSE(heard[1].distance_mm);
  ASSERT_EQ(hellos.size(), 1u);
  EXPECT_EQ(hellos[0].uid, 1234);
  EXPECT_EQ(hellos[0].battery, 690);
  EXPECT_EQ(reader.counters().frames, 3u);
  EXPECT_EQ(reader.counters().missing_frames, 0u);
  EXPECT_EQ(reader.counters().unreadable_frames, 0u);
}

TEST_F(GatewayReaderTest, CountsWholeFramesThatItDoesNotKnow) {
  synchronise();
  GatewayFrame unknown;
  unknown.begin(static_cast<GatewayKind>(99), 0);
  unknown.append16(1);
  put(unknown);
  GatewayFrame short_hello;
  short_hello.begin(GatewayKind::kHello, 0);
  short_hello.append16(1);
  put(short_hello);
  EXPECT_EQ(reader.counters().unreadable_frames, 2u);
  EXPECT_EQ(reader.counters().frames, 0u);
  EXPECT_TRUE(heard.empty() && hellos.empty() && versions.empty() && texts.empty());
}

TEST_F(GatewayReaderTest, BeginsAtTheFirstEndOfAFrame) {
  reader.put(from_hex("030405060708090864024d0330f8ff00"));  // the tail of one
  reader.put(from_hex("0e010720010102030405060708090864024d0330f8ff00"));
  EXPECT_EQ(heard.size(), 1u);
  EXPECT_EQ(reader.counters().unreadable_frames, 0u);
}

TEST_F(GatewayReaderTest, DoesNotCountAFrameThatTheLineCutInTwo) {
  synchronise();
  reader.put(from_hex("0e0107200101"));
  reader.on_interrupted();
  reader.put(from_hex("030405060708090864024d0330f8ff00"));  // the tail of another
  reader.put(from_hex("0e010720010102030405060708090864024d0330f8ff00"));
  EXPECT_EQ(heard.size(), 1u);
  EXPECT_EQ(reader.counters().unreadable_frames, 0u);
}

TEST_F(GatewayReaderTest, CountsGapsOfTheSequenceAndNothingElse) {
  synchronise();
  report(250, 1);
  report(251, 2);
  report(254, 3);  // 2 missing
  report(255, 4);
  report(0, 5);
  hello(3, 6, 0);  // 2 missing
  EXPECT_EQ(heard.size(), 5u);
  EXPECT_EQ(reader.counters().missing_frames, 4u);
}

TEST_F(GatewayReaderTest, CountsWhatTheGatewayItselfHadToDrop) {
  synchronise();
  hello(0, 10, 65530);
  hello(1, 40, 65534);
  hello(2, 70, 2);
  EXPECT_EQ(reader.counters().gateway_drops, 8u);
}

TEST_F(GatewayReaderTest, TakesARestartOfTheGatewayForThat) {
  synchronise();
  report(100, 5000);
  hello(101, 5001, 20);
  hello(0, 3, 0);
  report(1, 4);
  EXPECT_EQ(reader.counters().gateway_restarts, 1u);
  EXPECT_EQ(reader.counters().missing_frames, 0u);
  EXPECT_EQ(reader.counters().gateway_drops, 0u);
}

TEST_F(GatewayReaderTest, ReadsAnHourOfAHundredReportsPerSecondWithoutLoss) {
  synchronise();
  const unsigned kReports = 360'000;
  for (unsigned i = 0; i < kReports; ++i) {
    report(static_cast<std::uint8_t>(i), static_cast<std::uint16_t>(i / 3),
           static_cast<std::uint8_t>(i));
  }
  ASSERT_EQ(heard.size(), kReports);
  EXPECT_EQ(reader.counters().missing_frames, 0u);
  EXPECT_EQ(heard[54'321].data[0], 54'321 % 256);
}

TEST_F(GatewayReaderTest, CarriesTextOfTheGateway) {
  synchronise();
  GatewayFrame frame;
  frame.begin(GatewayKind::kText, 0);
  for (const char c : std::string("hi")) frame.append(static_cast<std::uint8_t>(c));
  put(frame);
  EXPECT_EQ(texts, std::vector<std::string>{"hi"});
}

TEST_F(GatewayReaderTest, FindsTheNextFrameBehindAnyGarbage) {
  std::mt19937 random(3);
  synchronise();
  for (unsigned round = 0; round < 2000; ++round) {
    std::vector<std::uint8_t> garbage(random() % 200);
    for (std::uint8_t& byte : garbage) byte = static_cast<std::uint8_t>(random());
    reader.put(garbage);
    synchronise();
    const std::size_t before = heard.size();
    report(static_cast<std::uint8_t>(round), 1);
    ASSERT_EQ(heard.size(), before + 1) << round;
  }
  EXPECT_EQ(heard.size(), 2000u) << "garbage was taken for a report";
  EXPECT_GT(reader.counters().unreadable_frames, 1000u);
}

TEST_F(GatewayReaderTest, RefusesEveryDamagedByteOfAFrame) {
  synchronise();
  const auto good = from_hex("0e010720010102030405060708090864024d0330f8ff00");
  for (std::size_t i = 0; i + 1 < good.size(); ++i) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      auto bad = good;
      bad[i] = static_cast<std::uint8_t>(bad[i] ^ (1u << bit));
      reader.put(bad);
      synchronise();
    }
  }
  EXPECT_TRUE(heard.empty());
}

TEST_F(GatewayReaderTest, ReadsTextsOfEachLengthWhole) {
  synchronise();
  for (std::size_t size = 0; size <= kTextBytes; ++size) {
    GatewayFrame frame;
    frame.begin(GatewayKind::kText, static_cast<std::uint8_t>(size));
    std::string text;
    for (std::size_t i = 0; i < size; ++i) text += static_cast<char>('a' + (size + i) % 26);
    for (const char each : text) frame.append(static_cast<std::uint8_t>(each));
    put(frame);
    ASSERT_EQ(texts.size(), size + 1);
    EXPECT_EQ(texts.back(), text);
  }
  EXPECT_EQ(reader.counters().unreadable_frames, 0u);
}

TEST_F(GatewayReaderTest, CutsATextThatIsTooLongAndReadsNoLongerFrame) {
  synchronise();
  const std::string text(kTextBytes + 5, 'x');
  GatewayFrame frame;
  frame.begin(GatewayKind::kText, 0);
  for (const char each : text) frame.append(static_cast<std::uint8_t>(each));
  put(frame);
  ASSERT_EQ(texts.size(), 1u);
  EXPECT_EQ(texts[0], text.substr(0, kTextBytes));
}

}  // namespace
}  // namespace swarmtalk::kilobot_bridge
