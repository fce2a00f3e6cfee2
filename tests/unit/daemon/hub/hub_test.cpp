#include "daemon/hub/hub.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "daemon/common/monotonic_ns.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class HubTest : public testing::Test {
 protected:
  HubTest() { hub_.add(station_); }

  Publisher& publisher(HubClient& client, std::uint32_t channel, std::uint8_t ttl = 0) {
    auto& made = *publishers_.emplace_back(std::make_unique<Publisher>());
    made.client = &client;
    made.id = static_cast<std::uint32_t>(publishers_.size());
    EXPECT_FALSE(hub_.advertise({"", channel, std::nullopt, ttl}, made));
    return made;
  }
  Subscription& subscription(HubClient& client, std::uint32_t channel) {
    auto& made = *subscriptions_.emplace_back(std::make_unique<Subscription>());
    made.client = &client;
    made.id = static_cast<std::uint32_t>(100 + subscriptions_.size());
    EXPECT_FALSE(hub_.subscribe({"", channel, std::nullopt}, made));
    return made;
  }
  std::optional<Refusal> publish(Publisher& from, std::uint64_t number, std::string payload,
                                 std::optional<std::uint32_t> ttl = std::nullopt) {
    return hub_.publish(from, number, payload, ttl);
  }
  ipc::ErrorCode code_of(const std::optional<Refusal>& refusal) {
    return refusal ? refusal->code : ipc::ERROR_UNSPECIFIED;
  }
  MessageHead head(std::uint16_t channel, float distance_m = 1.0f) {
    MessageHead head;
    head.channel = channel;
    head.sender = 9;
    head.distance_m = distance_m;
    return head;
  }

  ChannelTable names_{{{"hello", 1}}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{5};
  Hub hub_{names_, limits_, counters_, identity_};
  FakeStation station_{hub_};
  FakeClient a_, b_, c_;
  std::vector<std::unique_ptr<Publisher>> publishers_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
};

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

TEST_F(HubTest, PublicationIsSentWhenTheLastPacketHasLeft) {
  auto& from = publisher(a_, 1, 3);
  EXPECT_FALSE(publish(from, 7, "x"));
  EXPECT_THAT(station_.sent, ElementsAre(FakeStation::Sent{1, "x", 3}));
  EXPECT_TRUE(a_.sent.empty());
  station_.leave(1);
  EXPECT_THAT(a_.sent, ElementsAre(7u));
  EXPECT_EQ(counters_.messages_sent, 1u);
}

TEST_F(HubTest, SecondMessageOfAPublisherIsBusyUntilTheFirstHasLeft) {
  auto& from = publisher(a_, 1);
  publish(from, 1, "x");
  EXPECT_EQ(code_of(publish(from, 2, "y")), ipc::ERROR_BUSY);
  station_.leave(1);
  EXPECT_FALSE(publish(from, 3, "z"));
}

TEST_F(HubTest, PublishersOfOneChannelTakeTurns) {
  auto& a = publisher(a_, 1);
  auto& b = publisher(b_, 1);
  auto& c = publisher(c_, 1);
  publish(a, 1, "a1");
  publish(b, 1, "b1");
  publish(c, 1, "c1");
  station_.leave(1);
  publish(a, 2, "a2");
  for (int i = 0; i < 3; ++i) station_.leave(1);
  std::string order;
  for (const auto& sent : station_.sent) order += sent.payload + " ";
  EXPECT_EQ(order, "a1 b1 c1 a2 ");
}

TEST_F(HubTest, ChannelsDoNotWaitForEachOther) {
  publish(publisher(a_, 1), 1, "x");
  publish(publisher(a_, 2), 1, "y");
  EXPECT_EQ(station_.sent.size(), 2u);
}

