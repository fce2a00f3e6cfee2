#include "daemon/hub/shares.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>

#include "daemon/hub/hub.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::HasSubstr;

constexpr std::uint32_t kUid = 4321;
constexpr auto kPublisher = Shares::End::kPublisher;

class SharesTest : public testing::Test {
 protected:
  UserShare& user() { return shares_.user(kUid); }
  ClientShare& enter(ClientShare& client) {
    shares_.enter(user(), client);
    return client;
  }

  LimitsConfig limits_;
  Shares shares_{limits_};
};

TEST_F(SharesTest, OneUserLeavesPlacesToOthersAndIsToldWhoHoldsThem) {
  limits_.clients = 100;
  limits_.clients_per_user = 2;
  ClientShare first, second;
  enter(first);
  EXPECT_FALSE(shares_.check_client(user(), 1));
  enter(second);
  const auto refusal = shares_.check_client(user(), 2);
  ASSERT_TRUE(refusal);
  EXPECT_THAT(refusal->text, HasSubstr("uid 4321 has 2 clients already, clients_per_user"));
  EXPECT_FALSE(shares_.check_client(shares_.user(5), 2));
  Shares::leave(first);
  EXPECT_FALSE(shares_.check_client(user(), 1));
}

TEST_F(SharesTest, TheLastPlacesAreForRoot) {
  limits_.clients = 16;
  limits_.clients_per_user = 100;
  EXPECT_FALSE(shares_.check_client(user(), 11));
  const auto refusal = shares_.check_client(user(), 12);
  ASSERT_TRUE(refusal);
  EXPECT_THAT(refusal->text, HasSubstr("4 of them are kept for root"));
  EXPECT_FALSE(shares_.check_client(shares_.user(0), 15));
  EXPECT_TRUE(shares_.check_client(shares_.user(0), 16));
}

TEST_F(SharesTest, ChannelsHaveAShareOfEachClientAndEachUser) {
  limits_.channels_per_client = 2;
  limits_.channels_per_user = 3;
  ClientShare first, second;
  enter(first);
  enter(second);
  Shares::hold(first, kPublisher, 1);
  Shares::hold(first, kPublisher, 2);
  EXPECT_FALSE(shares_.check_end(first, kPublisher, 2)) << "it has that already";
  EXPECT_THAT(shares_.check_end(first, kPublisher, 3)->text, HasSubstr("channels_per_client"));
  Shares::hold(second, kPublisher, 3);
  EXPECT_THAT(shares_.check_end(second, kPublisher, 4)->text, HasSubstr("channels_per_user"));
  Shares::release(first, kPublisher, 1);
  EXPECT_FALSE(shares_.check_end(second, kPublisher, 4));
  EXPECT_EQ(shares_.users_of(2), "uid 4321");
  EXPECT_EQ(shares_.users_of(1), "");
}

TEST_F(SharesTest, PublishersAndSubscriptionsOfAUserAreCountedApart) {
  limits_.publishers_per_user = 1;
  ClientShare client;
  enter(client);
  Shares::hold(client, kPublisher, 1);
  EXPECT_THAT(shares_.check_end(client, kPublisher, 1)->text, HasSubstr("publishers_per_user"));
  EXPECT_FALSE(shares_.check_end(client, Shares::End::kSubscription, 1));
}

TEST_F(SharesTest, RequestsOfAClientAndOfAllProgramsOfItsUserHaveARate) {
  limits_.requests_per_client_hz = 100;
  limits_.requests_per_user_hz = 150;
  ClientShare first, second;
  enter(first);
  enter(second);
  EXPECT_FALSE(shares_.take_request(first, 100));
  EXPECT_THAT(shares_.take_request(first, 50)->text, HasSubstr("requests_per_client_hz"));
  EXPECT_THAT(shares_.take_request(second, 90)->text, HasSubstr("requests_per_user_hz"));
}

