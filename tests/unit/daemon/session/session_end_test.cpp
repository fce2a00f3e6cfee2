// How a client's end is noticed, and what becomes of what it sent before; clients that are too
// many.
#include <functional>
#include <string>
#include <vector>

#include "tests/support/patience.hpp"
#include "tests/unit/daemon/session/session_harness.hpp"

namespace swarmtalk::daemon {
namespace {

std::string publication(std::uint32_t publisher, std::uint64_t number, const std::string& payload) {
  ipc::Envelope envelope;
  ipc::Publish& body = *envelope.mutable_publish();
  body.set_publisher_id(publisher);
  body.set_publish_number(number);
  body.set_payload(payload);
  std::string frame;
  ipc::append_frame(envelope, frame);
  return frame;
}

TEST_F(SessionTest, ClientThatDiesLeavesNothingBehind) {
  auto peer = greeted();
  subscribed(*peer, "hello");
  const auto id = advertised(*peer, "hello");
  peer->publish(id, 1, "x");
  step();
  receive_on_air("hello", "y");
  peer->hang_up();
  step();
  EXPECT_EQ(clients_.size(), 0u);
  EXPECT_TRUE(hub_.channels().empty());
  station_.leave(1);  // nobody is told, nothing breaks
  step();
}

// More than one turn reads, and the first message is answered before the last is read.
TEST_F(SessionTest, AllThatAClientSentBeforeItEndedLeaves) {
  constexpr std::uint64_t kMessages = 600;
  limits_.publish_queue_max = kMessages;
  limits_.waiting_messages_per_client = kMessages;
  auto peer = greeted();
  const auto id = advertised(*peer, "hello", kMessages);
  std::string frames = publication(id + 1, 1, "to a publisher that there is not: refused");
  for (std::uint64_t i = 1; i <= kMessages; ++i) frames += publication(id, i, std::to_string(i));
  peer->send_bytes(frames);
  peer->hang_up();
  step();
  EXPECT_EQ(clients_.size(), 0u);
  EXPECT_EQ(counters_.messages_published, kMessages);
  for (std::uint64_t i = 1; i <= kMessages; ++i) station_.leave(1);
  ASSERT_EQ(station_.sent.size(), kMessages);
  EXPECT_EQ(station_.sent.back().payload, std::to_string(kMessages));
  EXPECT_TRUE(hub_.channels().empty());
}

TEST_F(SessionTest, WhoEndsOnlyItsOwnSideHearsAllAnswers) {
  auto peer = greeted();
  constexpr std::uint32_t kRequests = 100;
  for (std::uint32_t i = 1; i <= kRequests; ++i) peer->subscribe(i, "c" + std::to_string(i));
  peer->end_requests();
  step();
  const auto answers = peer->receive();
  ASSERT_EQ(answers.size(), kRequests);
  EXPECT_EQ(answers.back().request_id(), kRequests);
  EXPECT_TRUE(peer->is_closed);
  EXPECT_EQ(clients_.size(), 0u);
}

TEST_F(SessionTest, AClientThatHangsUpWithGarbageIsClosed) {
  auto peer = greeted();
  const auto id = advertised(*peer, "hello", 300);
  std::string frames;
  for (std::uint64_t i = 1; i <= 400; ++i) frames += publication(id, i, "x");
  peer->send_bytes(frames + std::string(8, '\xff'));
  peer->hang_up();
  step();
  EXPECT_EQ(clients_.size(), 0u);
  EXPECT_EQ(counters_.clients_malformed, 1u);
}

TEST_F(SessionTest, OneClientTooManyIsToldWhyAndClosed) {
  limits_.clients = 2;
  auto first = greeted();
  auto second = greeted();
  auto third = connect();
  step();
  const auto replies = third->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].failure().code(), ipc::ERROR_LIMIT);
  EXPECT_EQ(replies[0].failure().limit(), 2u);
  EXPECT_TRUE(third->is_closed);
  EXPECT_EQ(counters_.clients_refused, 1u);
  first->hang_up();
  step();
  greeted();
}

TEST_F(SessionTest, EachOfManyClientsThatAreTooManyIsToldWhy) {
  limits_.clients = 1;
  auto first = greeted();
  for (int i = 0; i < 100; ++i) {
    auto another = connect();
    step();
    ASSERT_EQ(another->receive().size(), 1u) << i;
    another->hang_up();
    step();
    ASSERT_EQ(clients_.size(), 1u) << i;
  }
  first->hang_up();
  step();
  greeted();
}

