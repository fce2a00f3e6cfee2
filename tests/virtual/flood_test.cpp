// A stranger fills the air with messages that ask to be sent on as often as can be said. What the
// limits of forwarding do to that, at robots that may send a few frames a second
// (docs/decisions/0037-floods-end.md).
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <string>

#include "tests/virtual/swarm.hpp"

namespace swarmtalk::test {
namespace {

using namespace std::chrono_literals;

constexpr int kStranger = 999;
constexpr int kMessagesAtOnce = 11;  // about what a frame holds
constexpr int kFloodRateHz = 3;      // frames of each robot

class VirtualFlood : public testing::Test {
 protected:
  /// @param limits  keys of their link
  void add_robots(int count, const std::string& limits = "") {
    count_ = count;
    for (int n = 1; n <= count; ++n) {
      swarm_.add(n, {}, "rate_hz = " + std::to_string(kFloodRateHz) + "\n" + limits);
    }
    swarm_.add(kStranger);
  }

  /// @return how many messages there were
  int flood(std::chrono::nanoseconds duration) {
    VirtualProgram& mouth = swarm_.robot(kStranger).program("mouth");
    int messages = 0;
    for (std::chrono::nanoseconds over{}; over < duration; over += 12ms) {
      for (int i = 0; i < kMessagesAtOnce; ++i) {
        std::string text = std::to_string(++messages);
        text.resize(100, ' ');
        mouth.send("c", text, 255);
      }
      swarm_.advance(12ms);
    }
    return messages;
  }

  std::uint64_t sum_of(const std::string& counter) {
    std::uint64_t sum = 0;
    for (int n = 1; n <= count_; ++n) sum += swarm_.robot(n).counter(counter);
    return sum;
  }
  std::uint64_t forwarded() { return sum_of("node_packets_forwarded"); }

  Swarm swarm_;
  int count_ = 0;
};

TEST_F(VirtualFlood, EndsAfterItsHopsAndTheirWaits) {
  add_robots(3, "max_forward_ttl = 4\nmax_forward_wait_ms = 500\n");
  EXPECT_GT(flood(2s), 1000);
  // Five robots send on at most: each after its wait, and in its next frame.
  swarm_.advance(5 * (500ms + 1000ms / kFloodRateHz));
  const std::uint64_t before = forwarded();
  EXPECT_GT(before, 0u);
  EXPECT_GT(sum_of("node_forwards_too_late"), 0u);
  swarm_.advance(10min);
  EXPECT_EQ(forwarded(), before);
}

}  // namespace
}  // namespace swarmtalk::test