TEST_F(HubTest, TooLongIsRefusedWithTheLimit) {
  const auto refusal = publish(publisher(a_, 1), 1, std::string(1001, 'x'));
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->code, ipc::ERROR_TOO_LONG);
  EXPECT_EQ(refusal->limit, 1000u);
  EXPECT_THAT(refusal->text, HasSubstr("1001"));
  EXPECT_THAT(refusal->text, HasSubstr("1000"));
}

TEST_F(HubTest, MessageTooLongForTheInterfaceOfTheMomentIsRefusedAndASmallerOneGoes) {
  station_.fits = 200;
  auto& from = publisher(a_, 1);
  const auto refusal = publish(from, 1, std::string(201, 'x'));
  ASSERT_EQ(code_of(refusal), ipc::ERROR_TOO_LONG);
  EXPECT_EQ(refusal->limit, 200u);
  EXPECT_THAT(refusal->text, HasSubstr("raise the MTU"));
  EXPECT_EQ(counters_.messages_over_mtu, 1u);
  EXPECT_FALSE(publish(from, 2, std::string(200, 'x')));
  EXPECT_EQ(station_.sent.size(), 1u);
}

TEST_F(HubTest, TtlOverTheMaximumIsRefused) {
  EXPECT_EQ(code_of(publish(publisher(a_, 1), 1, "x", 16)), ipc::ERROR_BAD_TTL);
}

TEST_F(HubTest, TtlOfTheMessageComesBeforeTheAdvertisedOne) {
  publish(publisher(a_, 1, 3), 1, "x", 5);
  EXPECT_EQ(station_.sent[0].ttl, 5);
}

TEST_F(HubTest, LinkDownIsToldAtOnceAndWhy) {
  station_.set_up(false);
  const auto refusal = publish(publisher(a_, 1), 1, "x");
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->code, ipc::ERROR_LINK_DOWN);
  EXPECT_THAT(refusal->text, HasSubstr("interface fake0 is gone"));
}

TEST_F(HubTest, ProgramsOfThisRobotHearEachOtherWithoutALink) {
  subscription(a_, 1);
  const std::uint32_t id = subscription(b_, 1).id;
  auto& from = publisher(a_, 1);
  publish(from, 1, "leaves");
  publish(publisher(a_, 1), 2, "waits");
  station_.set_up(false);
  EXPECT_EQ(code_of(publish(from, 3, "stays")), ipc::ERROR_LINK_DOWN);
  EXPECT_EQ(code_of(publish(from, 4, std::string(1001, 'x'))), ipc::ERROR_TOO_LONG);
  EXPECT_THAT(b_.heard, ElementsAre(std::tuple(id, "leaves", true), std::tuple(id, "waits", true),
                                    std::tuple(id, "stays", true)));
  EXPECT_EQ(b_.last->sender, 5);
  EXPECT_EQ(b_.last->number, 0u);
  EXPECT_TRUE(a_.heard.empty());
}

TEST_F(HubTest, LinkThatGoesDownGivesUpWhatWaits) {
  auto& a = publisher(a_, 1);
  auto& b = publisher(b_, 1);
  publish(a, 1, "x");
  publish(b, 2, "y");
  station_.set_up(false);
  EXPECT_FALSE(hub_.give_up_on_dead_links());
  EXPECT_THAT(a_.unsent, ElementsAre(std::pair(std::uint64_t{1}, ipc::ERROR_LINK_DOWN)));
  EXPECT_THAT(b_.unsent, ElementsAre(std::pair(std::uint64_t{2}, ipc::ERROR_LINK_DOWN)));
  EXPECT_TRUE(station_.busy.empty());  // nothing stale leaves when it is back
  station_.set_up(true);
  EXPECT_FALSE(publish(a, 3, "z"));
}

TEST_F(HubTest, LinkThatIsUpKeepsWhatWaits) {
  publish(publisher(a_, 1), 1, "x");
  EXPECT_TRUE(hub_.give_up_on_dead_links());
  EXPECT_TRUE(a_.unsent.empty());
}

