#include <swarmtalk/swarmtalk.h>

#include <cmath>
#include <optional>

#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

class ClientPubSub : public ClientTest {
 protected:
  ClientPubSub() : daemon(path), client(make_client()) { EXPECT_TRUE(client.connect()); }

  FakeDaemon daemon;
  Client client;
};

bool is_unsubscribe(const ipc::Envelope& envelope) {
  return envelope.has_unsubscribe();
}
bool is_unadvertise(const ipc::Envelope& envelope) {
  return envelope.has_unadvertise();
}
TEST_F(ClientPubSub, SecondSendBeforeSentIsBusyWithoutARoundTrip) {
  daemon.answers_publish = false;
  std::vector<Status> sent;
  auto publisher = client.channel("hello").publisher(
      [&](const Status& status) { sent.push_back(status); }, Sending::one_at_a_time());
  EXPECT_FALSE(publisher.busy());
  EXPECT_TRUE(publisher.send("one"));
  EXPECT_TRUE(publisher.busy());
  EXPECT_EQ(publisher.send("two").code(), StatusCode::kBusy);
  daemon.answer_publish();
  ASSERT_TRUE(run_until(client, [&] { return !sent.empty(); }));
  EXPECT_TRUE(sent[0]);
  EXPECT_FALSE(publisher.busy());
  EXPECT_TRUE(publisher.send("three"));
  client.run_for(std::chrono::milliseconds(1));
  EXPECT_EQ(daemon.count(is_publish), 2);
}

TEST_F(ClientPubSub, TooLongNamesTheLimitAndIsNeverSilent) {
  auto publisher = client.channel("hello").publisher();
  EXPECT_EQ(publisher.max_message_bytes(), 100u);
  const Status status = publisher.send(std::string(101, 'x'));
  EXPECT_EQ(status.code(), StatusCode::kTooLong);
  EXPECT_NE(status.text().find("101"), std::string_view::npos) << status.text();
  EXPECT_NE(status.text().find("at most 100"), std::string_view::npos) << status.text();
  EXPECT_TRUE(run_until(client, [&] { return errors.size() == 1; }));
  EXPECT_TRUE(publisher.send(std::string(100, 'x'))) << "the limit itself is legal";
}

TEST_F(ClientPubSub, TtlAboveTheLinksIsRefused) {
  auto publisher = client.channel("hello").publisher();
  EXPECT_EQ(publisher.send("x", 6).code(), StatusCode::kBadTtl);
  EXPECT_TRUE(publisher.send("x", 5));
  EXPECT_EQ(daemon.received().back().publish().ttl(), 5u);
}

TEST_F(ClientPubSub, MessageOfNoBytesIsLegalBothWays) {
  std::optional<Message> heard;
  auto channel = client.channel(7);
  auto subscriber = channel.subscriber([&](const Message& m) { heard = m; });
  auto publisher = channel.publisher();
  EXPECT_TRUE(publisher.send(""));
  daemon.deliver("");
  ASSERT_TRUE(run_until(client, [&] { return heard && !publisher.busy(); }));
  EXPECT_EQ(heard->payload.size(), 0u);
  EXPECT_EQ(daemon.count(is_publish), 1);
}

