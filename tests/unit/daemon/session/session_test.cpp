#include "daemon/session/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/unit/daemon/session/session_harness.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::HasSubstr;

TEST_F(SessionTest, GreetsWithVersionAndNode) {
  auto peer = connect();
  peer->hello();
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].hello().major(), ipc::kProtocolMajor);
  EXPECT_EQ(replies[0].hello().node_id(), 5u);
  EXPECT_THAT(replies[0].hello().name(), HasSubstr("swarmtalkd "));
}

TEST_F(SessionTest, OtherMajorIsToldBothVersionsAndClosed) {
  auto peer = connect();
  peer->hello(7);
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].failure().code(), ipc::ERROR_VERSION);
  EXPECT_THAT(replies[0].failure().text(), HasSubstr("7.0"));
  EXPECT_THAT(replies[0].failure().text(), HasSubstr(std::to_string(ipc::kProtocolMajor) + "." +
                                                     std::to_string(ipc::kProtocolMinor)));
  EXPECT_TRUE(peer->is_closed);
  EXPECT_EQ(counters_.clients_other_version, 1u);
  EXPECT_EQ(counters_.clients_malformed, 0u);
}

TEST_F(SessionTest, FirstFrameMustBeHello) {
  auto peer = connect();
  peer->subscribe(1, "hello");
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].failure().code(), ipc::ERROR_MALFORMED);
  EXPECT_TRUE(peer->is_closed);
  EXPECT_EQ(counters_.clients_malformed, 1u);
}

TEST_F(SessionTest, GarbageIsAnsweredCountedAndClosed) {
  auto peer = greeted();
  peer->send_bytes(std::string(100, '\xFF'));
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].failure().code(), ipc::ERROR_MALFORMED);
  EXPECT_TRUE(peer->is_closed);
  EXPECT_EQ(counters_.clients_malformed, 1u);
  EXPECT_EQ(clients_.size(), 0u);
}

TEST_F(SessionTest, RandomBytesNeverDoHarm) {
  std::mt19937 random(20200513);
  for (int i = 0; i < 300; ++i) {
    auto peer = i % 2 == 0 ? connect() : greeted();
    std::string bytes(1 + random() % 500, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    if (i % 4 > 1) {  // a plausible length, so that the bytes are parsed
      bytes.replace(0, 4, std::string{static_cast<char>(bytes.size() & 0x7F), 0, 0, 0});
    }
    peer->send_bytes(bytes);
    step();
    peer->hang_up();
    step();
  }
  EXPECT_EQ(clients_.size(), 0u);
  greeted();
}

TEST_F(SessionTest, TwoBodiesInAFrameAreMalformed) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.mutable_get_pose();
  envelope.mutable_get_status();
  peer->send(envelope);
  step();
  EXPECT_EQ(peer->receive().at(0).failure().code(), ipc::ERROR_MALFORMED);
  EXPECT_TRUE(peer->is_closed);
}

TEST_F(SessionTest, AnIdWithoutABodyIsMalformed) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.set_request_id(9);
  peer->send(envelope);
  step();
  EXPECT_EQ(peer->receive().at(0).failure().code(), ipc::ERROR_MALFORMED);
  EXPECT_TRUE(peer->is_closed);
}

TEST_F(SessionTest, RequestOfANewerMinorIsUnsupportedAndTheSessionGoesOn) {
  auto peer = greeted();
  std::string bytes("\x07\0\0\0\x08\x09\xFA\x01\x02\x08\x01", 11);  // id 9, unknown field 31
  peer->send_bytes(bytes);
  ipc::Envelope envelope;
  envelope.set_request_id(10);
  envelope.mutable_get_pose();
  peer->send(envelope);
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 2u);
  EXPECT_EQ(replies[0].request_id(), 9u);
  EXPECT_EQ(replies[0].failure().code(), ipc::ERROR_UNSUPPORTED);
  EXPECT_TRUE(replies[1].has_pose());
  EXPECT_FALSE(peer->is_closed);
}

TEST_F(SessionTest, RequestsThatArriveInPiecesAreAnsweredWhenWhole) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.set_request_id(3);
  envelope.mutable_subscribe()->mutable_channel()->set_name("hello");
  std::string bytes;
  ipc::append_frame(envelope, bytes);
  for (const char byte : bytes) {
    EXPECT_TRUE(peer->receive().empty());
    peer->send_bytes(std::string(1, byte));
    step();
  }
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].request_id(), 3u);
  EXPECT_EQ(replies[0].subscribed().channel(), 1u);
}

