#include "cli/kilobot/calibration.hpp"

#include <gtest/gtest.h>

#include "cli/look/screen.hpp"

namespace swarmtalk::cli {
namespace {

class CalibrationTest : public testing::Test {
 protected:
  void press(std::initializer_list<int> keys) {
    for (const int key : keys) calibration_.press(key);
  }
  /// Sends all that waits. @return "left 71", "straight 65 65 save", "pause", "uid 12"
  std::vector<std::string> send_all() {
    std::vector<std::string> sent;
    while (calibration_.has_next()) {
      sent.push_back(text_of(calibration_.take_next()));
      calibration_.on_sent();
    }
    return sent;
  }
  static std::string text_of(const ipc::KilobotCommand& command) {
    if (command.action() == ipc::KILOBOT_PAUSE) return "pause";
    if (command.action() == ipc::KILOBOT_SET_UID) return "uid " + std::to_string(command.uid());
    std::string text = command.motion() == ipc::KILOBOT_LEFT    ? "left"
                       : command.motion() == ipc::KILOBOT_RIGHT ? "right"
                                                                : "straight";
    if (command.has_left()) text += " " + std::to_string(command.left());
    if (command.has_right()) text += " " + std::to_string(command.right());
    return text + (command.save() ? " save" : "");
  }
  std::string line(std::size_t index) const { return calibration_.lines("", 80).at(index); }
  std::string remark() const { return line(9); }

  Calibration calibration_;
};

using Sent = std::vector<std::string>;

TEST_F(CalibrationTest, SendsOnlyTheLatestOfWhatWasChangedMeanwhile) {
  press({Screen::kRight, Screen::kRight, '+', Screen::kDown, '-', Screen::kUp, '+'});
  EXPECT_EQ(send_all(), (Sent{"right 69", "left 74"}));
  EXPECT_EQ(line(3), "> turn left           74  sent");
  EXPECT_EQ(line(4), "  turn right          69  sent");
  EXPECT_EQ(line(5), "  straight left       65  not sent");
}

TEST_F(CalibrationTest, StaysWithinDutiesThatMotorsBear) {
  for (int i = 0; i < 20; ++i) press({Screen::kPageUp});
  EXPECT_EQ(send_all(), (Sent{"left 120"}));
  EXPECT_NE(remark().find("sent"), std::string::npos);
  press({'+'});
  EXPECT_FALSE(calibration_.has_next());
  EXPECT_NE(remark().find("120 is the most"), std::string::npos);
  for (int i = 0; i < 20; ++i) press({Screen::kPageDown});
  EXPECT_EQ(send_all(), (Sent{"left 0"}));
}

TEST_F(CalibrationTest, SavesAllThatWasSentTheLastMotionLast) {
  press({'s'});
  EXPECT_FALSE(calibration_.has_next());
  EXPECT_NE(remark().find("nothing to save"), std::string::npos);
  press({'+', Screen::kUp, '+'});  // left, then straight
  EXPECT_EQ(send_all(), (Sent{"left 71", "straight 65 66"}));
  EXPECT_NE(calibration_.summary().find("not saved"), std::string::npos);
  press({'s'});
  EXPECT_EQ(send_all(), (Sent{"left 71", "straight 65 66 save"}));
  EXPECT_EQ(line(3), "  turn left           71  sent and saved");
  EXPECT_EQ(line(4), "  turn right          70  not sent");
  EXPECT_EQ(calibration_.summary(),
            "turn left 71, straight left 65, straight right 66; save was sent");
  press({'q'});
  EXPECT_TRUE(calibration_.is_ending());
  EXPECT_FALSE(calibration_.has_next()) << "it stands still";
}

TEST_F(CalibrationTest, PausesARobotThatMayMoveBeforeItEnds) {
  press({'\n'});
  (void)calibration_.take_next();
  press({'+', 'q'});
  calibration_.on_sent();
  EXPECT_EQ(send_all(), (Sent{"pause"}));
  EXPECT_EQ(calibration_.summary(), "pause was sent") << "70 was sent, 71 is shown";
  Calibration untouched;
  untouched.quit();
  EXPECT_FALSE(untouched.has_next());
  EXPECT_EQ(untouched.summary(), "nothing was sent");
}

TEST_F(CalibrationTest, TakesAUidOfDigitsOnly) {
  press({'u', '7', 'x', '0', '0', '0', '0', '0', '\n'});
  EXPECT_NE(remark().find("0 to 65535"), std::string::npos);
  EXPECT_FALSE(calibration_.has_next());
  press({Screen::kBackspace, Screen::kBackspace, Screen::kBackspace, '\n'});
  EXPECT_EQ(send_all(), (Sent{"uid 70"}));
  EXPECT_EQ(line(7), "  uid                 70  sent and saved");
  press({'u', '9', 27});
  EXPECT_FALSE(calibration_.has_next());
  EXPECT_NE(remark().find("stays"), std::string::npos);
}

TEST_F(CalibrationTest, ForgetsWhatARobotBeforeHasHeard) {
  press({'+'});
  (void)calibration_.take_next();
  press({'+', 'n'});
  calibration_.on_sent();
  EXPECT_FALSE(calibration_.has_next());
  EXPECT_EQ(line(3), "> turn left           72  not sent");
  press({'s'});
  EXPECT_FALSE(calibration_.has_next());
  press({'q'});
  EXPECT_EQ(send_all(), (Sent{"pause"}));
}

TEST_F(CalibrationTest, ShowsWhyItWasNotSentAndDropsWhatWaits) {
  press({'+', Screen::kDown, '+'});
  (void)calibration_.take_next();
  calibration_.on_failed("the overhead controller is busy");
  EXPECT_FALSE(calibration_.has_next());
  EXPECT_EQ(remark(), "the overhead controller is busy");
  EXPECT_EQ(line(3), "  turn left           71  not sent");
  EXPECT_EQ(line(4), "> turn right          71  not sent");
}

TEST_F(CalibrationTest, FitsTheWidth) {
  calibration_.on_failed(std::string(200, 'x'));
  for (const std::string& each : calibration_.lines("table", 40)) EXPECT_LE(each.size(), 40u);
}

}  // namespace
}  // namespace swarmtalk::cli