TEST_F(SharesTest, ChangesHaveARateOfEachUser) {
  limits_.changes_burst = 3;
  ClientShare client;
  enter(client);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(shares_.take_change(client));
  const auto refusal = shares_.take_change(client);
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->code, ipc::ERROR_RATE);
  EXPECT_THAT(refusal->text, HasSubstr("changes_per_user_hz"));
}

/// Messages that wait: of a client and of its user, up to each limit and one above.
class SharesOfWaiting : public SharesTest {
 protected:
  SharesOfWaiting() {
    limits_.waiting_messages = 100;
    limits_.waiting_messages_per_client = 10;
    limits_.waiting_messages_per_user = 20;
    limits_.waiting_bytes = 1000;
    enter(client_);
  }
  /// @return which limit there is no room in; empty: there is
  std::string full(std::size_t size_bytes, const Waiting& waiting) {
    const auto refusal = shares_.check_message(client_, size_bytes, waiting);
    if (!refusal) return "";
    EXPECT_EQ(refusal->code, ipc::ERROR_LIMIT);
    text_ = refusal->text;
    return std::to_string(refusal->limit.value_or(0));
  }

  ClientShare client_;
  std::string text_;
};

TEST_F(SharesOfWaiting, AllClientsMessagesAndBytesAreLimited) {
  EXPECT_EQ(full(4, {99, 996}), "");
  EXPECT_EQ(full(4, {100, 0}), "100");
  EXPECT_EQ(full(4, {0, 997}), "1000");
  EXPECT_THAT(text_, HasSubstr("997 bytes of all clients"));
  EXPECT_THAT(text_, testing::Not(HasSubstr("held by")));
  user().waiting_bytes = 30;
  shares_.user(kUid + 1).waiting_bytes = 29;
  full(4, {0, 997});
  EXPECT_THAT(text_, HasSubstr("held by uid 4321 (30)"));
}

TEST_F(SharesOfWaiting, AClientHasItsLimitAndItsUserItsOwn) {
  client_.waiting_messages = 9;
  user().waiting_messages = 19;
  user().waiting_bytes = 496;
  EXPECT_EQ(full(4, {}), "");
  EXPECT_EQ(full(5, {}), "500") << "a user has half of the bytes";
  EXPECT_THAT(text_, HasSubstr("496 bytes of uid 4321"));
  user().waiting_messages = 20;
  EXPECT_EQ(full(4, {}), "20");
  client_.waiting_messages = 10;
  EXPECT_EQ(full(4, {}), "10");
  Shares::leave(client_);
  EXPECT_EQ(full(4, {}), "10") << "of a client that counts for nobody, too";
}

TEST_F(SharesTest, UsersWithoutAnythingAreForgottenAtSomeTime) {
  ClientShare client;
  enter(client);
  for (std::uint32_t uid = 10'000; uid < 20'000; ++uid) shares_.user(uid);
  EXPECT_LE(shares_.users().size(), 300u);
  EXPECT_EQ(user().clients, 1u);
}

/// Messages of several users at the hub.
class SharesAtHub : public testing::Test {
 protected:
  SharesAtHub() {
    hub_.add(station_);
    for (std::size_t i = 0; i < 2; ++i) {
      hub_.shares().enter(hub_.shares().user(kUid + static_cast<std::uint32_t>(i)),
                          clients_[i].share);
      publishers_[i].client = &clients_[i];
      publishers_[i].queue_limit = 1000;
      EXPECT_FALSE(
          hub_.advertise({"", static_cast<std::uint32_t>(i + 1), std::nullopt}, publishers_[i]));
    }
  }
  /// @return how many were taken
  int publish(std::size_t of, int count) {
    int taken = 0;
    for (int i = 0; i < count; ++i) {
      refusal_ = hub_.publish(publishers_[of], ++number_, "text", std::nullopt);
      taken += refusal_ ? 0 : 1;
    }
    return taken;
  }
  UserShare& user(std::size_t of) { return *clients_[of].share.user; }