TEST_F(SessionTest, DeliversWhatTheLinkHears) {
  auto peer = greeted();
  const auto id = subscribed(*peer, "hello");
  receive_on_air("hello", std::string("a\0b", 3), 77);
  step();
  const auto messages = peer->receive();
  ASSERT_EQ(messages.size(), 1u);
  const ipc::Deliver& deliver = messages[0].deliver();
  EXPECT_EQ(deliver.subscription_id(), id);
  EXPECT_EQ(deliver.payload(), std::string("a\0b", 3));
  EXPECT_EQ(deliver.sender(), 9u);
  EXPECT_EQ(deliver.message_number(), 77u);
  EXPECT_FLOAT_EQ(deliver.distance_m(), 2.0f);
  EXPECT_FLOAT_EQ(deliver.bearing_rad(), 0.5f);
  EXPECT_FALSE(deliver.has_sender_pose());
  EXPECT_FALSE(deliver.has_local());
  EXPECT_FALSE(deliver.has_buffering_delay_us());
}

TEST_F(SessionTest, UnsubscribedHearsNothingMore) {
  auto peer = greeted();
  const auto id = subscribed(*peer, "hello");
  receive_on_air("hello", "queued");  // not yet written when the request comes
  ipc::Envelope envelope;
  envelope.set_request_id(2);
  envelope.mutable_unsubscribe()->set_subscription_id(id);
  peer->send(envelope);
  step();
  peer->receive();
  receive_on_air("hello", "x");
  step();
  EXPECT_TRUE(peer->receive().empty());
}

TEST_F(SessionTest, UnknownIdsAreToldByName) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.set_request_id(2);
  envelope.mutable_unsubscribe()->set_subscription_id(99);
  peer->send(envelope);
  peer->publish(98, 5, "x");
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 2u);
  EXPECT_EQ(replies[0].failure().code(), ipc::ERROR_UNKNOWN_ID);
  EXPECT_EQ(replies[1].failure().code(), ipc::ERROR_UNKNOWN_ID);
  EXPECT_EQ(replies[1].failure().publisher_id(), 98u);
  EXPECT_EQ(replies[1].failure().publish_number(), 5u);
}

TEST_F(SessionTest, PublishIsAnsweredBySentOrFailure) {
  auto peer = greeted();
  const auto id = advertised(*peer, "hello");
  peer->publish(id, 1, "x");
  peer->publish(id, 2, "y");
  step();
  auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].failure().code(), ipc::ERROR_BUSY);
  EXPECT_EQ(replies[0].failure().publish_number(), 2u);
  station_.leave(1);
  step();
  replies = peer->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].sent().publish_number(), 1u);
}

TEST_F(SessionTest, SentTellsOfSeveralMessagesAtOnceIfAsked) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.set_request_id(1);
  ipc::Advertise& request = *envelope.mutable_advertise();
  request.mutable_channel()->set_name("hello");
  request.set_queue(7);
  request.set_sent_every(3);
  peer->send(envelope);
  step();
  const auto id = peer->receive().at(0).advertised().publisher_id();
  for (std::uint64_t number = 1; number <= 7; ++number) peer->publish(id, number, "x");
  std::vector<std::uint64_t> told;
  for (int i = 0; i < 7; ++i) {
    step();
    station_.leave(1);
    step();
    for (const auto& reply : peer->receive()) told.push_back(reply.sent().publish_number());
  }
  EXPECT_EQ(told, (std::vector<std::uint64_t>{3, 6}));
}

TEST_F(SessionTest, SentComesAtTheLatestWhenTheQueueIsFull) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.set_request_id(1);
  ipc::Advertise& request = *envelope.mutable_advertise();
  request.mutable_channel()->set_name("hello");
  request.set_queue(1);
  request.set_sent_every(1000);
  peer->send(envelope);
  step();
  const auto id = peer->receive().at(0).advertised().publisher_id();
  peer->publish(id, 1, "x");
  peer->publish(id, 2, "y");
  for (int i = 0; i < 2; ++i) {
    step();
    station_.leave(1);
  }
  step();
  EXPECT_EQ(peer->receive().at(0).sent().publish_number(), 2u);
}