TEST_F(HubTest, WaitingHookRunsWhenAMessageBeginsToWait) {
  int calls = 0;
  hub_.set_waiting_hook([&] { ++calls; });
  publish(publisher(a_, 1), 1, "x");
  publish(publisher(b_, 1), 1, "y");
  EXPECT_EQ(calls, 1);
  station_.leave(1);
  station_.leave(1);
  publish(publisher(c_, 1), 1, "z");
  EXPECT_EQ(calls, 2);
}

TEST_F(HubTest, MessagesOfAClientThatIsGoneAreLoggedWhenTheLinkGoesToo) {
  auto& a = publisher(a_, 1);
  auto& b = publisher(b_, 1);
  publish(a, 1, "x");
  publish(b, 2, "y");
  hub_.unadvertise(a);
  hub_.unadvertise(b);
  EXPECT_EQ(hub_.waiting_messages(), 2u);
  station_.set_up(false);
  testing::internal::CaptureStdout();  // one of them has the log
  testing::internal::CaptureStderr();
  hub_.give_up_on_dead_links();
  const std::string told = testing::internal::GetCapturedStderr();
  EXPECT_THAT(told + testing::internal::GetCapturedStdout(), HasSubstr("given up: 2"));
  EXPECT_EQ(hub_.waiting_messages(), 0u);
}

TEST_F(HubTest, MessageOfAClientThatIsGoneStillLeaves) {
  auto& a = publisher(a_, 1);
  auto& b = publisher(b_, 1);
  publish(a, 1, "x");
  publish(b, 2, "y");
  hub_.unadvertise(b);
  station_.leave(1);
  EXPECT_EQ(station_.sent.back().payload, "y");
  station_.leave(1);
  EXPECT_TRUE(b_.sent.empty());
}

TEST_F(HubTest, PublisherThatLeavesDoesNotHearWhatStillWaited) {
  auto& a = publisher(a_, 1);
  auto& b = publisher(b_, 1);
  subscription(b_, 1);
  subscription(c_, 1);
  publish(a, 1, "x");
  publish(b, 2, "y");
  hub_.unadvertise(b);
  station_.leave(1);
  EXPECT_THAT(b_.heard, ElementsAre(std::tuple(101u, "x", true)));
  EXPECT_EQ(c_.heard.size(), 2u);
}

TEST_F(HubTest, ClientInTheMemoryOfOneThatIsGoneHearsWhatThatOneSaid) {
  std::optional<FakeClient> client(std::in_place);
  auto& a = publisher(a_, 1);
  auto& gone = publisher(*client, 1);
  publish(a, 1, "x");
  publish(gone, 2, "y");
  hub_.unadvertise(gone);
  client.emplace();
  subscription(*client, 1);
  station_.leave(1);
  EXPECT_THAT(client->heard, ElementsAre(std::tuple(101u, "y", true)));
}

TEST_F(HubTest, RefusalByTheNodeIsToldNotLost) {
  station_.refuses = true;
  EXPECT_FALSE(publish(publisher(a_, 1), 1, "x"));
  EXPECT_EQ(a_.unsent.size(), 1u);
}

TEST_F(HubTest, AllClientsWaitingMessagesHaveALimit) {
  limits_.waiting_messages = 2;
  publish(publisher(a_, 1), 1, "x");
  publish(publisher(b_, 1), 1, "x");
  const auto refusal = publish(publisher(c_, 1), 1, "x");
  EXPECT_EQ(code_of(refusal), ipc::ERROR_LIMIT);
  EXPECT_EQ(refusal->limit, 2u);
}

