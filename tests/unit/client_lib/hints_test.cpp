// What a programmer is told.
#include "client_lib/hints.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::client {
namespace {

ChannelKey named(const std::string& name) {
  ChannelKey key;
  key.name = name;
  return key;
}

class HintsAlone : public testing::Test {
 protected:
  bool are_wanted_ = true;
  std::vector<std::string> told_;
  Hints hints_{[this] { return are_wanted_; },
               [this](const std::string& text) { told_.push_back(text); }};
};

TEST_F(HintsAlone, TellOnceOfDigitsThatAreAName) {
  hints_.note_name(named(""));
  hints_.note_name(named("r2d2"));
  EXPECT_TRUE(told_.empty());
  hints_.note_name(named("5"));
  hints_.note_name(named("6"));
  ASSERT_EQ(told_.size(), 1u);
  EXPECT_NE(told_[0].find("channel \"5\" is a name here"), std::string::npos);
}

TEST_F(HintsAlone, TellOnceThatThereAreNoWildcards) {
  hints_.note_name(named("robots"));
  EXPECT_TRUE(told_.empty());
  hints_.note_name(named("robots/+"));
  hints_.note_name(named("#"));
  ASSERT_EQ(told_.size(), 1u);
  EXPECT_NE(told_[0].find("'robots/+' is the name of one channel"), std::string::npos);
}

TEST_F(HintsAlone, TellOnceWhatANeighbourNeedsToBeHeard) {
  hints_.note_nobody_around();
  hints_.note_nobody_around();
  ASSERT_EQ(told_.size(), 1u);
  EXPECT_NE(told_[0].find("beacon_ms"), std::string::npos);
}

TEST_F(HintsAlone, TellOfASubscriptionThatEndsBeforeAnythingRan) {
  hints_.note_end("channel hello");
  ASSERT_EQ(told_.size(), 1u);
  EXPECT_NE(told_[0].find("channel hello was subscribed to and nothing was heard"),
            std::string::npos);
  hints_.note_running();
  hints_.note_end("channel hello");
  EXPECT_EQ(told_.size(), 1u);
}

TEST_F(HintsAlone, AreNotToldToAProgramThatPrintsItsOwnErrors) {
  are_wanted_ = false;
  hints_.tell("anything");
  hints_.note_name(named("5"));
  hints_.note_name(named("#"));
  hints_.note_nobody_around();
  hints_.note_end("channel hello");
  EXPECT_TRUE(told_.empty());
}

TEST(Hint, IsALineOnStderr) {
  testing::internal::CaptureStderr();
  print_hint("keep what subscribe() returns");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "swarmtalk: keep what subscribe() returns\n");
}

class Listener : public test::ClientTest {};

TEST_F(Listener, OfAWildcardIsToldThatThereAreNone) {
  test::FakeDaemon daemon(path);
  Client plain("plain", options());
  ASSERT_TRUE(plain.connect());
  testing::internal::CaptureStderr();
  const auto all = plain.subscribe("#", [](const Message&) {});
  const auto more = plain.subscribe("robots/+", [](const Message&) {});
  const auto own = plain.subscribe("robots", [](const Message&) {});
  const std::string told = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 1) << told;
  EXPECT_NE(told.find("'#' is the name of one channel: there are no wildcards"), std::string::npos)
      << told;
  static_cast<void>(plain.process());
}

TEST_F(Listener, OfDigitsInQuotesIsToldThatTheyAreAName) {
  test::FakeDaemon daemon(path);
  Client plain("plain", options());
  ASSERT_TRUE(plain.connect());
  testing::internal::CaptureStderr();
  const auto name = plain.advertise("5");
  const auto number = plain.channel(5).publisher();
  const std::string told = testing::internal::GetCapturedStderr();
  EXPECT_EQ(
      told,
      "swarmtalk: channel \"5\" is a name here, and not channel number 5; for the number leave "
      "out the quotes\n");
}

}  // namespace
}  // namespace swarmtalk::client
