// Who was heard, and who is proven to live.
#include "frame/voices.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::frame {
namespace {

Voice voice(std::size_t number) {
  Voice made{};
  made[0] = static_cast<std::uint8_t>(number);
  made[1] = static_cast<std::uint8_t>(number >> 8);
  return made;
}

TEST(Voices, KnowAStrangerFromItsFirstFrameToItsLast) {
  Voices sut(0);
  EXPECT_EQ(sut.find_stranger(voice(1)), nullptr);
  sut.heard(voice(1), 20).nonce[0] = 7;
  const HeardVoice& again = sut.heard(voice(1), 10);
  EXPECT_EQ(again.nonce[0], 7);
  EXPECT_EQ(again.first_at, 20u);
  EXPECT_EQ(again.last_at, 20u) << "a frame that was held back makes nobody older";
  EXPECT_EQ(sut.strangers().size(), 1u);
  EXPECT_EQ(sut.find_proven(voice(1)), nullptr);
}

TEST(Voices, AreStrangersNoMoreOnceTheyAreProven) {
  Voices sut(0);
  sut.heard(voice(1), 5).has_asked = true;
  sut.heard(voice(2), 6);
  sut.prove(voice(1), 100, 0, 3, 10);
  const ProvenVoice* const proven = sut.find_proven(voice(1));
  ASSERT_NE(proven, nullptr);
  EXPECT_TRUE(proven->has_asked) << "what was known of it stays";
  EXPECT_EQ(proven->first_at, 5u);
  EXPECT_EQ(proven->proven_at, 10u);
  EXPECT_EQ(proven->first, 100u);
  EXPECT_TRUE(proven->window.was_heard(99)) << "nothing from before its proof is taken";
  EXPECT_FALSE(proven->window.was_heard(100));
  EXPECT_EQ(sut.find_stranger(voice(1)), nullptr);
  EXPECT_NE(sut.find_stranger(voice(2)), nullptr);
  EXPECT_EQ(&sut.heard(voice(1), 11), proven);
}

TEST(Voices, ThatAreProvenAgainAreDoubtedNoMore) {
  Voices sut(0);
  sut.prove(voice(1), 100, 0, 3, 10);
  ProvenVoice* const proven = sut.find_proven(voice(1));
  ASSERT_NE(proven, nullptr);
  proven->is_doubted = true;
  proven->asks = 3;
  proven->window.remember(101);
  sut.prove(voice(1), 102, 1, 15, 20);
  EXPECT_EQ(sut.proven().size(), 1u);
  EXPECT_FALSE(proven->is_doubted);
  EXPECT_EQ(proven->asks, 0);
  EXPECT_EQ(proven->proven_at, 20u);
  EXPECT_EQ(proven->first, 100u);
  EXPECT_TRUE(proven->window.was_heard(101));
}

TEST(Voices, TheProvenOneNotHeardForLongestMakesPlace) {
  Voices sut(1);
  for (std::size_t i = 0; i < Voices::kMostProven; ++i) sut.prove(voice(i), 1, 0, 0, 10 + i);
  EXPECT_EQ(sut.remembers_since(), 1u);
  sut.heard(voice(0), 5000);
  sut.prove(voice(Voices::kMostProven), 1, 0, 0, 6000);
  EXPECT_EQ(sut.proven().size(), Voices::kMostProven);
  EXPECT_EQ(sut.evicted(), 1u);
  EXPECT_EQ(sut.remembers_since(), 6000u) << "a frame of it may have been heard before";
  EXPECT_NE(sut.find_proven(voice(0)), nullptr);
  EXPECT_EQ(sut.find_proven(voice(1)), nullptr);
}

TEST(Voices, TheStrangerNotHeardForLongestMakesPlace) {
  Voices sut(0);
  for (std::size_t i = 0; i < Voices::kMostStrangers; ++i) sut.heard(voice(i), 10 + i);
  sut.heard(voice(0), 5000);
  sut.heard(voice(Voices::kMostStrangers), 6000);
  EXPECT_EQ(sut.strangers().size(), Voices::kMostStrangers);
  EXPECT_EQ(sut.find_stranger(voice(1)), nullptr);
  EXPECT_NE(sut.find_stranger(voice(0)), nullptr);
  EXPECT_EQ(sut.evicted(), 0u);
}

}  // namespace
}  // namespace swarmtalk::frame