TEST_F(HubTest, NobodyPublishesOnReservedChannelsUnlessTheyAreOn) {
  hub_.set_reserved({}, "robot.toml");
  Publisher by_name, by_number;
  by_name.client = by_number.client = &a_;
  const auto refusal = hub_.advertise({"debug", std::nullopt, std::nullopt}, by_name);
  EXPECT_EQ(code_of(refusal), ipc::ERROR_BAD_CHANNEL);
  EXPECT_THAT(refusal->text, HasSubstr("set debug = true under [reserved] in robot.toml"));
  const std::uint32_t number = ChannelTable::hash("harvest");
  EXPECT_EQ(code_of(hub_.advertise({"", number, std::nullopt}, by_number)), ipc::ERROR_BAD_CHANNEL);
  Subscription listener;
  listener.client = &a_;
  EXPECT_FALSE(hub_.subscribe({"debug", std::nullopt, std::nullopt}, listener));
  hub_.set_reserved({.debug = true}, "robot.toml");
  EXPECT_FALSE(hub_.advertise({"debug", std::nullopt, std::nullopt}, by_name));
  EXPECT_EQ(code_of(hub_.advertise({"", number, std::nullopt}, by_number)), ipc::ERROR_BAD_CHANNEL);
}

TEST_F(HubTest, ReservedChannelHasOnePaceForAllPrograms) {
  hub_.set_reserved({.debug = true, .rate_hz = 1, .burst = 3}, "robot.toml");
  std::vector<Publisher> publishers(4);
  for (Publisher& each : publishers) {
    each.client = &a_;
    ASSERT_FALSE(hub_.advertise({"debug", std::nullopt, std::nullopt}, each));
  }
  for (int i = 0; i < 3; ++i)
    EXPECT_FALSE(publish(publishers[static_cast<std::size_t>(i)], 1, "x"));
  EXPECT_EQ(code_of(publish(publishers[3], 1, "x")), ipc::ERROR_RATE);
  EXPECT_EQ(counters_.reserved_too_fast, 1u);
  hub_.set_reserved({}, "robot.toml");
  EXPECT_EQ(code_of(publish(publishers[3], 2, "x")), ipc::ERROR_BAD_CHANNEL) << "off by a reload";
}

TEST_F(HubTest, LocalSubscribersHearItOnceAtDistanceZeroButNotThePublisher) {
  auto& from = publisher(a_, 1, 2);
  subscription(a_, 1);
  subscription(b_, 1);
  publish(from, 1, "x");
  EXPECT_TRUE(a_.heard.empty());
  ASSERT_EQ(b_.heard.size(), 1u);
  EXPECT_EQ(b_.last->distance_m, 0.0f);
  EXPECT_TRUE(b_.last->is_local);
  EXPECT_EQ(b_.last->sender, 5);
  EXPECT_EQ(b_.last->number, 1u);
  EXPECT_EQ(b_.last->ttl, 2);
  station_.leave(1);
  EXPECT_EQ(b_.heard.size(), 1u);
}

TEST_F(HubTest, ReceivedMessageGoesToEverySubscriptionOfItsChannel) {
  auto& first = subscription(a_, 1);
  auto& second = subscription(a_, 1);
  subscription(b_, 2);
  station_.receive(head(1), "x");
  EXPECT_THAT(a_.heard,
              ElementsAre(std::tuple(first.id, "x", false), std::tuple(second.id, "x", false)));
  EXPECT_TRUE(b_.heard.empty());
}

TEST_F(HubTest, SubscriptionHearsNothingFromBeyondItsDistance) {
  subscription(a_, 1).max_distance_m = 1.0f;
  station_.receive(head(1, 1.0f), "at the limit");
  station_.receive(head(1, 1.001f), "beyond");
  station_.receive(head(1, kUnknown), "unknown");
  EXPECT_EQ(a_.heard.size(), 2u);
  EXPECT_EQ(counters_.deliveries_too_far, 1u);
}

TEST_F(HubTest, SubscriptionMayDropUnknownDistances) {
  auto& to = subscription(a_, 1);
  to.max_distance_m = 1.0f;
  to.drops_unknown_distance = true;
  station_.receive(head(1, kUnknown), "unknown");
  EXPECT_TRUE(a_.heard.empty());
  EXPECT_EQ(counters_.deliveries_unknown_distance, 1u);
}

