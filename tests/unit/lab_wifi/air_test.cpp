#include "lab/wifi/medium/air.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace swarmtalk::wifi {
namespace {

using nlohmann::json;

constexpr std::uint32_t kChannel1Mhz = 2412;
constexpr Address kEverybody{0xff, 0xff, 0xff, 0xff, 0xff, 0xff};

Address radio_address(int number) {
  return {0x42, 0, 0, 0, static_cast<std::uint8_t>(number), 0};
}

Address interface_address(int number) {
  return {0x02, 0, 0, 0, static_cast<std::uint8_t>(number), 0};
}

std::vector<std::uint8_t> data_frame(const Address& to, std::size_t size = 100) {
  std::vector<std::uint8_t> bytes(size, 0);
  bytes[0] = 0x08;
  std::copy(to.begin(), to.end(), bytes.begin() + 4);
  return bytes;
}

class AirTest : public testing::Test {
 protected:
  AirTest() {
    for (int number = 0; number < 3; ++number) {
      EXPECT_TRUE(air.add("r" + std::to_string(number), radio_address(number), number, 0));
    }
  }

  Outcome send(const std::vector<std::uint8_t>& bytes, int rate_index = 4, int tries = 1) {
    Frame frame;
    frame.transmitter = radio_address(0);
    frame.bytes = bytes;
    frame.frequency_mhz = kChannel1Mhz;
    frame.attempts[0] = {rate_index, tries};
    return air.transmit(frame);
  }

  json pair_counters(const std::string& from, const std::string& to) {
    const json counters = json::parse(air.command("counters"));
    for (const json& pair : counters["pairs"]) {
      if (pair["from"] == from && pair["to"] == to) return pair;
    }
    return {};
  }

