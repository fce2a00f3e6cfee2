#include "swarmtalk/reassembler.hpp"

#include <gtest/gtest.h>

#include <string>

#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk::core {
namespace {

using Reassembly = Reassembler<Kilobot>;
using Entry = Record<Kilobot>;
using Outcome = Reassembly::Outcome;

Fragment<Kilobot> fragment(uint8_t sequence, uint8_t packets, const char* five) {
  Fragment<Kilobot> result = {};
  result.bit = Wire<Kilobot>::bit_of(sequence);
  result.end = packets == sequence + 1;
  result.payload = reinterpret_cast<const uint8_t*>(five);
  result.payload_bytes = 5;
  return result;
}

TEST(Reassembler, PutsPacketsInOrderWhateverTheirs) {
  Reassembly sut;
  Entry entry = {};
  sut.begin(entry);
  EXPECT_EQ(sut.add(entry, fragment(2, 3, "ccccc"), 0), Outcome::kHeld);
  EXPECT_EQ(sut.add(entry, fragment(0, 0, "aaaaa"), 0), Outcome::kHeld);
  auto last = fragment(1, 0, "bbbbb");
  EXPECT_EQ(sut.add(entry, last, 0), Outcome::kComplete);
  uint8_t message[40];
  EXPECT_EQ(sut.take(entry, last, 0, message), 15);
  EXPECT_EQ(std::string(reinterpret_cast<char*>(message), 15), "aaaaabbbbbccccc");
}

TEST(Reassembler, KnowsACopyFromAContradiction) {
  Reassembly sut;
  Entry entry = {};
  sut.begin(entry);
  sut.add(entry, fragment(0, 0, "aaaaa"), 0);
  EXPECT_EQ(sut.add(entry, fragment(0, 0, "aaaaa"), 0), Outcome::kDuplicate);
  EXPECT_EQ(sut.add(entry, fragment(0, 0, "xxxxx"), 0), Outcome::kContradiction);
  sut.add(entry, fragment(3, 4, "ddddd"), 0);
  EXPECT_EQ(sut.add(entry, fragment(2, 3, "ccccc"), 0), Outcome::kContradiction) << "two ends";
  EXPECT_EQ(sut.add(entry, fragment(5, 0, "fffff"), 0), Outcome::kContradiction)
      << "behind the end";
  Entry other = {};
  sut.begin(other);
  sut.add(other, fragment(5, 0, "fffff"), 0);
  EXPECT_EQ(sut.add(other, fragment(2, 3, "ccccc"), 0), Outcome::kContradiction);
}

TEST(Reassembler, GivesReleasedSlotsBack) {
  Reassembly sut;
  Entry entries[20] = {};
  for (int round = 0; round < 10; ++round) {
    for (Entry& entry : entries) {
      sut.begin(entry);
      EXPECT_EQ(sut.add(entry, fragment(0, 0, "aaaaa"), 0), Outcome::kHeld);
      EXPECT_EQ(sut.add(entry, fragment(1, 0, "bbbbb"), 0), Outcome::kHeld);
    }
    EXPECT_EQ(sut.add(entries[0], fragment(2, 0, "ccccc"), 0), Outcome::kNoSlot) << "40 slots";
    sut.release(entries[7]);
    sut.begin(entries[7]);
    EXPECT_EQ(sut.add(entries[0], fragment(2, 0, "ccccc"), 0), Outcome::kHeld);
    for (Entry& entry : entries) sut.release(entry);
  }
}

TEST(Reassembler, ReportsTheLargestDelayUntilNow) {
  Reassembly sut;
  Entry entry = {};
  sut.begin(entry);
  auto first = fragment(0, 0, "aaa  ");  // a padded packet has its bytes behind the payload
  first.payload_bytes = 3;
  first.has_delay = true;
  first.delay_ticks = 10;
  auto last = fragment(1, 2, "bbb  ");
  last.payload_bytes = 3;
  last.has_delay = true;
  last.delay_ticks = 60;
  sut.add(entry, first, 0);
  uint8_t message[40];
  EXPECT_EQ(sut.add(entry, last, 49), Outcome::kComplete);
  sut.take(entry, last, 49, message);
  EXPECT_EQ(last.delay_ticks, 60) << "10 + 49 of the first is less";
}

}  // namespace
}  // namespace swarmtalk::core