TEST_F(ClientPubSub, DeliveryKeepsExactBytesAndAllSensing) {
  std::optional<Message> heard;
  auto subscriber = client.channel(7).subscriber([&](const Message& m) { heard = m; });
  ipc::Deliver deliver;
  deliver.set_payload(std::string("a\0b", 3));
  deliver.set_channel(7);
  deliver.set_sender(3);
  deliver.set_epoch(99);
  deliver.set_message_number(12);
  deliver.set_distance_m(0.5F);
  deliver.set_bearing_rad(-1.5F);
  deliver.mutable_sender_pose()->set_x_m(1);
  deliver.mutable_sender_pose()->set_y_m(2);
  deliver.mutable_sender_pose()->set_theta_rad(3);
  deliver.mutable_sender_pose()->set_age_ms(40);
  deliver.set_hops(1);
  deliver.set_transmitter(4);
  deliver.set_ttl(2);
  deliver.set_buffering_delay_us(1500);
  deliver.set_received_at_ns(123456);
  deliver.set_local(true);
  deliver.mutable_lost_before()->set_air(4);
  daemon.deliver(deliver);
  ASSERT_TRUE(run_until(client, [&] { return heard.has_value(); }));
  EXPECT_EQ(heard->payload, std::string("a\0b", 3));
  EXPECT_EQ(heard->bytes().size(), 3u);
  EXPECT_EQ(heard->channel, 7);
  EXPECT_EQ(heard->sender, 3u);
  EXPECT_EQ(heard->epoch, 99u);
  EXPECT_EQ(heard->message_number, 12u);
  EXPECT_FLOAT_EQ(heard->distance_m, 0.5F);
  EXPECT_FLOAT_EQ(heard->bearing_rad, -1.5F);
  ASSERT_TRUE(heard->sender_pose);
  EXPECT_FLOAT_EQ(heard->sender_pose->theta_rad, 3);
  EXPECT_EQ(heard->sender_pose->age, std::chrono::milliseconds(40));
  EXPECT_EQ(heard->hops, 1u);
  EXPECT_EQ(heard->transmitter, 4u);
  EXPECT_EQ(heard->ttl, 2u);
  EXPECT_GE(*heard->buffering_delay, std::chrono::microseconds(1500));  // and since reception
  EXPECT_EQ(heard->received_at->time_since_epoch(), std::chrono::nanoseconds(123456));
  EXPECT_TRUE(heard->local);
  EXPECT_EQ(heard->lost_before, (Loss{4, 0, 0, 0, 0}));
}

TEST_F(ClientPubSub, ProgramInCIsToldByWhomAMessageWasPassedOn) {
  std::optional<swarmtalk_message> heard;
  swarmtalk_client* const robot = swarmtalk_open("c", path.c_str());
  ASSERT_EQ(swarmtalk_connect(robot), SWARMTALK_OK);
  swarmtalk_subscriber* const subscriber = swarmtalk_subscribe(
      robot, "hello", nullptr,
      [](const swarmtalk_message* message, void* context) {
        *static_cast<std::optional<swarmtalk_message>*>(context) = *message;
      },
      &heard);
  ipc::Deliver deliver;
  deliver.set_sender(3);
  deliver.set_hops(1);
  deliver.set_transmitter(4);
  daemon.deliver(deliver);
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!heard && std::chrono::steady_clock::now() < deadline) swarmtalk_run_for(robot, 50);
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->sender, 3u);
  EXPECT_EQ(heard->transmitter, 4u);
  swarmtalk_unsubscribe(subscriber);
  swarmtalk_close(robot);
}

TEST_F(ClientPubSub, UnknownSensingIsUnknownAlsoAfterAKnownOne) {
  std::vector<Message> heard;
  auto subscriber = client.channel(7).subscriber([&](const Message& m) { heard.push_back(m); });
  ipc::Deliver known;
  known.set_distance_m(1);
  known.set_bearing_rad(1);
  known.mutable_sender_pose()->set_x_m(1);
  daemon.deliver(known);
  daemon.deliver("unknown");
  ASSERT_TRUE(run_until(client, [&] { return heard.size() == 2; }));
  EXPECT_TRUE(heard[0].has_distance());
  EXPECT_FALSE(heard[0].sender_pose) << "a pose without y and theta is no pose";
  EXPECT_FALSE(heard[1].has_distance());
  EXPECT_FALSE(heard[1].has_bearing());
  EXPECT_FALSE(heard[1].distance_m < 1e9F) << "an unknown distance is near nothing";
  EXPECT_FALSE(heard[1].sender_pose);
  EXPECT_FALSE(heard[1].buffering_delay);
  EXPECT_FALSE(heard[1].received_at);
}

