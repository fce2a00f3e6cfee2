#include "redundancy/recoverer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include "tests/unit/redundancy/wifi_packets.hpp"

namespace swarmtalk::redundancy {
namespace {

using testing::header_of;
using testing::kFull;
using testing::packets_of;
using testing::protected_packets;

class RecovererTest : public ::testing::Test {
 protected:
  std::vector<Bytes> add(const Bytes& packet, std::uint64_t now_us = 0) {
    return recoverer_.add(packet, Wire::decode(packet.data()), now_us);
  }
  Recoverer recoverer_;
};

TEST_F(RecovererTest, GivesTheMissingPacketsOnce) {
  const std::vector<Bytes> all = protected_packets(header_of(1, 3 * kFull + 5), 2);
  EXPECT_TRUE(add(all[0]).empty());
  EXPECT_TRUE(add(all[4]).empty());
  EXPECT_TRUE(add(all[4]).empty()) << "heard twice, it counts once";
  EXPECT_TRUE(add(all[2]).empty());
  const std::vector<Bytes> known = add(all[5]);
  ASSERT_EQ(known.size(), 2u);
  EXPECT_EQ(known[0], all[1]);
  EXPECT_EQ(known[1], all[3]) << "the last, shorter one";
  EXPECT_TRUE(add(all[1]).empty());
  EXPECT_TRUE(add(all[3]).empty());
  EXPECT_EQ(recoverer_.recovered(), 2u);
  EXPECT_EQ(recoverer_.held_bytes(), 0u);
}

TEST_F(RecovererTest, HasNothingToDoWhenAllPacketsHaveCome) {
  const std::vector<Bytes> all = protected_packets(header_of(1, 2 * kFull), 2);
  for (const Bytes& packet : all) EXPECT_TRUE(add(packet).empty());
  EXPECT_EQ(recoverer_.held_bytes(), 0u);
}

TEST_F(RecovererTest, WhatItGivesHasWaitedLikeTheParityPacket) {
  Header header = header_of(1, 3000, 7, 5);
  std::vector<Bytes> all = protected_packets(header, 1, true);
  Bytes& parity = all[3];
  const auto size = static_cast<Wire::PacketSize>(parity.size());
  Wire::set_timestamp(parity.data(), size, 700);
  Wire::set_hops(parity.data(), 2);
  add(parity, 1000);
  add(all[0], 1100);
  const std::vector<Bytes> known = add(all[1], 1300);
  ASSERT_EQ(known.size(), 1u);
  EXPECT_EQ(Wire::timestamp(known[0].data(), static_cast<Wire::PacketSize>(known[0].size())),
            1000u);
  const Header last = Wire::decode(known[0].data());
  EXPECT_EQ(last.hops, 2);
  EXPECT_EQ(last.ttl, 5);
  EXPECT_TRUE(last.end);
}

TEST_F(RecovererTest, DoesNotMixMessages) {
  const std::vector<Bytes> first = protected_packets(header_of(1, 2 * kFull), 1);
  const std::vector<Bytes> second = protected_packets(header_of(2, 2 * kFull), 1);
  Header restarted = header_of(1, 2 * kFull);
  restarted.epoch = 1;
  const std::vector<Bytes> third = protected_packets(restarted, 1);
  add(first[0]);
  EXPECT_TRUE(add(second[2]).empty());
  EXPECT_TRUE(add(third[2]).empty());
  EXPECT_EQ(add(first[2]).size(), 1u);
}

TEST_F(RecovererTest, RefusesAnotherSizeUnderTheSameName) {
  add(protected_packets(header_of(1, 2 * kFull), 1)[0]);
  EXPECT_TRUE(add(protected_packets(header_of(1, 2 * kFull - 1), 1)[2]).empty());
}

TEST_F(RecovererTest, GivesUpWhatDoesNotGoOn) {
  const std::vector<Bytes> all = protected_packets(header_of(1, 2 * kFull), 1);
  add(all[0], 0);
  EXPECT_TRUE(add(all[2], Recoverer::kLifeUs + 1).empty());
  EXPECT_EQ(recoverer_.held_bytes(), kFull);
}

TEST_F(RecovererTest, HoldsSoMuchAndCountsWhatItGivesUp) {
  for (std::uint32_t number = 1; number <= 1000; ++number) {
    add(protected_packets(header_of(number, 9 * kFull), 1)[0], number);
    EXPECT_LE(recoverer_.held_bytes(), Recoverer::kMostBytes + kFull);
  }
  EXPECT_EQ(recoverer_.evicted(), 1000 - Recoverer::kMostMessages);
  // The newest is still there.
  const std::vector<Bytes> all = protected_packets(header_of(1000, 9 * kFull), 1);
  for (int i = 1; i < 8; ++i) EXPECT_TRUE(add(all[static_cast<std::size_t>(i)], 1001).empty());
  EXPECT_EQ(add(all[9], 1001).size(), 1u);
}

// Whole, lost, doubled and late packets of messages that begin all the time, more than there is
// room for.
TEST_F(RecovererTest, HoldsOfRandomHistoriesWhatIsNotWhole) {
  struct Sent {
    std::vector<Bytes> packets{};
    std::size_t sources = 0;
    std::set<std::size_t> come{};
    std::uint64_t heard_us = 0;
  };
  std::mt19937 random(7);
  std::vector<Sent> sent;
  std::uint64_t now_us = 0;
  for (int step = 0; step < 6000; ++step) {
    now_us += random() % (Recoverer::kLifeUs / 400);
    if (sent.size() < 8 || random() % 8 == 0) {
      const std::size_t sources = 2 + random() % 4;
      sent.push_back(
          {protected_packets(header_of(static_cast<std::uint32_t>(step + 1), sources * kFull), 2),
           sources});
    }
    // Those of late go on; the others are left as they are, until their time is over.
    Sent& message = sent[sent.size() - 1 - random() % std::min(sent.size(), std::size_t{8})];
    const std::size_t place = random() % message.packets.size();
    const bool was_whole = message.come.size() >= message.sources;
    if (!message.come.empty() && now_us - message.heard_us > Recoverer::kLifeUs) continue;
    const std::vector<Bytes> known = add(message.packets[place], now_us);
    if (!was_whole && message.come.insert(place).second) message.heard_us = now_us;
    const bool is_whole = message.come.size() >= message.sources;
    std::vector<Bytes> missing;
    for (std::size_t i = 0; is_whole && !was_whole && i < message.sources; ++i) {
      if (!message.come.contains(i)) missing.push_back(message.packets[i]);
    }
    ASSERT_EQ(known, missing);
    // Nothing is given up for want of room here; what is too old may be held until the next begins.
    std::size_t least = 0;
    std::size_t most = 0;
    for (const Sent& each : sent) {
      const std::size_t bytes = each.come.size() < each.sources ? each.come.size() * kFull : 0;
      most += bytes;
      if (now_us - each.heard_us <= Recoverer::kLifeUs) least += bytes;
    }
    ASSERT_GE(recoverer_.held_bytes(), least);
    ASSERT_LE(recoverer_.held_bytes(), most);
    ASSERT_EQ(recoverer_.evicted(), 0u);
  }
  // A message that begins after all others are too old: they have left nothing.
  now_us += Recoverer::kLifeUs + 1;
  add(protected_packets(header_of(9'000'000, 2 * kFull), 1)[0], now_us);
  EXPECT_EQ(recoverer_.held_bytes(), kFull);
}

TEST(IsParity, RefusesWhatContradictsItself) {
  const std::vector<Bytes> all = protected_packets(header_of(1, 2 * kFull), 2);
  const auto is_it = [](const Bytes& packet) {
    return is_parity(packet, Wire::decode(packet.data()));
  };
  EXPECT_FALSE(is_it(all[1]));
  EXPECT_TRUE(is_it(all[2]));
  EXPECT_TRUE(is_it(all[3]));
  Bytes cut = all[2];
  cut.pop_back();
  EXPECT_FALSE(is_it(cut));
  Bytes beyond = all[3];
  Wire::SequenceField::put(beyond.data(), 4);
  EXPECT_FALSE(is_it(beyond)) << "its message has two";
  Bytes end = all[2];
  Wire::EndField::put(end.data(), 1);
  EXPECT_FALSE(is_it(end));
  Bytes too_long = all[2];
  Wire::SizeField::put(too_long.data(), 16385);
  EXPECT_FALSE(is_it(too_long));
  EXPECT_FALSE(is_marked(std::span(all[2]).first(Wire::kHeaderBytes - 1)));
}

}  // namespace
}  // namespace swarmtalk::redundancy
