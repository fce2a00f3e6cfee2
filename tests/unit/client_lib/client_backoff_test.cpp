// How long a client waits between two tries to reach the daemon: read off the timer that it has
// armed, so that the figures are those of the construction and not of the machine's load. What is
// left on a timer only shrinks, so a busy machine makes none of these bounds fail.
#include <algorithm>

#include "tests/unit/client_lib/armed_timer.hpp"
#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

using ClientBackoff = ClientTest;  // there is no daemon at `path`

TEST_F(ClientBackoff, IsAtMostItsMaximumHoweverManyTriesHaveFailed) {
  ClientOptions quick = options();
  quick.reconnect_first = milliseconds(1);
  quick.reconnect_max = milliseconds(4);
  Client client("test", quick);
  collect_errors(client);
  nanoseconds longest{0};
  for (int i = 0; i < 50; ++i) {
    client.run_once(milliseconds(100));  // to the end of a wait, and the next try
    longest = std::max(longest, left_on_the_timer());
  }
  EXPECT_LE(longest, quick.reconnect_max);
  EXPECT_GT(longest, nanoseconds(0)) << "no wait was seen";
}

TEST_F(ClientBackoff, IsOnlyShortenedByItsJitter) {
  nanoseconds longest{0};
  for (int i = 0; i < 100; ++i) {
    ClientOptions at_its_end = options();
    at_its_end.reconnect_first = at_its_end.reconnect_max;
    Client client("test", at_its_end);
    collect_errors(client);
    client.process();
    longest = std::max(longest, left_on_the_timer());
  }
  EXPECT_LE(longest, ClientOptions{}.reconnect_max);
  EXPECT_GT(longest, nanoseconds(0)) << "no wait was seen";
}

// A daemon that is back meets every client after one wait at the most. The rest of the half second
// in which a client shall be registered again is for the greeting and the registrations, which take
// milliseconds; tests/faults/test_kills.py measures the sum.
TEST_F(ClientBackoff, MaximumIsAtMostHalfOfTheTimeInWhichAClientShallBeBack) {
  EXPECT_LE(ClientOptions{}.reconnect_max, milliseconds(250));
}

}  // namespace
}  // namespace swarmtalk::test