TEST_F(ClientPubSub, OptionsReachTheDaemon) {
  auto channel = client.channel("stars", {.ttl = 3, .timestamped = true});
  auto publisher = channel.publisher();
  EXPECT_EQ(daemon.received().back().advertise().channel().name(), "stars");
  EXPECT_EQ(daemon.received().back().advertise().ttl(), 3u);
  EXPECT_TRUE(daemon.received().back().advertise().timestamped());
  auto subscriber =
      channel.subscriber([](const Message&) {},
                         {.max_distance_m = 0.45F, .drop_unknown_distance = true, .keep_last = 1});
  const ipc::Subscribe body = daemon.received().back().subscribe();
  EXPECT_FLOAT_EQ(body.max_distance_m(), 0.45F);
  EXPECT_TRUE(body.drop_unknown_distance());
  EXPECT_EQ(body.keep_last(), 1u);
  EXPECT_EQ(subscriber.channel_number(), 7);
}

TEST_F(ClientPubSub, TheTimeOfSendingIsLeftOutOnlyWhereTheDaemonHasNoUseForIt) {
  for (const std::optional<bool> is_timestamped :
       {std::optional<bool>(), std::optional<bool>(true), std::optional<bool>(false)}) {
    daemon.is_timestamped = is_timestamped;
    auto publisher = client.channel("hello").publisher();
    EXPECT_TRUE(publisher.send("x"));
    EXPECT_TRUE(client.sync());
    std::optional<ipc::Publish> last;
    for (const ipc::Envelope& each : daemon.received()) {
      if (each.has_publish()) last = each.publish();
    }
    ASSERT_TRUE(last);
    EXPECT_EQ(last->has_sent_at_ns(), is_timestamped.value_or(true));
  }
}

TEST_F(ClientPubSub, ARefusedChannelIsToldByStatusAndOnError) {
  daemon.refuse_channels.set_code(ipc::ERROR_CHANNEL_CONFLICT);
  daemon.refuse_channels.set_text("channel hello is timestamped");
  auto publisher = client.channel("hello").publisher();
  EXPECT_EQ(publisher.status().code(), StatusCode::kChannelConflict);
  EXPECT_EQ(publisher.send("x").code(), StatusCode::kChannelConflict);
  ASSERT_TRUE(run_until(client, [&] { return errors.size() == 1; }));
  EXPECT_EQ(errors[0].text(), "channel hello is timestamped");
}

TEST_F(ClientPubSub, AnImpossibleChannelIsRefusedAtOnceAndTheRestGoesOn) {
  auto good = client.channel("hello").publisher();
  for (const Channel& channel :
       {client.channel("caf\xe9"), client.channel(-1), client.channel(65536)}) {
    auto publisher = channel.publisher();
    auto subscriber = channel.subscriber([](const Message&) {});
    EXPECT_EQ(publisher.status().code(), StatusCode::kBadChannel);
    EXPECT_EQ(publisher.send("x").code(), StatusCode::kBadChannel);
    EXPECT_EQ(subscriber.status().code(), StatusCode::kBadChannel);
  }
  EXPECT_TRUE(good.send("x"));
  ASSERT_TRUE(run_until(client, [&] { return errors.size() == 6; }));
  EXPECT_EQ(daemon.count([](const auto& e) { return e.has_advertise() || e.has_subscribe(); }), 1);
  EXPECT_TRUE(losses.empty());
}

TEST_F(ClientPubSub, ASubscriberWithoutAFunctionIsRefusedWithASentence) {
  const auto first = client.subscribe("hello", nullptr);
  const auto second = client.subscribe("hello", Policy::latest(), ReceiveCallback());
  const auto third = client.channel(7).subscriber({});
  for (const auto* each : {&first, &second, &third}) {
    EXPECT_EQ(each->status().code(), StatusCode::kBadArgument);
  }
  EXPECT_EQ(first.status().text(),
            "the function that channel hello was subscribed to with is empty: give one that takes "
            "each message");
  ASSERT_TRUE(run_until(client, [&] { return errors.size() == 3; }));
  EXPECT_EQ(daemon.count([](const auto& e) { return e.has_subscribe(); }), 0);
}

TEST_F(ClientPubSub, AProgramThatNeverRunsIsToldAtItsEndWhatWasRefused) {
  testing::internal::CaptureStderr();
  {
    Client short_lived("test", options());
    const auto deaf = short_lived.subscribe("hello", nullptr);
    const auto impossible = short_lived.channel(65536).publisher();
  }
  const std::string told = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 2) << told;
  EXPECT_NE(told.find("channel hello was subscribed to with is empty"), std::string::npos) << told;
}