TEST_F(HubTest, UnknownDistancesAreDroppedWithoutALimitToo) {
  subscription(a_, 1).drops_unknown_distance = true;
  station_.receive(head(1, kUnknown), "unknown");
  station_.receive(head(1, 30.0f), "far");
  EXPECT_EQ(a_.heard.size(), 1u);
  EXPECT_EQ(counters_.deliveries_unknown_distance, 1u);
}

TEST_F(HubTest, NodeListensOnlyWhileSomebodyDoes) {
  auto& first = subscription(a_, 1);
  auto& second = subscription(b_, 1);
  EXPECT_EQ(station_.listening.count(1), 1u);
  hub_.unsubscribe(first);
  EXPECT_EQ(station_.listening.count(1), 1u);
  hub_.unsubscribe(second);
  EXPECT_EQ(station_.listening.count(1), 0u);
}

TEST_F(HubTest, WhatIsSentWhileNobodySubscribesIsNoLoss) {
  const auto receive = [this](std::uint32_t number) {
    MessageHead message = head(1);
    message.number = number;
    station_.receive(message, "x");
  };
  auto& first = subscription(a_, 1);
  auto& second = subscription(b_, 1);
  receive(1);
  hub_.unsubscribe(first);
  receive(3);
  EXPECT_EQ(counters_.messages_lost_air, 1u) << "somebody else subscribes still";
  hub_.unsubscribe(second);
  subscription(a_, 1);
  receive(9);
  EXPECT_EQ(counters_.messages_lost_air, 1u);
  receive(11);
  EXPECT_EQ(counters_.messages_lost_air, 2u);
}

TEST_F(HubTest, TimestampedConflictIsRefusedForTheSecond) {
  Subscription first, second, third;
  EXPECT_FALSE(hub_.subscribe({"", 1u, true}, first));
  EXPECT_EQ(code_of(hub_.subscribe({"", 1u, false}, second)), ipc::ERROR_CHANNEL_CONFLICT);
  EXPECT_FALSE(hub_.subscribe({"", 1u, std::nullopt}, third));  // as registered
  EXPECT_EQ(hub_.limits(1).message_bytes, 996);
}

TEST_F(HubTest, TimestampingMayChangeWhenNobodyUsesTheChannel) {
  Subscription first, second;
  first.client = second.client = &a_;
  EXPECT_FALSE(hub_.subscribe({"", 1u, true}, first));
  hub_.unsubscribe(first);
  EXPECT_FALSE(hub_.subscribe({"", 1u, false}, second));
}

TEST_F(HubTest, TimestampingDoesNotOutliveTheLastUserOfTheChannel) {
  Subscription first, second;
  first.client = second.client = &a_;
  EXPECT_FALSE(hub_.subscribe({"", 1u, true}, first));
  hub_.unsubscribe(first);
  EXPECT_FALSE(hub_.subscribe({"", 1u, std::nullopt}, second));
  EXPECT_FALSE(hub_.channels().at(0).is_timestamped);
}

TEST_F(HubTest, TimestampedConflictNamesTheChannelAsItWasAskedFor) {
  Subscription first, second;
  EXPECT_FALSE(hub_.subscribe({"clock", std::nullopt, true}, first));
  const auto refusal = hub_.subscribe({"clock", std::nullopt, false}, second);
  ASSERT_TRUE(refusal);
  EXPECT_THAT(refusal->text, HasSubstr("channel 'clock'"));
}

