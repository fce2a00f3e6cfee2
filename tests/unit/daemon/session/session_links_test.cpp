// What who listens is told of links that are down.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/daemon/session/session_harness.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::HasSubstr;

TEST_F(SessionTest, WhoSubscribesWhileNoLinkIsUpIsToldOnce) {
  auto peer = greeted();
  station_.set_up(false);
  peer->subscribe(1, "hello");
  peer->subscribe(2, "other");
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 3u);
  EXPECT_TRUE(replies[0].has_subscribed());
  EXPECT_EQ(replies[1].failure().code(), ipc::ERROR_LINK_DOWN);
  EXPECT_EQ(replies[1].request_id(), 0u);
  EXPECT_FALSE(replies[1].failure().has_publisher_id());
  EXPECT_THAT(replies[1].failure().text(), HasSubstr("fake: interface fake0 is gone"));
  EXPECT_TRUE(replies[2].has_subscribed());
}

TEST_F(SessionTest, ListenersAreToldOnceWhenTheLastLinkGoesDown) {
  auto listener = greeted();
  subscribed(*listener, "hello");
  subscribed(*listener, "other");
  auto speaker = greeted();
  advertised(*speaker, "hello");
  for (int i = 0; i < 2; ++i) {
    station_.set_up(false);
    hub_.on_link_state(station_);
    step();
    const auto told = listener->receive();
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0].failure().code(), ipc::ERROR_LINK_DOWN);
    EXPECT_TRUE(speaker->receive().empty()) << "its next message says so";
    station_.set_up(true);
    hub_.on_link_state(station_);
    step();
    EXPECT_TRUE(listener->receive().empty());
  }
}

TEST_F(SessionTest, ListenersAreNotToldWhileAnotherLinkIsUp) {
  FakeStation second(hub_, "second");
  hub_.add(second);
  auto listener = greeted();
  subscribed(*listener, "hello");
  station_.set_up(false);
  hub_.on_link_state(station_);
  step();
  EXPECT_TRUE(listener->receive().empty());
  second.set_up(false);
  hub_.on_link_state(second);
  step();
  EXPECT_EQ(listener->receive().size(), 1u);
  listener->hang_up();
  step();
}

}  // namespace
}  // namespace swarmtalk::daemon
