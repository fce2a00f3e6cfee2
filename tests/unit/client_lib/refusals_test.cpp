// Messages that send() refused and nobody looked at: how many, and how often it is told.
#include "client_lib/refusals.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace swarmtalk::client {
namespace {

std::string printed_by(const std::function<void()>& what) {
  testing::internal::CaptureStderr();
  what();
  return testing::internal::GetCapturedStderr();
}

TEST(Refusals, TellTheFirstAtOnceAndTheRestAtTheEnd) {
  Refusals sut;
  EXPECT_EQ(printed_by([&] { sut.note("channel a", "full", true); }),
            "swarmtalk: channel a: a message was not sent, and nobody looked at what send() "
            "returned: full\n");
  EXPECT_EQ(printed_by([&] {
              for (int i = 0; i < 3; ++i) sut.note("channel a", "full", true);
            }),
            "")
      << "not more than once a second";
  EXPECT_EQ(printed_by([&] { sut.tell_rest(); }),
            "swarmtalk: since then 3 more of this program's messages were not sent\n");
  EXPECT_EQ(printed_by([&] { sut.tell_rest(); }), "") << "each once";
}

TEST(Refusals, AreReportedToAProgramThatAskedForIt) {
  Refusals sut;
  sut.tells_stderr(false);
  const auto report = sut.note("channel a", "full", false);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->code(), StatusCode::kBusy);
  EXPECT_EQ(report->text(), "channel a: a message was not sent: full");
  EXPECT_FALSE(sut.note("channel a", "full", false));
  EXPECT_EQ(printed_by([&] { sut.tell_rest(); }), "");
}

}  // namespace
}  // namespace swarmtalk::client
