// LinkState: what is logged of a link that changes often.
#include "drivers/link/link_state.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "tests/support/turned_clock.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;
using Lines = std::vector<std::string>;

class LinkStateTest : public testing::Test {
 protected:
  boost::asio::io_context io_;
  Lines lines_;
  std::optional<LinkState> state_{std::in_place, io_,
                                  [this](bool is_up, const std::string& line) {
                                    lines_.push_back((is_up ? "up: " : "down: ") + line);
                                  },
                                  std::chrono::seconds(1)};
};

TEST_F(LinkStateTest, TellsWhetherTheLinkWentUpOrDown) {
  EXPECT_FALSE(state_->is_up());
  EXPECT_TRUE(state_->set(true, "up"));
  EXPECT_TRUE(state_->is_up());
  EXPECT_FALSE(state_->set(true, "up, its MTU is small"));
  EXPECT_EQ(state_->text(), "up, its MTU is small");
  EXPECT_TRUE(state_->set(false, "no carrier"));
}

TEST_F(LinkStateTest, LogsTheFirstChangeAtOnceAndTheSameTextNever) {
  state_->set(false, "no carrier");
  state_->set(false, "no carrier");
  EXPECT_EQ(lines_, Lines{"down: no carrier"});
  test::pass(io_, 1h);
  EXPECT_EQ(lines_.size(), 1u);
}

TEST_F(LinkStateTest, SumsUpWhatChangesUntilTheNextLine) {
  state_->set(true, "up");
  for (int i = 0; i < 5; ++i) {
    state_->set(false, "no carrier");
    state_->set(true, "up");
  }
  state_->set(false, "gone");
  test::pass(io_, 999ms);
  EXPECT_EQ(lines_, Lines{"up: up"});
  test::pass(io_, 1ms);
  EXPECT_EQ(lines_, (Lines{"up: up", "down: gone (11 changes since the last line)"}));
}

TEST_F(LinkStateTest, OneChangeMeanwhileIsToldWithoutACount) {
  state_->set(true, "up");
  state_->set(false, "gone");
  test::pass(io_, 1s);
  EXPECT_EQ(lines_, (Lines{"up: up", "down: gone"}));
}

TEST_F(LinkStateTest, LogsNothingOnceItIsGone) {
  state_->set(true, "up");
  state_->set(false, "gone");
  state_.reset();
  test::pass(io_, 1h);
  EXPECT_EQ(lines_.size(), 1u);
}

}  // namespace
}  // namespace swarmtalk::drivers
