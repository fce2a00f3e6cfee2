// The registry alone: no hub, no sessions. What it does for them is in the hub's tests.
#include "daemon/hub/channel_registry.hpp"

#include <gtest/gtest.h>

#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

class Registry : public testing::Test {
 protected:
  Registry() {
    stations_.add(a_);
    stations_.add(b_);
  }
  Channel* use(const ChannelRequest& request) {
    Channel* channel = nullptr;
    const auto refusal = registry_.use(request, held_name_, channel);
    return refusal ? nullptr : channel;
  }

  DeafUser user_;
  FakeStation a_{user_, "a"};
  FakeStation b_{user_, "b"};
  StationList stations_;
  ChannelTable names_{{{"hello", 1}}};
  ChannelRegistry registry_{names_, stations_};
  std::string held_name_;
};

TEST_F(Registry, OpensAChannelOnEveryStationThatCarriesIt) {
  b_.station_limits.max_channel = 3;
  const Channel* const channel = use({"", 7, std::nullopt});
  ASSERT_NE(channel, nullptr);
  EXPECT_EQ(a_.open.count(7), 1u);
  EXPECT_EQ(b_.open.count(7), 0u);
  EXPECT_TRUE(registry_.carries(0, *channel, 10));
  EXPECT_FALSE(registry_.carries(1, *channel, 10));
  EXPECT_EQ(registry_.find(7), channel);
  EXPECT_EQ(registry_.find(8), nullptr);
}

TEST_F(Registry, ClosesTheLongestUnusedChannelWhenAStationIsFull) {
  a_.capacity = b_.capacity = 2;
  ASSERT_NE(use({"", 1, std::nullopt}), nullptr);
  Channel* const second = use({"", 2, std::nullopt});
  registry_.touch(*registry_.find(1));
  ASSERT_NE(use({"", 3, std::nullopt}), nullptr);
  EXPECT_EQ(registry_.find(2), nullptr) << second;
  EXPECT_EQ(a_.open, (std::set<std::uint16_t>{1, 3}));
}

TEST_F(Registry, NeverClosesAPinnedChannel) {
  a_.capacity = b_.capacity = 1;
  ASSERT_FALSE(registry_.pin(1, 0));
  EXPECT_EQ(a_.listening.count(1), 1u);
  EXPECT_EQ(b_.listening.count(1), 0u);
  EXPECT_EQ(use({"", 2, std::nullopt}), nullptr);
  EXPECT_NE(registry_.find(1), nullptr);
}

TEST_F(Registry, ShowsOnlyWhatSomebodyUses) {
  Channel* const channel = use({"hello", std::nullopt, std::nullopt});
  ASSERT_NE(channel, nullptr);
  EXPECT_TRUE(registry_.views().empty());
  ++channel->publishers;
  ASSERT_EQ(registry_.views().size(), 1u);
  EXPECT_EQ(registry_.views()[0].name, "hello");
  EXPECT_EQ(registry_.views()[0].links, (std::vector<std::string>{"a", "b"}));
}

TEST_F(Registry, SaysWhyNothingIsHeardWhileEveryLinkIsDown) {
  ASSERT_NE(use({"", 1, std::nullopt}), nullptr);
  a_.set_up(false);
  EXPECT_FALSE(registry_.links_down(1));
  b_.set_up(false);
  const auto why = registry_.links_down(1);
  ASSERT_TRUE(why);
  EXPECT_EQ(why->code, ipc::ERROR_LINK_DOWN);
}

TEST_F(Registry, RefusesTimestampsWhereNoLinkHasThem) {
  for (FakeStation* each : {&a_, &b_}) each->station_limits.timestamped_from = 8;
  const auto refused = [&](std::uint32_t number, bool is_timestamped) {
    Channel* channel = nullptr;
    const auto refusal = registry_.use({"", number, is_timestamped}, held_name_, channel);
    if (!refusal) return std::string();
    EXPECT_EQ(refusal->code, ipc::ERROR_CHANNEL_CONFLICT);
    return refusal->text;
  };
  EXPECT_EQ(refused(7, false), "");
  EXPECT_EQ(refused(8, true), "");
  const std::string rest =
      " here: the links' packets are timestamped on the channels from 8 on, and on no others";
  EXPECT_EQ(refused(6, true), "channel 6 is never timestamped" + rest);
  EXPECT_EQ(refused(9, false), "channel 9 is never without timestamps" + rest);
  b_.station_limits.timestamped_from = core::kNoTimestampedChannels;
  EXPECT_EQ(refused(6, true), "") << "the other link has no such rule";
  EXPECT_EQ(refused(9, false), "");
}

}  // namespace
}  // namespace swarmtalk::daemon
