#include "text/nearest.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::text {
namespace {

TEST(Nearest, IsTheWordWithTheFewestChanges) {
  EXPECT_EQ(nearest("stauts", {"stats", "status", "sub"}), "stats");
  EXPECT_EQ(nearest("neighburs", {"neighbours", "node-id"}), "neighbours");
  EXPECT_EQ(nearest("xyzzy", {"status", "sub"}), "");
  EXPECT_EQ(nearest("a", {"b"}), "") << "all of it would change";
}

TEST(Nearest, IsNoneThatIsFar) {
  EXPECT_EQ(nearest("loop", {"log", "node"}), "");
  EXPECT_EQ(nearest("foo", {"log"}), "");
  EXPECT_EQ(nearest("--loop", {"--log"}), "") << "dashes are no letters";
  EXPECT_EQ(nearest("zz", {"id", "z"}), "");
  EXPECT_EQ(nearest("gateways", {"gate"}), "");
  EXPECT_EQ(nearest("---", {"--"}), "");
  EXPECT_EQ(nearest("", {"a"}), "");
}

TEST(Nearest, IsOneWithTwoLettersSwapped) {
  EXPECT_EQ(nearest("sbu", {"pub", "sub"}), "sub");
  EXPECT_EQ(nearest("ndoe", {"log", "node"}), "node");
}

TEST(Nearest, OfAChannelIsNearerForAShortName) {
  EXPECT_EQ(nearest_channel("chater", {"alarm", "chatter"}), "chatter");
  EXPECT_EQ(nearest_channel("hallo", {"hello"}), "hello");
  EXPECT_EQ(nearest_channel("hlalo", {"hello"}), "");
  EXPECT_EQ(nearest_channel("alarm", {"hello", "alarm"}), "") << "itself is not another";
}

TEST(Nearest, OfAChannelIsNoneThatDiffersInANumberAlone) {
  EXPECT_EQ(nearest_channel("robot_12", {"robot_1", "robot_3", "robot"}), "");
  EXPECT_EQ(nearest_channel("robot", {"robot_1", "robot1"}), "");
  EXPECT_EQ(nearest_channel("rebot_12", {"robot_12"}), "robot_12");
}

TEST(Nearest, OfAVeryLongChannelIsNotLookedFor) {
  EXPECT_EQ(nearest_channel(std::string(300, 'x'), {std::string(299, 'x')}), "");
}

}  // namespace
}  // namespace swarmtalk::text
