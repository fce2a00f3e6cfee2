#include "nl80211/radio.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/recorded_nl80211.hpp"

namespace swarmtalk::nl80211 {
namespace {

const std::string kFolder = SWARMTALK_VECTORS "/nl80211/";

void ask_all(Asker& asker) {
  interface_of(asker, 3);
  stations_of(asker, 3);
  network_of(asker, 3);
  has_power_save(asker, 3);
  country_of(asker, 0);
}

TEST(Radio, ReadsAClientOfAnAccessPoint) {
  RecordedAsker asker(kFolder + "managed.txt");
  const auto interface = interface_of(asker, 3);
  ASSERT_TRUE(interface);
  EXPECT_EQ(interface->mode, Mode::kStation);
  EXPECT_EQ(interface->network, "");  // Linux 6.1 leaves it to the network's beacons
  EXPECT_EQ(interface->frequency_mhz, 2412u);
  const auto stations = stations_of(asker, 3);
  ASSERT_TRUE(stations);
  ASSERT_EQ(stations->size(), 1u);
  EXPECT_EQ(stations->front().beacon_interval_tu, 100u);
  EXPECT_EQ(stations->front().dtim_period, 2u);
  ASSERT_TRUE(stations->front().signal_dbm);
  EXPECT_LT(*stations->front().signal_dbm, 0);
  const auto network = network_of(asker, 3);
  ASSERT_TRUE(network);
  EXPECT_EQ(network->name, "swarm");
  EXPECT_EQ(network->bssid, stations->front().address);
  EXPECT_EQ(network->basic_rates_mbps, (std::vector<double>{6, 12, 24}));
  EXPECT_EQ(has_power_save(asker, 3), false);
  EXPECT_EQ(country_of(asker, 0), "DE");
}

TEST(Radio, ReadsAnAdHocNetworkWithItsPeers) {
  RecordedAsker asker(kFolder + "ibss.txt");
  EXPECT_EQ(interface_of(asker, 3)->mode, Mode::kAdHoc);
  EXPECT_EQ(stations_of(asker, 3)->size(), 2u);
  EXPECT_EQ(network_of(asker, 3)->bssid, 0x021122334455u);
}

TEST(Radio, ReadsAMeshWithItsPeers) {
  RecordedAsker asker(kFolder + "mesh.txt");
  EXPECT_EQ(interface_of(asker, 3)->mode, Mode::kMesh);
  EXPECT_EQ(interface_of(asker, 3)->frequency_mhz, 2412u);
  EXPECT_EQ(stations_of(asker, 3)->size(), 2u);
}

TEST(Radio, WhatTheKernelRefusesIsUnknown) {
  RecordedAsker asker;
  EXPECT_FALSE(interface_of(asker, 3));
  EXPECT_FALSE(stations_of(asker, 3));
  EXPECT_FALSE(network_of(asker, 3));
  EXPECT_FALSE(has_power_save(asker, 3));
  EXPECT_FALSE(country_of(asker, 0));
  EXPECT_EQ(switch_power_save_off(asker, 3), ENODEV);
}

TEST(Radio, ACutOrDamagedAnswerIsReadAsFarAsItGoes) {
  std::minstd_rand random(1);
  for (const char* name : {"managed", "ibss", "mesh", "ap"}) {
    const RecordedAsker whole(kFolder + name + ".txt");
    for (const auto& [command, answer] : whole.answers) {
      if (answer.messages.empty()) continue;
      const std::size_t size = answer.messages.front().size();
      for (std::size_t cut = 0; cut < size; ++cut) {
        RecordedAsker asker = whole;
        auto& message = asker.answers[command].messages.front();
        message.resize(cut);
        ask_all(asker);
        message = answer.messages.front();
        message[cut] = static_cast<std::uint8_t>(random());
        ask_all(asker);
      }
    }
  }
}

TEST(Radio, SaysWhatItWantsToChangeInTheKernelsWords) {
  RecordedAsker asker;
  switch_power_save_off(asker, 7);
  const Question& question = asker.questions.back();
  EXPECT_EQ(question.command, NL80211_CMD_SET_POWER_SAVE);
  EXPECT_EQ(question.interface, 7u);
  ASSERT_EQ(question.values.size(), 1u);
  EXPECT_EQ(question.values[0].attribute, NL80211_ATTR_PS_STATE);
  EXPECT_EQ(question.values[0].bytes, (std::vector<std::uint8_t>{0, 0, 0, 0}));
  request_country(asker, "DE");
  EXPECT_EQ(asker.questions.back().values[0].bytes, (std::vector<std::uint8_t>{'D', 'E', 0}));
}

TEST(Radio, KnowsTheChannelsOfTheBands) {
  EXPECT_EQ(channel_of(2412), 1);
  EXPECT_EQ(channel_of(2472), 13);
  EXPECT_EQ(channel_of(2484), 14);
  EXPECT_EQ(channel_of(5180), 36);
  EXPECT_EQ(channel_of(5955), 1);
  EXPECT_EQ(channel_of(900), 0);
}

TEST(KernelAsker, SaysThatAnInterfaceIsNotThere) {
  KernelAsker asker;
  const Answer answer = asker.ask({NL80211_CMD_GET_INTERFACE, false, 0x7FFFFFF0});
  EXPECT_NE(answer.error, 0);
  EXPECT_TRUE(answer.messages.empty());
}

}  // namespace
}  // namespace swarmtalk::nl80211