  Air air{1};
};

TEST_F(AirTest, AFrameForAllReachesWhoeverIsNear) {
  const Outcome outcome = send(data_frame(kEverybody));
  ASSERT_EQ(outcome.receptions.size(), 2u);
  EXPECT_EQ(outcome.receptions[0].radio, 1u);
  EXPECT_EQ(outcome.receptions[0].signal_dbm, -20);  // 20 dBm less 40 dB at one metre
  EXPECT_EQ(outcome.receptions[0].rate_index, 4);
  EXPECT_FALSE(outcome.is_acknowledged);
  EXPECT_EQ(outcome.used[0].tries, 1);
  EXPECT_EQ(outcome.used[1].rate_index, -1);
}

TEST_F(AirTest, AFrameForOneIsAcknowledgedByThatOneOnly) {
  EXPECT_TRUE(send(data_frame(interface_address(2))).is_acknowledged);
  const Outcome unknown = send(data_frame(interface_address(9)), 4, 5);
  EXPECT_FALSE(unknown.is_acknowledged);
  EXPECT_EQ(unknown.used[0].tries, 5);
  EXPECT_EQ(json::parse(air.command("counters"))["radios"][0]["unacknowledged"], 1);
}

TEST_F(AirTest, AShareThatIsSetIsLostAndCountedAsThat) {
  EXPECT_EQ(air.command("loss r0 r1 0.25"), R"({"ok":true})");
  int arrived = 0;
  for (int i = 0; i < 4000; ++i) {
    for (const Reception& reception : send(data_frame(kEverybody)).receptions) {
      arrived += reception.radio == 1 ? 1 : 0;
    }
  }
  EXPECT_NEAR(arrived, 3000, 120);
  const json counters = pair_counters("r0", "r1");
  EXPECT_EQ(counters["data_arrived"], arrived);
  EXPECT_EQ(counters["data_lost_set"], 4000 - arrived);
  EXPECT_EQ(counters["data_lost_weak"], 0);
  EXPECT_EQ(pair_counters("r0", "r2")["data_arrived"], 4000);
}

TEST_F(AirTest, AFrameForOneIsTriedUntilItArrives) {
  air.command("loss r0 r1 0.5");
  int tries = 0;
  for (int i = 0; i < 1000; ++i) {
    const Outcome outcome = send(data_frame(interface_address(1)), 4, 30);
    EXPECT_TRUE(outcome.is_acknowledged);
    tries += outcome.used[0].tries;
  }
  EXPECT_NEAR(tries, 2000, 150);
  EXPECT_EQ(pair_counters("r0", "r1")["data_arrived"], 1000);
}

TEST_F(AirTest, DistanceSilencesFastRatesFirst) {
  EXPECT_EQ(air.command("place r1 60 0"), R"({"ok":true})");
  EXPECT_EQ(air.command("place r2 500 0"), R"({"ok":true})");
  EXPECT_EQ(send(data_frame(kEverybody), 4).receptions.size(), 1u);
  EXPECT_TRUE(send(data_frame(kEverybody), 11).receptions.empty());
  EXPECT_EQ(pair_counters("r0", "r1")["data_lost_weak"], 1);
}

TEST_F(AirTest, ManagementFramesAreCountedApart) {
  auto beacon = data_frame(kEverybody);
  beacon[0] = 0x80;
  send(beacon);
  EXPECT_EQ(pair_counters("r0", "r1")["other_arrived"], 1);
  EXPECT_EQ(pair_counters("r0", "r1")["data_arrived"], 0);
}

TEST_F(AirTest, WhatIsNoCommandIsSaidToBeNone) {
  for (const char* line : {"", "fly r0", "place r9 1 1", "place r0 1", "place r0 nan nan",
                           "loss r0 r1 1.5", "loss r0 r1 -1", "loss r0 r9 0.5", "power r0 x"}) {
    EXPECT_TRUE(json::parse(air.command(line)).contains("error")) << line;
  }
}

TEST_F(AirTest, FramesOfStrangersAndTornOnesAreCounted) {
  Frame frame;
  frame.transmitter = radio_address(7);
  const auto bytes = data_frame(kEverybody);
  frame.bytes = bytes;
  EXPECT_TRUE(air.transmit(frame).receptions.empty());
  EXPECT_TRUE(send(std::vector<std::uint8_t>(9, 0x08)).receptions.empty());
  EXPECT_EQ(json::parse(air.command("counters"))["strangers"], 2);
}

TEST_F(AirTest, TakesSixtyFourRadiosAndNoneTwice) {
  EXPECT_FALSE(air.add("r0", radio_address(50), 0, 0));
  EXPECT_FALSE(air.add("other", radio_address(0), 0, 0));
  for (int number = 3; number < 64; ++number) {
    EXPECT_TRUE(air.add("r" + std::to_string(number), radio_address(number), 0, 0));
  }
  EXPECT_FALSE(air.add("r64", radio_address(64), 0, 0));
}

TEST(Reception, LosesATenthAtTheSensitivityAndOneInAHundredAtOneAndAHalfMore) {
  for (int index = 0; index < 12; ++index) {
    const Rate rate = rate_of(index, kChannel1Mhz);
    const double edge = sensitivity_dbm(rate);
    EXPECT_NEAR(chance_of_reception(edge, rate, 1000), 0.9, 1e-9) << rate;
    EXPECT_NEAR(chance_of_reception(edge + 1.5, rate, 1000), 0.99, 1e-3) << rate;
    EXPECT_LT(chance_of_reception(edge - 8, rate, 60), 1e-9) << rate;
  }
}

TEST(Reception, LongerFramesAreLostMoreOften) {
  EXPECT_GT(chance_of_reception(-82, 60, 100), chance_of_reception(-82, 60, 1500));
}

TEST(Reception, ADriversIndexMeansAnotherRateInTheFiveGigahertzBand) {
  EXPECT_EQ(rate_of(0, 2412), 10);
  EXPECT_EQ(rate_of(11, 2412), 540);
  EXPECT_EQ(rate_of(0, 5180), 60);
  EXPECT_EQ(rate_of(7, 5180), 540);
  EXPECT_EQ(rate_of(8, 5180), 0);
  EXPECT_EQ(rate_of(12, 2412), 0);
  EXPECT_EQ(rate_of(-1, 2412), 0);
}

TEST(Reception, TenfoldDistanceCosts30Db) {
  EXPECT_NEAR(signal_dbm(20, 1, 2412), -20.1, 0.1);
  EXPECT_NEAR(signal_dbm(20, 1, 2412) - signal_dbm(20, 10, 2412), 30, 1e-9);
  EXPECT_DOUBLE_EQ(signal_dbm(20, 0, 2412), signal_dbm(20, 1, 2412));
}

}  // namespace
}  // namespace swarmtalk::wifi
