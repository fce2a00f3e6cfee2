// How long a client waits between two tries to reach the daemon: read off the timer that it has
// armed, so that the figures are those of the construction and not of the machine's load. What is
// left on a timer only shrinks, so a busy machine makes none of these bounds fail.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// Whether `file`, of /proc/self/fdinfo, is of a timer; what is left on it.
std::optional<nanoseconds> left_on_timer(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  const std::string key = "it_value: (";
  while (std::getline(stream, line)) {
    if (!line.starts_with(key)) continue;
    std::istringstream numbers(line.substr(key.size()));
    std::int64_t seconds = 0, ns = 0;
    char comma = 0;
    if (!(numbers >> seconds >> comma >> ns)) return std::nullopt;
    return std::chrono::seconds(seconds) + nanoseconds(ns);
  }
  return std::nullopt;
}

/// What is left on the one timer of this process: that of the test's one client. proc(5)
nanoseconds left() {
  std::vector<nanoseconds> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fdinfo")) {
    if (const auto timer = left_on_timer(entry.path())) found.push_back(*timer);
  }
  EXPECT_EQ(found.size(), 1u);
  return found.empty() ? nanoseconds(0) : found[0];
}

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
    longest = std::max(longest, left());
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
    longest = std::max(longest, left());
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
