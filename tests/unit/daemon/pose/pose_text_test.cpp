#include "daemon/pose/pose_text.hpp"

#include <gtest/gtest.h>

#include <string>

namespace swarmtalk::daemon {
namespace {

TEST(PoseText, ReadsThreeNumbersBetweenBlanks) {
  const auto pose = parse_pose_text(" 1.5\t-2e-1  +3\r\n");
  ASSERT_TRUE(pose);
  EXPECT_DOUBLE_EQ(pose->x_m, 1.5);
  EXPECT_DOUBLE_EQ(pose->y_m, -0.2);
  EXPECT_DOUBLE_EQ(pose->theta_rad, 3.0);
  EXPECT_DOUBLE_EQ(pose->age_s, 0.0);
}

TEST(PoseText, TakesAnAge) {
  const auto pose = parse_pose_text("0 0 0 0.25");
  ASSERT_TRUE(pose);
  EXPECT_DOUBLE_EQ(pose->age_s, 0.25);
}

TEST(PoseText, RefusesWhatIsNoPose) {
  for (const std::string text :
       {"", " ", "1 2", "1 2 3 4 5", "1,2,3", "a b c", "1 2 nan", "inf 0 0", "1 2 3 -1", "1 2 3x",
        "0x10 0 0", "1 2 +", "++1 2 3", "+-1 2 3", "1e999 0 0", "{\"x\": 1}", "1 2 3 ;"}) {
    EXPECT_FALSE(parse_pose_text(text)) << text;
  }
  EXPECT_FALSE(parse_pose_text(std::string("1 2 3\0", 6))) << "a zero byte";
  EXPECT_FALSE(parse_pose_text(std::string(300, ' ') + "1 2 3")) << "too long";
}

}  // namespace
}  // namespace swarmtalk::daemon