TEST_F(SessionTest, LocalListenerHearsAPublication) {
  auto speaker = greeted();
  auto listener = greeted();
  const auto id = advertised(*speaker, "hello");
  subscribed(*listener, "hello");
  speaker->publish(id, 1, "x");
  step();
  const auto messages = listener->receive();
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_TRUE(messages[0].deliver().local());
  EXPECT_EQ(messages[0].deliver().distance_m(), 0.0f);
}

TEST_F(SessionTest, StalledClientDelaysNobodyAndKeepsTheNewest) {
  auto stalled = greeted();
  auto reader = greeted();
  subscribed(*stalled, "hello", 5);
  subscribed(*reader, "hello");
  const std::string payload(1000, 'x');
  std::uint32_t heard = 0;
  constexpr std::uint32_t kMessages = 2000;
  for (std::uint32_t i = 1; i <= kMessages; ++i) {
    receive_on_air("hello", payload, i);
    step();
    heard += static_cast<std::uint32_t>(reader->receive().size());
  }
  EXPECT_EQ(heard, kMessages);
  std::uint32_t last = 0;
  std::uint32_t got = 0;
  std::uint32_t dropped = 0;
  for (int i = 0; i < 100; ++i) {
    for (const auto& message : stalled->receive()) {
      EXPECT_GT(message.deliver().message_number(), last);
      last = message.deliver().message_number();
      dropped += message.deliver().lost_before().daemon();
      ++got;
    }
    step();
  }
  EXPECT_EQ(last, kMessages);
  EXPECT_EQ(got + dropped, kMessages);  // nothing lost unseen
  EXPECT_EQ(dropped, counters_.deliveries_dropped_full);
  EXPECT_GT(dropped, 0u);
}

TEST_F(SessionTest, QueuedBytesOfAClientAreBounded) {
  limits_.queue_bytes = 10'000;
  auto peer = greeted();
  subscribed(*peer, "hello", 1000);
  const std::string payload(1000, 'x');
  for (std::uint32_t i = 1; i <= 100; ++i) receive_on_air("hello", payload, i);  // no turn between
  step();
  const auto messages = peer->receive();
  ASSERT_EQ(messages.size(), 10u);
  EXPECT_EQ(messages[0].deliver().lost_before().daemon(), 90u);
  EXPECT_EQ(messages[0].deliver().message_number(), 91u);
  EXPECT_EQ(counters_.deliveries_dropped_bytes, 90u);
}

TEST_F(SessionTest, RepliesDoNotWaitBehindDeliveries) {
  auto peer = greeted();
  subscribed(*peer, "hello", 1000);
  for (std::uint32_t i = 1; i <= 1000; ++i) receive_on_air("hello", std::string(1000, 'x'), i);
  step();  // writes what the kernel takes; the rest waits
  ipc::Envelope envelope;
  envelope.set_request_id(4);
  envelope.mutable_get_pose();
  peer->send(envelope);
  step();
  std::size_t frames = 0;
  std::size_t reply_at = 0;
  for (int i = 0; i < 100; ++i) {
    for (const auto& frame : peer->receive()) {
      ++frames;
      if (frame.request_id() == 4) reply_at = frames;
    }
    step();
  }
  EXPECT_EQ(frames, 1001u);
  // At most what was in the kernel's buffer and in the one that was being written.
  EXPECT_GT(reply_at, 0u);
  EXPECT_LT(reply_at, 300u);
}

TEST_F(SessionTest, LimitsOfAClientAreToldWithTheLimit) {
  limits_.subscriptions_per_client = 1;
  limits_.publishers_per_client = 1;
  auto peer = greeted();
  subscribed(*peer, "hello");
  advertised(*peer, "hello");
  peer->subscribe(5, "hello");
  peer->advertise(6, "hello");
  peer->subscribe(7, "hello", 100'000'000);
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 3u);
  for (const auto& reply : replies) EXPECT_EQ(reply.failure().code(), ipc::ERROR_LIMIT);
  EXPECT_EQ(replies[0].failure().limit(), 1u);
  EXPECT_EQ(replies[0].failure().text(),
            "a client's subscriptions are limited to 1 (subscriptions_per_client under [limits]); "
            "close one first");
}

TEST_F(SessionTest, KeepLastIsToldWithTheKeyOfItsLimit) {
  auto peer = greeted();
  peer->subscribe(5, "hello", 100'000'000);
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].failure().text(),
            "keep_last must be 1 to 1024 (queue_messages_max under [limits]), not 100000000");
}

