// The outbox alone, between a registry and fake stations.
#include "daemon/hub/outbox.hpp"

#include <gtest/gtest.h>

#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

class Outgoing final : public OutgoingListener {
 public:
  void on_outgoing(const Publication& publication, std::size_t station, Channel&,
                   std::uint32_t number) override {
    heard.emplace_back(publication.payload, station, number);
  }
  void on_stayed_here(const Publication& publication, Channel&) override {
    stayed.push_back(publication.payload);
  }
  std::vector<std::tuple<std::string, std::size_t, std::uint32_t>> heard;
  std::vector<std::string> stayed;
};

class OutboxAlone : public testing::Test {
 protected:
  OutboxAlone() {
    stations_.add(a_);
    stations_.add(b_);
    Channel* channel = nullptr;
    EXPECT_FALSE(registry_.use({"", 1, std::nullopt}, publisher_.held_name, channel));
    channel_ = channel;
    publisher_.client = &client_;
    publisher_.channel = 1;
    publisher_.queue_limit = 2;
  }
  void publish(std::uint64_t number, const std::string& payload) {
    outbox_.publish(publisher_, *channel_, number, payload, 3, std::nullopt);
  }
  void leave(std::size_t station) {
    (station == 0 ? a_ : b_).busy.clear();
    outbox_.on_sent(station, 1);
  }

  DeafUser user_;
  FakeStation a_{user_, "a"};
  FakeStation b_{user_, "b"};
  StationList stations_;
  ChannelTable names_{{}};
  ChannelRegistry registry_{names_, stations_};
  DaemonCounters counters_;
  Outgoing outgoing_;
  Outbox outbox_{stations_, registry_, counters_, outgoing_};
  FakeClient client_;
  Publisher publisher_;
  Channel* channel_ = nullptr;
};

TEST_F(OutboxAlone, AsksEachStationForTheRedundancyOfItsPublisher) {
  publish(1, "x");
  EXPECT_TRUE(a_.protections.empty());
  publisher_.redundancy = 3;
  publish(2, "y");
  a_.leave(1);
  b_.leave(1);
  outbox_.on_sent(0, 1);
  outbox_.on_sent(1, 1);
  EXPECT_EQ(a_.protections, (std::vector<std::uint8_t>{3}));
  EXPECT_EQ(b_.protections, (std::vector<std::uint8_t>{3}));
}

TEST_F(OutboxAlone, TellsThePublisherWhenTheLastStationHasSent) {
  publish(1, "x");
  EXPECT_EQ(outgoing_.heard,
            (std::vector<std::tuple<std::string, std::size_t, std::uint32_t>>{{"x", 0, 1}}));
  outbox_.on_sent(0, 1);
  EXPECT_TRUE(client_.sent.empty());
  EXPECT_EQ(outbox_.waiting(), 1u);
  outbox_.on_sent(1, 1);
  EXPECT_EQ(client_.sent, std::vector<std::uint64_t>{1});
  EXPECT_EQ(outbox_.waiting(), 0u);
}

TEST_F(OutboxAlone, SendsOnePublishersMessagesOneAfterTheOther) {
  b_.set_up(false);
  publish(1, "first");
  publish(2, "second");
  EXPECT_EQ(a_.sent.size(), 1u);
  a_.busy.clear();
  outbox_.on_sent(0, 1);
  ASSERT_EQ(a_.sent.size(), 2u);
  EXPECT_EQ(a_.sent[1].payload, "second");
}

TEST_F(OutboxAlone, DropsTheOldestOfAFullQueue) {
  for (std::uint64_t i = 1; i <= 4; ++i) publish(i, "x");
  EXPECT_EQ(client_.unsent,
            (std::vector<std::pair<std::uint64_t, ipc::ErrorCode>>{{2, ipc::ERROR_DROPPED}}));
  EXPECT_EQ(outbox_.waiting(), 3u);
}

TEST_F(OutboxAlone, GivesUpWhatWaitsForDeadLinks) {
  int woken = 0;
  outbox_.set_waiting_hook([&] { ++woken; });
  publish(1, "x");
  publish(2, "y");
  EXPECT_EQ(woken, 1);
  a_.set_up(false);
  b_.set_up(false);
  EXPECT_FALSE(outbox_.give_up_on_dead_links());
  EXPECT_EQ(client_.unsent, (std::vector<std::pair<std::uint64_t, ipc::ErrorCode>>{
                                {1, ipc::ERROR_LINK_DOWN}, {2, ipc::ERROR_LINK_DOWN}}));
  EXPECT_EQ(outgoing_.heard.size(), 1u);
  EXPECT_EQ(outgoing_.stayed, std::vector<std::string>{"y"}) << "x was heard as it began to leave";
}