TEST_F(SessionTest, RefusedClientsThatDoNotHangUpAreClosedEachInItsTime) {
  limits_.clients = 1;
  auto served = greeted();
  auto first = connect();
  step();
  const auto closed = [&](TestPeer& peer) {
    const auto deadline = std::chrono::steady_clock::now() + test::kPatience;
    while (!peer.is_gone() && std::chrono::steady_clock::now() < deadline) {
      io_.restart();
      io_.run_one_for(test::kPatience);
    }
    return peer.is_gone();
  };
  EXPECT_TRUE(closed(*first));
  auto second = connect();
  step();
  auto third = connect();
  step();
  EXPECT_TRUE(closed(*second));
  EXPECT_TRUE(closed(*third));
  EXPECT_EQ(counters_.clients_silent, 0u);
  EXPECT_GT(advertised(*served, "hello"), 0u) << "who is served stays";
}

/// Asks until nothing more is taken. @return how often
std::uint32_t ask_until_full(TestPeer& peer, const std::function<void()>& step) {
  ipc::Envelope envelope;
  envelope.mutable_get_status();
  for (std::uint32_t number = 1; number <= 100'000; ++number) {
    envelope.set_request_id(number);
    if (!peer.try_send(envelope)) return number - 1;
    step();
  }
  ADD_FAILURE() << "the daemon goes on reading";
  return 0;
}

TEST_F(SessionTest, ClientThatDoesNotReadItsRepliesIsReadNoFurtherUntilItDoes) {
  limits_.reply_bytes = 64 << 10;
  auto peer = greeted();
  auto other = greeted();
  const std::uint32_t asked = ask_until_full(*peer, [this] { step(); });
  ASSERT_EQ(clients_.size(), 2u);
  EXPECT_EQ(counters_.clients_not_reading, 1u);
  google::protobuf::RepeatedPtrField<ipc::ClientStatus> statuses;
  clients_.fill(statuses);
  EXPECT_GT(statuses[0].queued_bytes(), limits_.reply_bytes);
  EXPECT_LT(statuses[0].queued_bytes(), 5 * limits_.reply_bytes);
  subscribed(*other, "hello");  // nobody else notices
  std::uint32_t answered = 0;
  for (std::uint32_t i = 0; i <= asked; ++i) {
    for (const ipc::Envelope& reply : peer->receive()) EXPECT_EQ(reply.request_id(), ++answered);
    step();
  }
  EXPECT_EQ(answered, asked);
  subscribed(*peer, "hello");
  EXPECT_EQ(counters_.clients_not_reading, 1u);
}

TEST_F(SessionTest, WhatAClientSentThatHangsUpWithItsRepliesUnreadStillCounts) {
  limits_.reply_bytes = 64 << 10;
  auto peer = greeted();
  const std::uint32_t publisher = advertised(*peer, "hello", 4);
  ask_until_full(*peer, [this] { step(); });
  const std::uint64_t before = counters_.clients_not_reading;
  std::vector<std::string> texts{"one", "two"};
  std::uint64_t number = 0;
  for (int i = 0; i < 100'000 && number < texts.size(); ++i) {
    // Room for two messages more, and not for the daemon to write a reply.
    ipc::Envelope envelope;
    envelope.mutable_publish()->set_publisher_id(publisher);
    envelope.mutable_publish()->set_publish_number(number + 1);
    envelope.mutable_publish()->set_payload(texts[number]);
    if (peer->try_send(envelope)) {
      ++number;
    } else {
      ASSERT_FALSE(peer->receive().empty());
      step();
    }
  }
  peer->hang_up();
  for (int i = 0; i < 1000 && clients_.size() > 0; ++i) step();
  EXPECT_EQ(clients_.size(), 0u);
  EXPECT_EQ(counters_.clients_not_reading, before);
  EXPECT_EQ(counters_.messages_published, 2u);
}

TEST_F(SessionTest, RefusedClientMaySayHelloBeforeItReadsWhy) {
  limits_.clients = 1;
  auto first = greeted();
  auto second = connect();
  step();
  second->hello();  // would be EPIPE on a closed socket
  step();
  const auto replies = second->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].failure().code(), ipc::ERROR_LIMIT);
  EXPECT_EQ(clients_.size(), 1u);  // it takes nobody's place
  first->hang_up();
  step();
  greeted();
  second->hang_up();
  step();
  EXPECT_EQ(counters_.clients_refused, 1u);
}

}  // namespace
}  // namespace swarmtalk::daemon