  ChannelTable names_{{{"hello", 1}}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{5};
  Hub hub_{names_, limits_, counters_, identity_};
  FakeStation station_{hub_};
  FakeClient clients_[2];
  Publisher publishers_[2];
  std::optional<Refusal> refusal_;
  std::uint64_t number_ = 0;
};

TEST_F(SharesAtHub, OneClientsMessagesLeaveRoomToOthers) {
  limits_.waiting_messages = 20;
  limits_.waiting_messages_per_client = 8;
  EXPECT_EQ(publish(0, 100), 8);
  EXPECT_THAT(refusal_->text, HasSubstr("waiting_messages_per_client"));
  EXPECT_EQ(counters_.messages_over_share, 92u);
  EXPECT_EQ(publish(1, 5), 5);
  station_.leave(1);
  EXPECT_EQ(publish(0, 2), 1);
}

TEST_F(SharesAtHub, WhoeverFindsNoRoomIsToldWhoHasMost) {
  limits_.waiting_messages = 10;
  EXPECT_EQ(publish(0, 9), 9);
  EXPECT_EQ(publish(1, 2), 1);
  EXPECT_THAT(refusal_->text, HasSubstr("10 messages of all clients"));
  EXPECT_THAT(refusal_->text, HasSubstr("held by uid 4321 (9)"));
}

TEST_F(SharesAtHub, AUsersMessagesStayInItsShareWhenItsProgramHasGone) {
  limits_.waiting_messages_per_user = 3;
  EXPECT_EQ(publish(0, 5), 3);
  hub_.unadvertise(publishers_[0]);
  EXPECT_EQ(clients_[0].share.waiting_messages, 0u);
  EXPECT_EQ(user(0).waiting_messages, 3u) << "they leave without it";
  EXPECT_EQ(user(0).waiting_bytes, 12u);
  EXPECT_EQ(publish(1, 1), 1) << "another user's";
  for (int i = 0; i < 4; ++i) station_.leave(1);
  EXPECT_EQ(user(0).waiting_messages, 0u);
  EXPECT_EQ(user(0).waiting_bytes, 0u);
}

TEST_F(SharesAtHub, MessagesBetweenTheirCopiesTakeNobodyElsesRoom) {
  limits_.waiting_messages = 2;
  limits_.waiting_messages_per_client = 5;
  publishers_[0].copies = 3;
  publishers_[0].copy_interval_ms = 10'000;
  EXPECT_EQ(publish(0, 1), 1);
  station_.leave(1);  // its second copy leaves in ten seconds
  EXPECT_EQ(publish(1, 2), 2);
  EXPECT_EQ(user(0).waiting_messages, 1u);
  hub_.send_copies(std::chrono::steady_clock::now() + std::chrono::seconds(11));
  EXPECT_EQ(publish(1, 1), 0) << "it is on its way again";
}

TEST_F(SharesAtHub, PayloadThatWaitsIsLimitedToo) {
  limits_.waiting_bytes = 100;
  EXPECT_EQ(publish(0, 100), 12) << "half, of 4 bytes each";
  EXPECT_THAT(refusal_->text, HasSubstr("half of waiting_bytes"));
}

TEST_F(SharesAtHub, ANameBlockedByAnothersNumberSaysWhoUsesIt) {
  Publisher other;
  other.client = &clients_[1];
  ASSERT_EQ(ChannelTable::hash("cvft"), ChannelTable::hash("alarm"));
  EXPECT_FALSE(hub_.advertise({"cvft", std::nullopt, std::nullopt}, publishers_[0]));
  const auto refusal = hub_.advertise({"alarm", std::nullopt, std::nullopt}, other);
  ASSERT_TRUE(refusal);
  EXPECT_THAT(refusal->text, HasSubstr("'cvft'"));
  EXPECT_THAT(refusal->text, HasSubstr("in use by programs of uid 4321"));
}

}  // namespace
}  // namespace swarmtalk::daemon