TEST_F(ClientPubSub, ADistanceThatIsRefusedIsABadArgument) {
  daemon.refuse_channels.set_code(ipc::ERROR_BAD_DISTANCE);
  Policy options;
  options.max_distance_m = -1.0F;
  auto subscriber = client.channel("hello").subscriber([](const Message&) {}, options);
  EXPECT_EQ(subscriber.status().code(), StatusCode::kBadArgument);
}

TEST_F(ClientPubSub, HandlesUnregisterWhenDestroyedButNotWhenMoved) {
  {
    auto publisher = client.channel("hello").publisher();
    auto subscriber = client.channel("hello").subscriber([](const Message&) {});
    auto moved_publisher = std::move(publisher);
    auto moved_subscriber = std::move(subscriber);
    ASSERT_TRUE(client.sync());
    EXPECT_EQ(daemon.count(is_unadvertise) + daemon.count(is_unsubscribe), 0);
    EXPECT_TRUE(moved_publisher.send("x"));
  }
  ASSERT_TRUE(client.sync());
  EXPECT_EQ(daemon.count(is_unadvertise), 1);
  EXPECT_EQ(daemon.count(is_unsubscribe), 1);
}

TEST_F(ClientPubSub, HandlesOutliveTheClient) {
  std::optional<Client> short_lived(make_client());
  ASSERT_TRUE(short_lived->connect());
  auto channel = short_lived->channel("hello");
  auto publisher = channel.publisher();
  auto subscriber = channel.subscriber([](const Message&) {});
  short_lived.reset();
  EXPECT_EQ(publisher.send("x").code(), StatusCode::kDisconnected);
  EXPECT_EQ(subscriber.status().code(), StatusCode::kDisconnected);
  EXPECT_EQ(channel.publisher().send("x").code(), StatusCode::kDisconnected);
}

TEST_F(ClientPubSub, CallbackMayDestroyItsOwnSubscriber) {
  int calls = 0;
  std::optional<Subscriber> subscriber;
  subscriber = client.channel("hello").subscriber([&](const Message&) {
    ++calls;
    subscriber.reset();
  });
  daemon.deliver("one");
  daemon.deliver("two");
  ASSERT_TRUE(run_until(client, [&] { return daemon.count(is_unsubscribe) == 1; }));
  EXPECT_EQ(calls, 1);
}

TEST_F(ClientPubSub, CallbackMayRegisterAndSendAndOrderIsKept) {
  std::vector<std::string> heard;
  std::optional<Publisher> publisher;
  std::vector<Subscriber> more;
  auto channel = client.channel("hello");
  auto subscriber = channel.subscriber([&](const Message& m) {
    heard.emplace_back(m.text());
    if (m.text() == "1") {
      publisher = channel.publisher();  // waits for the daemon while 2 and 3 come in
      EXPECT_TRUE(publisher->send("from the callback"));
      EXPECT_EQ(m.text(), "1") << "the message stays as it was";
    }
  });
  for (const char* text : {"1", "2", "3"}) daemon.deliver(text);
  ASSERT_TRUE(run_until(client, [&] { return heard.size() == 3; }));
  EXPECT_EQ(heard, (std::vector<std::string>{"1", "2", "3"}));
  EXPECT_EQ(daemon.count(is_publish), 1);
}

TEST_F(ClientPubSub, CallbackMayDestroyTheClient) {
  std::optional<Client> doomed(make_client());
  ASSERT_TRUE(doomed->connect());
  auto subscriber = doomed->channel("hello").subscriber([&](const Message&) { doomed.reset(); });
  daemon.deliver("one");
  daemon.deliver("two");
  doomed->run_for(kPatience);
  EXPECT_FALSE(doomed);
}

