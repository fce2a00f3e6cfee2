// What is refused before it reaches the daemon.
#include "client_lib/sender.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "tests/support/turned_clock.hpp"

namespace swarmtalk::client {
namespace {

class SenderAlone : public testing::Test {
 protected:
  SenderAlone() {
    auto key = std::make_shared<ChannelKey>();
    key->label = "channel hello";
    publisher_.key = key;
    publisher_.id = 1;
    publisher_.max_message_bytes = 10;
    publisher_.max_ttl = 3;
  }
  StatusCode send(std::string_view payload, std::optional<std::uint32_t> ttl = {}) {
    return sender_.publish(publisher_, payload, ttl, true).code();
  }

  std::mutex gate_;
  Connection connection_;
  Reports reports_;
  int rings_ = 0;
  int looks_ = 0;
  std::function<void()> look_;
  Sender sender_{gate_,
                 connection_,
                 reports_,
                 {[this] { ++rings_; },
                  [this] {
                    ++looks_;
                    if (look_) look_();
                  }}};
  PublisherState publisher_;
};

TEST_F(SenderAlone, RefusesWhatTheChannelDoesNotCarryAndReportsIt) {
  EXPECT_EQ(send("12345678901"), StatusCode::kTooLong);
  EXPECT_EQ(send("x", 4), StatusCode::kBadTtl);
  EXPECT_EQ(reports_.take().size(), 2u);
  EXPECT_FALSE(connection_.has_outgoing());
}

TEST_F(SenderAlone, IsBusyWhileTheMessageBeforeIsOnItsWay) {
  publisher_.sending = Sending::one_at_a_time();
  EXPECT_EQ(send("x"), StatusCode::kOk);
  EXPECT_TRUE(sender_.is_busy(publisher_));
  EXPECT_EQ(send("y"), StatusCode::kBusy);
  EXPECT_FALSE(reports_.has_any());
  publisher_.in_flight.clear();
  EXPECT_EQ(send("y"), StatusCode::kOk);
}

TEST_F(SenderAlone, LooksForAnswersWhereThereIsNoRoomOrManyAreUnread) {
  publisher_.sending = Sending::queued(2);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(send("x"), StatusCode::kOk);
  EXPECT_EQ(send("x"), StatusCode::kBusy) << "in a callback the owner is inside";
  EXPECT_EQ(looks_, 0);
  EXPECT_TRUE(sender_.is_busy(publisher_));
  EXPECT_EQ(looks_, 1);
  look_ = [this] { publisher_.in_flight.clear(); };
  EXPECT_FALSE(sender_.is_busy(publisher_));
  EXPECT_EQ(looks_, 2);
  publisher_.sending = Sending::newest(1);
  for (int i = 0; i < 65; ++i) EXPECT_EQ(send("x"), StatusCode::kOk);
  EXPECT_FALSE(sender_.is_busy(publisher_));
  EXPECT_EQ(looks_, 2);
  EXPECT_EQ(send("x"), StatusCode::kOk);
  EXPECT_FALSE(sender_.is_busy(publisher_));
  EXPECT_EQ(looks_, 3);
}

TEST_F(SenderAlone, IsBusyWhenTheAnswersToVeryManyWereNotRead) {
  publisher_.sending = Sending::newest(1);
  publisher_.sent = [](const Status&) {};
  for (int i = 0; i < 4096; ++i) ASSERT_EQ(send("x"), StatusCode::kOk);
  EXPECT_EQ(send("x"), StatusCode::kBusy);
  EXPECT_TRUE(sender_.is_busy(publisher_));
  EXPECT_EQ(looks_, 0);
  publisher_.in_flight.pop_front();
  EXPECT_EQ(send("x"), StatusCode::kOk);
}

TEST_F(SenderAlone, TellsTheDaemonOfRefusalsAtOnceAndLeavesTheRestToBeToldTogether) {
  publisher_.sending = Sending::one_at_a_time();
  EXPECT_EQ(send("x"), StatusCode::kOk);
  EXPECT_FALSE(sender_.take_has_refused());
  const std::size_t before = connection_.outgoing_bytes();
  EXPECT_EQ(send("y"), StatusCode::kBusy);
  const std::size_t told = connection_.outgoing_bytes();
  EXPECT_GT(told, before);
  EXPECT_EQ(publisher_.untold_refusals, 0u);
  test::pass(std::chrono::milliseconds(999));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(send("y"), StatusCode::kBusy);
  EXPECT_EQ(connection_.outgoing_bytes(), told) << "once a second";
  EXPECT_EQ(publisher_.untold_refusals, 3u);
  EXPECT_TRUE(sender_.take_has_refused());
  test::pass(std::chrono::milliseconds(1));
  EXPECT_EQ(send("y"), StatusCode::kBusy);
  EXPECT_EQ(publisher_.untold_refusals, 0u);
}

TEST_F(SenderAlone, SaysWhyAPublisherThatIsNotRegisteredCannotSend) {
  publisher_.id = 0;
  publisher_.status = Status(StatusCode::kBadChannel);
  EXPECT_EQ(send("x"), StatusCode::kBadChannel);
}

TEST(Reports, KeepAFewUntilTheyAreTaken) {
  Reports reports;
  for (int i = 0; i < 100; ++i) reports.add(Status(StatusCode::kTooLong));
  EXPECT_TRUE(reports.has_any());
  EXPECT_EQ(reports.take().size(), 16u);
  EXPECT_FALSE(reports.has_any());
}

}  // namespace
}  // namespace swarmtalk::client
