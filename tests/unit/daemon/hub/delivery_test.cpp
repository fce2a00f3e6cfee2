// Who hears a message, and what it is told of losses.
#include "daemon/hub/delivery.hpp"

#include <gtest/gtest.h>

#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

class DeliveryAlone : public testing::Test {
 protected:
  DeliveryAlone() {
    near_.client = &first_;
    near_.max_distance_m = 1.0f;
    near_.drops_unknown_distance = true;
    any_.client = &second_;
    channel_.number = 3;
    channel_.subscriptions = {&near_, &any_};
  }
  static MessageHead head(std::uint32_t number, float distance_m = 0.5f) {
    MessageHead head;
    head.channel = 3;
    head.sender = 9;
    head.number = number;
    head.distance_m = distance_m;
    return head;
  }

  DaemonCounters counters_;
  Delivery delivery_{16, counters_};  // before the clients, who keep messages of its pool
  FakeClient first_;
  FakeClient second_;
  Subscription near_;
  Subscription any_;
  Channel channel_;
};

TEST_F(DeliveryAlone, LeavesOutWhoWantsNothingFromSoFar) {
  delivery_.deliver(channel_, head(1, 2.0f), {});
  delivery_.deliver(channel_, head(2, std::numeric_limits<float>::quiet_NaN()), {});
  EXPECT_TRUE(first_.heard.empty());
  EXPECT_EQ(second_.heard.size(), 2u);
  EXPECT_EQ(counters_.deliveries_too_far, 1u);
  EXPECT_EQ(counters_.deliveries_unknown_distance, 1u);
}

TEST_F(DeliveryAlone, DoesNotTellAPublisherItsOwnMessage) {
  delivery_.deliver_own(channel_, head(1), {}, first_.serial());
  EXPECT_TRUE(first_.heard.empty());
  ASSERT_EQ(second_.heard.size(), 1u);
  EXPECT_TRUE(std::get<2>(second_.heard[0]));
  EXPECT_EQ(channel_.received, 0u);
}

TEST_F(DeliveryAlone, PutsAGapDownToWhatItsStationDropped) {
  delivery_.note_losses(channel_, 1, head(1));
  MessageHead later = head(4);
  later.drops.kernel = 1;
  delivery_.note_losses(channel_, 1, later);
  EXPECT_EQ(channel_.lost, (Loss{1, 1, 0, 0}));
  EXPECT_EQ(any_.lost, channel_.lost);
  EXPECT_EQ(counters_.messages_lost_air, 1u);
  EXPECT_EQ(counters_.messages_lost_kernel, 1u);
}

TEST_F(DeliveryAlone, TellsWhatComesLateToThoseWhoWereToldThatItWasLost) {
  Subscription newer;
  newer.client = &second_;
  delivery_.note_losses(channel_, 0, head(1));
  delivery_.note_losses(channel_, 0, head(5));
  channel_.subscriptions.push_back(&newer);
  delivery_.note_losses(channel_, 0, head(3));
  delivery_.note_losses(channel_, 0, head(7));
  delivery_.note_losses(channel_, 0, head(6));
  EXPECT_EQ(any_.lost, (Loss{4, 0, 0, 2}));
  EXPECT_EQ(newer.lost, (Loss{1, 0, 0, 1})) << "3 was lost before it was there";
  EXPECT_EQ(channel_.lost, (Loss{4, 0, 0, 2}));
  EXPECT_EQ(counters_.messages_late, 2u);
}

TEST_F(DeliveryAlone, CountsWhatAStationDroppedOnce) {
  for (const std::uint32_t number : {1u, 2u, 6u}) {
    MessageHead message = head(number);
    message.drops.kernel = 5;
    delivery_.note_losses(channel_, 0, message);
  }
  EXPECT_EQ(channel_.lost, (Loss{3, 0, 0, 0})) << "its total has not risen since";
}

TEST_F(DeliveryAlone, ForgetsTheSendersOfAChannelThatNobodyHears) {
  delivery_.note_losses(channel_, 0, head(1));
  delivery_.forget(3);
  delivery_.note_losses(channel_, 0, head(9));
  EXPECT_EQ(channel_.lost, Loss{});
}

}  // namespace
}  // namespace swarmtalk::daemon