TEST_F(HubTest, IdleChannelMakesRoomForANewOne) {
  station_.capacity = 2;
  auto& first = subscription(a_, 1);
  subscription(a_, 2);
  Subscription third;
  const auto refusal = hub_.subscribe({"", 3u, std::nullopt}, third);
  EXPECT_EQ(code_of(refusal), ipc::ERROR_LIMIT);
  EXPECT_EQ(refusal->limit, 2u);
  hub_.unsubscribe(first);
  EXPECT_FALSE(hub_.subscribe({"", 3u, std::nullopt}, third));
  EXPECT_THAT(station_.open, ElementsAre(2, 3));
}

TEST_F(HubTest, ChannelWithoutNameOrNumberIsRefused) {
  Subscription to;
  EXPECT_EQ(code_of(hub_.subscribe({}, to)), ipc::ERROR_BAD_CHANNEL);
  EXPECT_EQ(code_of(hub_.subscribe({"", 65536u, std::nullopt}, to)), ipc::ERROR_BAD_CHANNEL);
}

TEST_F(HubTest, ChannelsInUseAreListedWithTheirNames) {
  Subscription to;
  to.client = &a_;
  hub_.subscribe({"other", std::nullopt, std::nullopt}, to);
  publisher(a_, 1);
  const auto views = hub_.channels();
  ASSERT_EQ(views.size(), 2u);
  EXPECT_EQ(views[0].name, "hello");
  EXPECT_EQ(views[0].publishers, 1u);
  EXPECT_EQ(views[1].name, "other");
  EXPECT_EQ(views[1].subscribers, 1u);
  hub_.unsubscribe(to);
  EXPECT_EQ(hub_.channels().size(), 1u);
}

TEST_F(HubTest, FixedIdStaysWhenSomebodyElseHasIt) {
  hub_.on_namesake(station_);
  EXPECT_EQ(identity_.id(), 5);
  EXPECT_EQ(counters_.duplicate_node_ids, 1u);
}

TEST_F(HubTest, LocalMessageOfATimestampedChannelTellsHowLongItWaited) {
  Publisher from;
  from.client = &a_;
  ASSERT_FALSE(hub_.advertise({"", 1, true}, from));
  subscription(b_, 1);
  const std::uint64_t now = monotonic_ns();
  ASSERT_FALSE(hub_.publish(from, 1, "x", std::nullopt, now - 3'000'000'000));
  ASSERT_EQ(b_.heard.size(), 1u);
  ASSERT_TRUE(b_.last->buffering_delay_us);
  EXPECT_GE(*b_.last->buffering_delay_us, 3'000'000u);
  EXPECT_LT(*b_.last->buffering_delay_us, 60'000'000u);
  EXPECT_GE(b_.last->received_at_ns, now);
}

TEST(PublicationTest, ALongerDelayThanADeliveryTellsIsTheLongest) {
  Publication waiting;
  waiting.sent_at_ns = 1'000;
  EXPECT_EQ(waiting.told_us(3'001'999), 3'000u);
  EXPECT_EQ(waiting.told_us(999), 0u) << "sent in a time to come";
  EXPECT_EQ(waiting.told_us(1'000 + (std::uint64_t{UINT32_MAX} - 1) * 1'000), UINT32_MAX - 1);
  EXPECT_EQ(waiting.told_us(5'000'000'000'000), UINT32_MAX);
}

TEST_F(HubTest, LocalMessageOfAChannelWithoutTimestampsTellsNoDelay) {
  auto& from = publisher(a_, 1);
  subscription(b_, 1);
  publish(from, 1, "x");
  EXPECT_FALSE(b_.last->buffering_delay_us);
}

TEST_F(HubTest, TwoOthersUnderOneIdAreCountedAndOurIdStays) {
  Neighbour older, younger;
  older.node = younger.node = 9;
  hub_.on_duplicate(station_, older, younger);
  hub_.on_duplicate(station_, older, younger);
  EXPECT_EQ(counters_.duplicate_neighbours, 2u);
  EXPECT_EQ(counters_.duplicate_node_ids, 0u);
  EXPECT_EQ(identity_.id(), 5);
}

}  // namespace
}  // namespace swarmtalk::daemon