TEST_F(OutboxAlone, LetsAllMessagesLeaveWithoutTheirPublisher) {
  publish(1, "x");
  publish(2, "y");
  publish(3, "z");
  const Share& share = client_.share;
  EXPECT_EQ(share.waiting_messages, 3u);
  outbox_.withdraw(publisher_);
  EXPECT_EQ(share.waiting_messages, 0u);
  EXPECT_EQ(outbox_.waiting(), 3u);
  for (std::uint32_t left = 3; left > 0; --left) {
    leave(0);
    EXPECT_EQ(outbox_.waiting(), left);  // one at a time: the other station still has it
    leave(1);
    EXPECT_EQ(outbox_.waiting(), left - 1);
  }
  EXPECT_EQ(a_.sent.back().payload, "z");
  EXPECT_TRUE(client_.sent.empty());
  EXPECT_EQ(counters_.messages_sent, 3u);
}

TEST_F(OutboxAlone, GivesUpWhatAPublisherThatWentHasLeftWhenTheLinksGoDown) {
  for (std::uint64_t i = 1; i <= 3; ++i) publish(i, "x");
  outbox_.withdraw(publisher_);
  a_.set_up(false);
  b_.set_up(false);
  EXPECT_FALSE(outbox_.give_up_on_dead_links());
  EXPECT_TRUE(client_.unsent.empty());
  EXPECT_EQ(counters_.messages_link_down, 3u);
}

TEST_F(OutboxAlone, APublisherMayBeginAnewWhileWhatItLeftIsStillLeaving) {
  publish(1, "x");
  publish(2, "y");
  outbox_.withdraw(publisher_);
  publish(3, "z");  // after the one in flight, beside those that are left
  for (int i = 0; i < 3; ++i) {
    leave(0);
    leave(1);
  }
  EXPECT_EQ(outbox_.waiting(), 0u);
  EXPECT_EQ(client_.sent, (std::vector<std::uint64_t>{3}));
  EXPECT_EQ(counters_.messages_sent, 3u);
}

TEST_F(OutboxAlone, KeepsTheNewestCopiesOfARuleForASlowLink) {
  GatewayRule rule;
  rule.to_link = 1;
  rule.to_channel = 1;
  rule.queue_messages = 2;
  const std::string text = "abcd";
  const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(text.data()),
                                            text.size());
  for (std::size_t i = 0; i < 4; ++i) {
    outbox_.copy(rule, *channel_, bytes.subspan(i, 1), {"a", 9, 0, 1}, 2);
  }
  EXPECT_EQ(counters_.gateway_full, 1u);
  for (int i = 0; i < 3; ++i) {
    b_.busy.clear();
    outbox_.on_sent(1, 1);
  }
  ASSERT_EQ(b_.sent.size(), 3u);
  EXPECT_EQ(b_.sent[0].payload, "a");
  EXPECT_EQ(b_.sent[1].payload, "c");
  EXPECT_EQ(b_.sent[2].payload, "d");
  EXPECT_TRUE(a_.sent.empty());
}

TEST_F(OutboxAlone, CountsTheCopiesOfEachRuleByItself) {
  GatewayRule rules[2];
  for (GatewayRule& rule : rules) {
    rule.to_link = 1;
    rule.to_channel = 1;
    rule.queue_messages = 2;
  }
  const std::string text = "abcde";
  const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(text.data()),
                                            text.size());
  // The first is in flight; of each rule two wait.
  for (std::size_t i = 0; i < 5; ++i) {
    outbox_.copy(rules[i % 2], *channel_, bytes.subspan(i, 1), {"a", 9, 0, 1}, 2);
  }
  EXPECT_EQ(counters_.gateway_full, 0u);
  outbox_.copy(rules[1], *channel_, bytes.first(1), {"a", 9, 0, 1}, 2);
  EXPECT_EQ(counters_.gateway_full, 1u);
  std::string left;
  for (int i = 0; i < 5; ++i) {
    b_.busy.clear();
    outbox_.on_sent(1, 1);
  }
  for (const auto& sent : b_.sent) left += sent.payload;
  EXPECT_EQ(left, "acdea") << "the oldest of the second rule made room";
}

}  // namespace
}  // namespace swarmtalk::daemon
