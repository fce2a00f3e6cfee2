#include "daemon/session/client_answers.hpp"

#include <gtest/gtest.h>

#include "tests/unit/daemon/session/client_parts.hpp"

namespace swarmtalk::daemon {
namespace {

TEST(ClientAnswers, CarryTheNumberOfTheRequestInHand) {
  ClientParts parts;
  parts.answers.begin(77);
  parts.answers.send_done();
  parts.answers.begin(0);
  parts.answers.refuse({ipc::ERROR_LIMIT, "too many", 5});
  const auto told = parts.told();
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0].request_id(), 77u);
  EXPECT_FALSE(told[1].has_request_id());
  EXPECT_EQ(told[1].failure().limit(), 5u);
  EXPECT_EQ(parts.counters.requests_refused, 1u);
}

TEST(ClientAnswers, SurviveANoticeThatComesWhileTheyAreMade) {
  ClientParts parts;
  parts.answers.begin(77);
  parts.answers.make().mutable_reloaded();
  parts.answers.refuse_message(3, 4, {ipc::ERROR_LINK_DOWN, "down", std::nullopt});
  parts.answers.send();
  const auto told = parts.told();
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0].failure().publish_number(), 4u);
  EXPECT_EQ(told[1].request_id(), 77u);
  EXPECT_TRUE(told[1].has_reloaded());
}

}  // namespace
}  // namespace swarmtalk::daemon
