// What a session's deliveries tell about losses, which messages its policies leave out, and what a
// publisher is told of the times it may add.
#include "tests/unit/daemon/session/session_harness.hpp"

namespace swarmtalk::daemon {
namespace {

TEST_F(SessionTest, DeliveriesTellWhatWasLostBeforeThem) {
  auto peer = greeted();
  subscribed(*peer, "hello");
  receive_on_air("hello", "one", 1);
  receive_on_air("hello", "four", 4);
  receive_on_air("hello", "three", 3);
  step();
  const auto messages = peer->receive();
  ASSERT_EQ(messages.size(), 3u);
  EXPECT_FALSE(messages[0].deliver().has_lost_before());
  EXPECT_EQ(messages[1].deliver().lost_before().air(), 2u);
  EXPECT_EQ(messages[2].deliver().lost_before().late(), 1u);
  EXPECT_EQ(counters_.messages_lost_air, 2u);
  EXPECT_EQ(counters_.messages_late, 1u);
  ipc::Status status;
  status_.fill_status(status);
  EXPECT_EQ(status.channels(0).received(), 3u);
  EXPECT_EQ(status.channels(0).lost_air(), 2u);
  EXPECT_EQ(status.channels(0).late(), 1u);
}

TEST_F(SessionTest, LossBeforeAMessageThatIsTooFarIsToldWithTheNext) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.set_request_id(1);
  envelope.mutable_subscribe()->mutable_channel()->set_name("hello");
  envelope.mutable_subscribe()->set_max_distance_m(3);
  peer->send(envelope);
  step();
  receive_on_air("hello", "near", 1);
  receive_on_air("hello", "far", 3, 4.0f);
  receive_on_air("hello", "near", 4);
  step();
  const auto messages = peer->receive();
  ASSERT_EQ(messages.size(), 3u);
  EXPECT_EQ(messages[2].deliver().lost_before().air(), 1u);
}

TEST_F(SessionTest, MessagesOlderThanTheSubscriptionsLimitAreDroppedAndCounted) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.set_request_id(1);
  envelope.mutable_subscribe()->mutable_channel()->set_name("hello");
  envelope.mutable_subscribe()->set_max_age_ms(1000);
  peer->send(envelope);
  step();
  const std::uint64_t now_ns = monotonic_ns();
  receive_on_air("hello", "old", 1, 2.0f, now_ns - 1'500'000'000);
  receive_on_air("hello", "young", 2, 2.0f, now_ns);
  step();
  const auto messages = peer->receive();
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(messages[1].deliver().payload(), "young");
  EXPECT_EQ(messages[1].deliver().lost_before().daemon(), 1u);
  EXPECT_EQ(counters_.deliveries_dropped_old, 1u);
}

TEST_F(SessionTest, AgeThatEverythingHasIsRefused) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.set_request_id(1);
  envelope.mutable_subscribe()->mutable_channel()->set_name("hello");
  envelope.mutable_subscribe()->set_max_age_ms(0);
  peer->send(envelope);
  step();
  EXPECT_EQ(peer->receive().at(0).failure().code(), ipc::ERROR_BAD_ARGUMENT);
}

TEST_F(SessionTest, TimeInBuffersOnTheWayCountsAsAge) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.set_request_id(1);
  envelope.mutable_subscribe()->mutable_channel()->set_name("hello");
  envelope.mutable_subscribe()->set_max_age_ms(1000);
  peer->send(envelope);
  step();
  MessageHead head;
  head.channel = 1;
  head.received_at_ns = monotonic_ns();
  head.buffering_delay_us = 2'000'000;
  station_.receive(head, "late");
  step();
  EXPECT_EQ(peer->receive().size(), 1u);  // subscribed
  EXPECT_EQ(counters_.deliveries_dropped_old, 1u);
}

TEST_F(SessionTest, WhatWaitedForAClientThatLeavesIsCounted) {
  auto peer = greeted();
  subscribed(*peer, "hello");
  receive_on_air("hello", "one", 1);
  receive_on_air("hello", "two", 2);
  clients_.close_all("test");
  EXPECT_EQ(counters_.deliveries_queued, 2u);
  EXPECT_EQ(counters_.deliveries_dropped_closed, 2u);
}

