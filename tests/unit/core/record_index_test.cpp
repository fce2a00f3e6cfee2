#include "swarmtalk/record_index.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"

namespace swarmtalk::core {
namespace {

template <class P>
RecordKey<P> key(uint32_t node, uint32_t message, uint32_t channel, uint32_t epoch = 0) {
  typename Wire<P>::Header header = {};
  header.node = static_cast<typename Wire<P>::NodeId>(node);
  header.message = static_cast<typename Wire<P>::MessageNumber>(message);
  header.channel = static_cast<typename Wire<P>::ChannelId>(channel);
  header.epoch = static_cast<typename Wire<P>::Epoch>(epoch);
  uint8_t packet[Wire<P>::kHeaderBytes];
  Wire<P>::encode(header, packet);
  return RecordKey<P>(packet);
}

TEST(RecordKey, KeepsEveryBitOfEachPart) {
  const auto largest = key<Wifi>(0xFFFF, 0xFFFFFFFF, 0xFFFF, 0xFFFF);
  EXPECT_EQ(largest.node(), 0xFFFF);
  const auto sut = key<Wifi>(1, 2, 3, 4);
  EXPECT_TRUE(sut == key<Wifi>(1, 2, 3, 4));
  EXPECT_FALSE(sut == key<Wifi>(9, 2, 3, 4));
  EXPECT_FALSE(sut == key<Wifi>(1, 9, 3, 4));
  EXPECT_FALSE(sut == key<Wifi>(1, 2, 9, 4));
  EXPECT_FALSE(sut == key<Wifi>(1, 2, 3, 9));
}

TEST(RecordKey, OfOneStreamDiffersInTheNumberAlone) {
  const auto sut = key<Kilobot>(254, 15, 15);
  EXPECT_TRUE(sut.is_same_stream(key<Kilobot>(254, 0, 15)));
  EXPECT_FALSE(sut.is_same_stream(key<Kilobot>(253, 15, 15)));
  EXPECT_FALSE(sut.is_same_stream(key<Kilobot>(254, 15, 14)));
}

struct FewBuckets : Kilobot {
  static constexpr uint16_t kRecords = 20;
  static constexpr uint16_t kBuckets = 2;
};
/// Twenty records in two chains: each is found, also when others before and behind it are gone.
TEST(RecordIndex, FindsWhatIsLinkedAndNothingElse) {
  std::vector<Record<FewBuckets>> records(20);
  RecordIndex<FewBuckets, false> sut;
  sut.start(records.data());
  for (uint32_t i = 0; i < 20; ++i) {
    records[i].key = key<FewBuckets>(i, i, 1);
    sut.link(records.data(), &records[i]);
  }
  for (uint32_t gone = 0; gone < 20; gone = gone + 3) sut.unlink(records.data(), &records[gone]);
  for (uint32_t i = 0; i < 20; ++i) {
    EXPECT_EQ(sut.find(records.data(), key<FewBuckets>(i, i, 1)),
              i % 3 == 0 ? nullptr : &records[i])
        << i;
  }
  EXPECT_EQ(sut.find(records.data(), key<FewBuckets>(99, 1, 1)), nullptr);
}

/// Of all messages in a chain, those of one sender and channel: each once, and no other's.
TEST(RecordIndex, GivesEachRecordOfAStreamOnce) {
  std::vector<Record<FewBuckets>> records(20);
  RecordIndex<FewBuckets, false> sut;
  sut.start(records.data());
  for (uint32_t i = 0; i < 20; ++i) {
    records[i].key = key<FewBuckets>(i % 4, i / 4, 1);
    records[i].flags = 0;
    sut.link(records.data(), &records[i]);
  }
  sut.unlink(records.data(), &records[6]);
  sut.for_stream(records.data(), key<FewBuckets>(2, 15, 1), [](auto& record) { ++record.flags; });
  for (uint32_t i = 0; i < 20; ++i) {
    EXPECT_EQ(records[i].flags, i % 4 == 2 && i != 6 ? 1 : 0) << i;
  }
  sut.for_stream(records.data(), key<FewBuckets>(9, 0, 1), [](auto&) { FAIL(); });
}

uint32_t drawn(void* state) {
  return static_cast<uint32_t>((*static_cast<std::mt19937*>(state))());
}
/// Its numbers follow each other. Whatever secret is drawn, each meets half a record in its bucket
/// when the table is filled by them, as if buckets were drawn.
TEST(RecordIndex, SpreadsTheMessagesOfOneSenderWithEverySecret) {
  std::vector<Record<Wifi>> records(Wifi::kRecords);
  std::mt19937 chance(1);
  core::Port port = {};
  port.context = &chance;
  port.random = drawn;
  for (int draw = 0; draw < 300; ++draw) {
    RecordIndex<Wifi, false> sut;
    sut.start(records.data());
    sut.draw_secret(port);
    uint32_t looks = 0;
    for (uint32_t i = 0; i < records.size(); ++i) {
      records[i].key = key<Wifi>(5, i, 1, 0x1234);
      sut.for_stream(records.data(), records[i].key, [&](auto&) { ++looks; });
      sut.link(records.data(), &records[i]);
    }
    EXPECT_LT(looks, 2 * records.size() / 3) << draw;
  }
}

TEST(RecordIndex, WithoutATableLooksAtAllRecords) {
  std::vector<Record<Kilobot>> records(Kilobot::kRecords);
  RecordIndex<Kilobot, true> sut;
  for (uint32_t i = 0; i < records.size(); ++i) records[i].key = key<Kilobot>(i, 1, 1);
  for (uint32_t i = 0; i < records.size(); ++i) {
    EXPECT_EQ(sut.find(records.data(), key<Kilobot>(i, 1, 1)), &records[i]) << i;
  }
  EXPECT_EQ(sut.find(records.data(), key<Kilobot>(99, 1, 1)), nullptr);
  for (auto& record : records) record.flags = 1;
  sut.clear(records.data());
  for (const auto& record : records) EXPECT_EQ(record.flags, 0);
}

}  // namespace
}  // namespace swarmtalk::core
