// Large messages while a stranger fills the pool of fragments with packets of messages that never
// become whole, each from a robot of its own. Virtual time, in us.
#include <gtest/gtest.h>

#include <ostream>

#include "swarmtalk/heard_messages.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::pattern;
using testing::TestNode;
using W = Wire<Wifi>;

enum class Junk { kLastPacket, kFirstPacket, kTwoPackets };

struct Attack {
  Junk junk;
  uint32_t messages_hz;
  uint8_t ttl;
};
std::ostream& operator<<(std::ostream& out, const Attack& attack) {
  const char* const what[] = {"last packets", "first packets", "pairs of packets"};
  return out << attack.messages_hz << " " << what[static_cast<int>(attack.junk)]
             << " a second, TTL " << static_cast<int>(attack.ttl);
}

class Crowd {
 public:
  explicit Crowd(const Attack& attack) : attack_(attack) {
    sut_.open(5);
    honest_.open(5, attack.ttl);
  }

  /// Sends messages of 4,000 bytes, three packets each `gap_us` apart. @return heard
  size_t hear(int messages, uint32_t gap_us) {
    run_until(2'500'000);  // the pool is full of what it gets
    for (int i = 0; i < messages; ++i) {
      honest_.publisher->send(pattern(4000).data(), 4000);
      for (const Bytes& packet : honest_.pull_all()) {
        run_until(sut_.port.now + gap_us);
        sut_.hear(packet);
      }
      run_until(sut_.port.now + 50'000);
    }
    return sut_.received.size();
  }

 private:
  void run_until(uint32_t time) {
    const uint32_t interval = 1'000'000 / attack_.messages_hz;
    for (; next_junk_ <= time; next_junk_ += interval) {
      sut_.port.now = next_junk_;
      send_junk();
    }
    sut_.port.now = time;
  }
  void send_junk() {
    W::Header header{};
    header.node = static_cast<uint16_t>(1000 + ++junk_ % 50000);
    header.epoch = static_cast<uint16_t>(junk_ * 7919);
    header.message = junk_;
    header.channel = 5;
    header.ttl = attack_.ttl;
    const bool is_last = attack_.junk == Junk::kLastPacket;
    header.size = static_cast<uint16_t>(11 * W::kPayloadBytes + 1);
    header.sequence = is_last ? 11 : 0;
    header.end = is_last;
    Bytes packet(W::kHeaderBytes + (is_last ? 1 : W::kPayloadBytes));
    W::encode(header, packet.data());
    sut_.hear(packet);
    if (attack_.junk != Junk::kTwoPackets) return;
    header.sequence = 1;
    W::encode(header, packet.data());
    sut_.hear(packet);
  }

  Attack attack_;
  TestNode<Wifi> sut_{99};
  TestNode<Wifi> honest_{1};
  uint32_t next_junk_ = 0;
  uint32_t junk_ = 0;
};

constexpr int kMessages = 100;

class CrowdedPool : public ::testing::TestWithParam<Attack> {};

TEST_P(CrowdedPool, HearsHonestMessagesOfSeveralPackets) {
  EXPECT_GE(Crowd(GetParam()).hear(kMessages, 2'000), 98u);
}

TEST_P(CrowdedPool, HearsThemFromASlowRobotAsWell) {
  EXPECT_GE(Crowd(GetParam()).hear(kMessages, 200'000), 98u);
}

INSTANTIATE_TEST_SUITE_P(
    All, CrowdedPool,
    ::testing::Values(Attack{Junk::kLastPacket, 250, 3}, Attack{Junk::kLastPacket, 250, 0},
                      Attack{Junk::kLastPacket, 10'000, 3}, Attack{Junk::kLastPacket, 10'000, 0},
                      Attack{Junk::kFirstPacket, 500, 3}, Attack{Junk::kFirstPacket, 500, 0},
                      Attack{Junk::kTwoPackets, 200, 3}, Attack{Junk::kTwoPackets, 200, 0}));

TEST(CrowdedPoolOfAll, ALonePacketOfANewRobotPushesOutNothingThatMoves) {
  TestNode<Wifi> sut(99);
  sut.open(5);
  // The pool is full of packets of messages that are being sent.
  std::vector<std::vector<Bytes>> messages;
  const uint16_t count = Wifi::kFragmentSlots;
  for (uint16_t i = 0; i < count; ++i) {
    TestNode<Wifi> sender(static_cast<uint16_t>(1000 + i));
    sender.open(5, 3);
    sender.publisher->send(pattern(2000).data(), 2000);
    messages.push_back(sender.pull_all());
    sut.hear(messages.back()[0]);
  }
  for (uint32_t i = 0; i < 1000; ++i) {
    W::Header header{};
    header.node = static_cast<uint16_t>(30000 + i);
    header.message = 1;
    header.channel = 5;
    header.ttl = 3;
    header.sequence = 1;
    header.end = true;
    header.size = W::kPayloadBytes + 1;
    Bytes packet(W::kHeaderBytes + 1);
    W::encode(header, packet.data());
    sut.hear(packet);
  }
  for (const auto& packets : messages) sut.hear(packets[1]);
  EXPECT_EQ(sut.received.size(), count);
}

}  // namespace
}  // namespace swarmtalk::core