TEST_F(SessionTest, MessagesRefusedInAClientAreCountedByProgramAndChannel) {
  auto peer = greeted();
  const auto id = advertised(*peer, "hello");
  ipc::Envelope envelope;
  envelope.mutable_client_loss()->set_publisher_id(id);
  envelope.mutable_client_loss()->set_refused(7);
  peer->send(envelope);
  envelope.mutable_client_loss()->set_publisher_id(id + 1);  // of nobody
  peer->send(envelope);
  step();
  EXPECT_TRUE(peer->receive().empty());
  EXPECT_EQ(counters_.messages_busy_in_client, 7u);
  EXPECT_EQ(counters_.deliveries_lost_in_client, 0u);
  for (int i = 1; i <= 2; ++i) {  // and one that the daemon refuses itself
    ipc::Envelope message;
    message.mutable_publish()->set_publisher_id(id);
    message.mutable_publish()->set_publish_number(static_cast<std::uint64_t>(i));
    peer->send(message);
  }
  step();
  EXPECT_EQ(counters_.messages_busy, 1u);
  ipc::Status status;
  status_.fill_status(status);
  ASSERT_EQ(status.clients_served_size(), 1);
  EXPECT_EQ(status.clients_served(0).refused(), 8u);
  ASSERT_EQ(status.channels_size(), 1);
  EXPECT_EQ(status.channels(0).refused(), 8u);
}

TEST_F(SessionTest, SubscriptionsThatLookOnAreCountedByThemselvesToo) {
  auto peer = greeted();
  subscribed(*peer, "hello");
  ipc::Envelope looking;
  looking.set_request_id(2);
  looking.mutable_subscribe()->mutable_channel()->set_name("hello");
  looking.mutable_subscribe()->set_looks_on(true);
  peer->send(looking);
  step();
  ipc::Status status;
  status_.fill_status(status);
  ASSERT_EQ(status.channels_size(), 1);
  EXPECT_EQ(status.channels(0).subscribers(), 2u);
  EXPECT_EQ(status.channels(0).onlookers(), 1u);
}

TEST_F(SessionTest, LossInAClientIsCountedAsItSays) {
  auto peer = greeted();
  const auto id = subscribed(*peer, "hello");
  ipc::Envelope envelope;
  envelope.mutable_client_loss()->set_subscription_id(id);
  envelope.mutable_client_loss()->set_messages(7);
  peer->send(envelope);
  step();
  EXPECT_TRUE(peer->receive().empty());
  EXPECT_EQ(counters_.deliveries_lost_in_client, 7u);
  ipc::Status status;
  status_.fill_status(status);
  ASSERT_EQ(status.clients_served_size(), 1);
  EXPECT_EQ(status.clients_served(0).lost_client(), 7u);
  EXPECT_EQ(status.clients_served(0).name(), "test");
}

TEST_F(SessionTest, AReplyOvertakesDeliveriesThatTheSocketHasNotTaken) {
  limits_.socket_buffer_bytes = 4096;
  auto peer = greeted();
  subscribed(*peer, "hello", 1000);
  for (std::uint32_t i = 1; i <= 300; ++i) receive_on_air("hello", std::string(1000, 'x'), i);
  step();  // 64 KiB are being written, the kernel has taken less
  ipc::Envelope envelope;
  envelope.set_request_id(4);
  envelope.mutable_get_pose();
  peer->send(envelope);
  step();
  int before = 0;
  bool is_answered = false;
  while (!is_answered && before < 300) {
    for (const auto& frame : peer->receive()) {
      is_answered = is_answered || frame.request_id() == 4;
      before += is_answered ? 0 : 1;
    }
    step();
  }
  EXPECT_TRUE(is_answered);
  EXPECT_LT(before, 15);  // what the kernel had, and the frame that was begun
}

TEST_F(SessionTest, RepliesToAClientThatReadsLateComeInTheirOrder) {
  limits_.socket_buffer_bytes = 4096;
  auto peer = greeted();
  subscribed(*peer, "hello", 100);
  constexpr std::uint32_t kRequests = 2000;
  for (std::uint32_t i = 1; i <= kRequests; ++i) {
    ipc::Envelope envelope;
    envelope.set_request_id(i);
    envelope.mutable_get_pose();
    peer->send(envelope);
    if (i % 20 == 0) step();
    if (i % 300 == 0) receive_on_air("hello", "between them", i);
  }
  std::uint32_t last = 0;
  for (int turns = 0; last < kRequests && turns < 1000; ++turns) {
    for (const auto& frame : peer->receive()) {
      if (frame.request_id() == 0) continue;
      ASSERT_EQ(frame.request_id(), last + 1);
      ++last;
    }
    step();
  }
  EXPECT_EQ(last, kRequests);
}

TEST_F(SessionTest, APublisherIsToldWhetherItsChannelIsTimestamped) {
  auto peer = greeted();
  for (const bool is_timestamped : {true, false}) {
    ipc::Envelope envelope;
    envelope.set_request_id(1);
    ipc::Advertise& request = *envelope.mutable_advertise();
    request.mutable_channel()->set_name(is_timestamped ? "timed" : "plain");
    request.set_timestamped(is_timestamped);
    peer->send(envelope);
    step();
    const ipc::Advertised answer = peer->receive().at(0).advertised();
    ASSERT_TRUE(answer.has_timestamped());
    EXPECT_EQ(answer.timestamped(), is_timestamped);
  }
}

}  // namespace
}  // namespace swarmtalk::daemon
