#include "swarmtalk/counters.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"

namespace swarmtalk::core {
namespace {

TEST(Counters, StartAtZero) {
  const Counters<Wifi> sut;
  const auto* bytes = reinterpret_cast<const uint8_t*>(&sut);
  EXPECT_TRUE(std::all_of(bytes, bytes + sizeof sut, [](uint8_t byte) { return byte == 0; }));
}

TEST(Counters, StayAtTheirLargestValue) {
  Counters<Kilobot> sut;
  for (int i = 0; i < 254; ++i) sut.count(sut.duplicates);
  EXPECT_EQ(sut.duplicates, 254);
  sut.count(sut.duplicates);
  EXPECT_EQ(sut.duplicates, 255);
  sut.count(sut.duplicates);
  EXPECT_EQ(sut.duplicates, 255);
  EXPECT_EQ(sut.own_echoes, 0);
}

}  // namespace
}  // namespace swarmtalk::core