TEST_F(SessionTest, ImpossibleDistanceIsRefused) {
  auto peer = greeted();
  for (const float distance_m : {std::numeric_limits<float>::quiet_NaN(), -1.0f}) {
    ipc::Envelope envelope;
    envelope.set_request_id(2);
    envelope.mutable_subscribe()->mutable_channel()->set_number(1);
    envelope.mutable_subscribe()->set_max_distance_m(distance_m);
    peer->send(envelope);
    step();
    EXPECT_EQ(peer->receive().at(0).failure().code(), ipc::ERROR_BAD_DISTANCE);
  }
}

TEST_F(SessionTest, PoseIsSetReadAndRefused) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.set_request_id(1);
  envelope.mutable_get_pose();
  peer->send(envelope);
  envelope.mutable_set_pose()->set_x_m(1.5f);
  envelope.mutable_set_pose()->set_y_m(-2.5f);
  envelope.mutable_set_pose()->set_theta_rad(0.75f);
  envelope.clear_get_pose();
  peer->send(envelope);
  envelope.mutable_set_pose()->set_x_m(33.0f);
  peer->send(envelope);
  envelope.clear_set_pose();
  envelope.mutable_get_pose();
  peer->send(envelope);
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 4u);
  EXPECT_FALSE(replies[0].pose().has_x_m());
  EXPECT_TRUE(replies[1].has_done());
  EXPECT_EQ(replies[2].failure().code(), ipc::ERROR_BAD_POSE);
  EXPECT_FLOAT_EQ(replies[3].pose().x_m(), 1.5f);
  EXPECT_FLOAT_EQ(replies[3].pose().y_m(), -2.5f);
  EXPECT_FLOAT_EQ(replies[3].pose().theta_rad(), 0.75f);
  EXPECT_EQ(replies[3].pose().told_by(), "test");
  EXPECT_EQ(replies[3].pose().max_age_ms(), NodeConfig{}.pose_max_age_ms);
  EXPECT_FALSE(replies[0].pose().has_told_by());
}

TEST_F(SessionTest, PoseSetAsFixedDoesNotAge) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.set_request_id(1);
  envelope.mutable_set_pose()->set_x_m(1.5f);
  envelope.mutable_set_pose()->set_fixed(true);
  peer->send(envelope);
  step();
  const auto later = std::chrono::steady_clock::now() + std::chrono::hours(1);
  EXPECT_EQ(poses_.age_ms(later), 0u);
  envelope.mutable_set_pose()->clear_fixed();
  peer->send(envelope);
  step();
  EXPECT_FALSE(poses_.valid(later));
}

TEST_F(SessionTest, StatusTellsEverything) {
  static_cast<FakeLink&>(station_.link()).link_settings.forward_jitter =
      std::chrono::microseconds(700);
  auto peer = greeted();
  subscribed(*peer, "hello");
  ipc::Envelope envelope;
  envelope.set_request_id(2);
  envelope.mutable_get_status();
  peer->send(envelope);
  step();
  const auto status = peer->receive().at(0).status();
  EXPECT_EQ(status.node_id(), 5u);
  EXPECT_TRUE(status.node_id_fixed());
  EXPECT_EQ(status.clients(), 1u);
  EXPECT_EQ(status.config_file(), "f.toml");
  EXPECT_FALSE(status.has_pose());
  ASSERT_EQ(status.links_size(), 1);
  EXPECT_EQ(status.links(0).device(), "fake0");
  EXPECT_EQ(status.links(0).max_message_bytes(), 1000u);
  EXPECT_EQ(status.links(0).counters_size(), 2);
  EXPECT_EQ(status.links(0).forward_jitter_us(), 700u);
  ASSERT_EQ(status.channels_size(), 1);
  EXPECT_EQ(status.channels(0).name(), "hello");
  EXPECT_GT(status.counters_size(), 10);
}

TEST_F(SessionTest, TtlThatNoLinkCarriesIsRefusedWhenAdvertised) {
  auto peer = greeted();
  ipc::Envelope envelope;
  envelope.set_request_id(2);
  envelope.mutable_advertise()->mutable_channel()->set_number(1);
  envelope.mutable_advertise()->set_ttl(16);
  peer->send(envelope);
  step();
  const auto replies = peer->receive();
  EXPECT_EQ(replies.at(0).failure().code(), ipc::ERROR_BAD_TTL);
  EXPECT_EQ(replies.at(0).failure().limit(), 15u);
}

}  // namespace
}  // namespace swarmtalk::daemon
