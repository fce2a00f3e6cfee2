// Messages that send() refused and nobody looked at: how many, and how often it is told.
#include "client_lib/refusals.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>

namespace swarmtalk::client {
namespace {

using std::chrono::milliseconds;
constexpr Wakeup::Clock::time_point kBegin{std::chrono::hours(1)};

std::string printed_by(const std::function<void()>& what) {
  testing::internal::CaptureStderr();
  what();
  return testing::internal::GetCapturedStderr();
}

TEST(Refusals, TellTheFirstAtOnceTheNextAfterASecondAndTheRestAtTheEnd) {
  Refusals sut;
  EXPECT_EQ(printed_by([&] { sut.note("channel a", "full", true, kBegin); }),
            "swarmtalk: channel a: a message was not sent, and nobody looked at what send() "
            "returned: full\n");
  EXPECT_EQ(printed_by([&] {
              for (int i = 1; i < 4; ++i) {
                sut.note("channel a", "full", true, kBegin + milliseconds(333 * i));
              }
            }),
            "")
      << "not more than once a second";
  EXPECT_EQ(printed_by([&] { sut.note("channel b", "full", false, kBegin + milliseconds(1000)); }),
            "swarmtalk: channel b: 4 messages were not sent: full\n");
  sut.note("channel a", "full", true, kBegin + milliseconds(1001));
  sut.note("channel a", "full", true, kBegin + milliseconds(1999));
  EXPECT_EQ(printed_by([&] { sut.tell_rest(); }),
            "swarmtalk: since then 2 more of this program's messages were not sent\n");
  EXPECT_EQ(printed_by([&] { sut.tell_rest(); }), "") << "each once";
}

TEST(Refusals, AreReportedToAProgramThatAskedForIt) {
  Refusals sut;
  sut.tells_stderr(false);
  const auto report = sut.note("channel a", "full", false, kBegin);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->code(), StatusCode::kBusy);
  EXPECT_EQ(report->text(), "channel a: a message was not sent: full");
  EXPECT_FALSE(sut.note("channel a", "full", false, kBegin));
  EXPECT_EQ(printed_by([&] { sut.tell_rest(); }), "");
}

}  // namespace
}  // namespace swarmtalk::client