TEST_F(ClientPubSub, WhatACallbackSaysLeavesAtOnceAndNotAtItsEnd) {
  auto publisher = client.channel("stop").publisher();
  bool has_come = false;
  auto subscriber = client.channel("go").subscriber([&](const Message&) {
    EXPECT_TRUE(publisher.send("stop"));
    EXPECT_TRUE(client.set_pose(1, 0, 0));
    const auto is_pose = [](const ipc::Envelope& envelope) { return envelope.has_set_pose(); };
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (!has_come && std::chrono::steady_clock::now() < deadline) {
      has_come = daemon.count(is_publish) == 1 && daemon.count(is_pose) == 1;
    }
  });
  daemon.deliver("go");
  ASSERT_TRUE(run_until(client, [&] { return daemon.count(is_publish) == 1; }));
  EXPECT_TRUE(has_come);
}

struct Heading {
  std::int32_t id;
  float x_m;
  float y_m;
};

TEST_F(ClientPubSub, StructsCrossByteForByteAndAreNeverPadded) {
  auto channel = client.channel("pose");
  auto publisher = channel.publisher();
  EXPECT_TRUE(publisher.send(Heading{5, 0.25F, -1.0F}));
  std::vector<Message> heard;
  auto subscriber = channel.subscriber([&](const Message& m) { heard.push_back(m); });
  const std::string payload = daemon.received()[2].publish().payload();
  ASSERT_EQ(payload.size(), sizeof(Heading));
  daemon.deliver(payload);
  daemon.deliver(payload.substr(1));
  ASSERT_TRUE(run_until(client, [&] { return heard.size() == 2; }));
  const auto heading = heard[0].as<Heading>();
  ASSERT_TRUE(heading);
  EXPECT_EQ(heading->id, 5);
  EXPECT_FLOAT_EQ(heading->x_m, 0.25F);
  EXPECT_FALSE(heard[1].as<Heading>());
}

TEST_F(ClientPubSub, PoseIsCheckedAndTheNewestWins) {
  EXPECT_EQ(client.set_pose(std::nanf(""), 0, 0).code(), StatusCode::kBadPose);
  EXPECT_EQ(client.set_pose(0, 33, 0).code(), StatusCode::kBadPose);
  for (int i = 0; i <= 100; ++i) EXPECT_TRUE(client.set_pose(static_cast<float>(i) / 10, 0, 0));
  ASSERT_TRUE(client.sync());
  const auto envelopes = daemon.received();
  ASSERT_TRUE(envelopes.back().has_set_pose());
  EXPECT_FLOAT_EQ(envelopes.back().set_pose().x_m(), 10);
  std::optional<Pose> pose;
  ASSERT_TRUE(client.get_pose(pose));
  ASSERT_TRUE(pose);
  EXPECT_FLOAT_EQ(pose->y_m, 2);
}

TEST_F(ClientPubSub, APoseAgesUnlessItIsFixed) {
  ASSERT_TRUE(client.set_pose(1, 2, 3));
  ASSERT_TRUE(client.sync());
  EXPECT_FALSE(daemon.received().back().set_pose().fixed());
  ASSERT_TRUE(client.set_fixed_pose(1, 2, 3));
  ASSERT_TRUE(client.sync());
  EXPECT_TRUE(daemon.received().back().set_pose().fixed());
}

TEST_F(ClientPubSub, StatusComesAsAValue) {
  DaemonStatus status;
  ASSERT_TRUE(client.get_status(status));
  EXPECT_EQ(status.version, "fake");
  EXPECT_EQ(status.node_id, 42u);
}

TEST_F(ClientPubSub, AWaitingCallGivesUpAndALateAnswerDoesNoHarm) {
  ClientOptions bounded = options();
  bounded.request_timeout = std::chrono::milliseconds(30);
  Client impatient("test", bounded);
  collect_errors(impatient);
  ASSERT_TRUE(impatient.connect());
  daemon.answers_requests = false;
  DaemonStatus status;
  EXPECT_EQ(impatient.get_status(status).code(), StatusCode::kTimeout);
  auto publisher = impatient.channel("hello").publisher();
  EXPECT_EQ(publisher.status().code(), StatusCode::kTimeout);
  EXPECT_EQ(publisher.send("x").code(), StatusCode::kTimeout);
}

}  // namespace
}  // namespace swarmtalk::test
