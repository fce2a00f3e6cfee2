#include "drivers/socket/receive_batch.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/unit/drivers/test_link_user.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;
const MonotonicTime kNow = MonotonicTime(5000s);

TEST(StampClock, TakesAStampToTheMonotonicClock) {
  StampClock clock;
  clock.set_now({101, 100'000'000}, kNow);
  EXPECT_EQ(clock.monotonic({100, 900'000'000}), kNow - 200ms);
  EXPECT_EQ(clock.monotonic({101, 100'000'000}), kNow);
}

TEST(StampClock, DoesNotBelieveAStampOfAnotherTime) {
  StampClock clock;
  clock.set_now({101, 0}, kNow);
  EXPECT_EQ(clock.monotonic({102, 0}), std::nullopt);
  EXPECT_EQ(clock.monotonic({1'700'000'000, 0}), std::nullopt);
  EXPECT_EQ(clock.monotonic({40, 0}), std::nullopt);
}

TEST(StampClock, BelievesStampsOfWhatWaitedWhileTheProcessWasStopped) {
  StampClock clock;
  clock.set_now({101, 0}, kNow);
  EXPECT_EQ(clock.monotonic({51, 0}), kNow - 50s);
}

TEST(StampClock, BelievesNoStampAcrossAStepOfTheWallClock) {
  StampClock clock;
  clock.set_now({100, 0}, kNow);
  clock.set_now({104, 0}, kNow + 1s);  // three seconds too many
  EXPECT_EQ(clock.monotonic({103, 900'000'000}), std::nullopt);
  clock.set_now({105, 0}, kNow + 2s);
  EXPECT_EQ(clock.monotonic({104, 900'000'000}), kNow + 1900ms);
  clock.set_now({104, 999'000'000}, kNow + 3s);  // back
  EXPECT_EQ(clock.monotonic({104, 998'000'000}), std::nullopt);
}

TEST(StampClock, BelievesStampsWhileTheWallClockIsOnlyReadWithNoise) {
  StampClock clock;
  clock.set_now({100, 0}, kNow);
  clock.set_now({101, 100'000}, kNow + 1s);
  EXPECT_EQ(clock.monotonic({101, 0}), kNow + 1s - 100us);
}

class ReceiveBatchTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(socketpair(AF_UNIX, SOCK_DGRAM, 0, sockets_), 0); }
  void TearDown() override {
    close(sockets_[0]);
    close(sockets_[1]);
  }
  void write(const Bytes& bytes) const {
    ASSERT_EQ(send(sockets_[0], bytes.data(), bytes.size(), 0), static_cast<ssize_t>(bytes.size()));
  }

  int sockets_[2] = {-1, -1};
  ReceiveBatch batch_;
};

TEST_F(ReceiveBatchTest, ReadsAllThatWaits) {
  batch_.set_datagram_bytes(100);
  write(numbered_packet(1, 10));
  write(numbered_packet(2, 100));
  ASSERT_EQ(batch_.read(sockets_[1]), 2);
  EXPECT_EQ(Bytes(batch_[0].bytes.begin(), batch_[0].bytes.end()), numbered_packet(1, 10));
  EXPECT_EQ(Bytes(batch_[1].bytes.begin(), batch_[1].bytes.end()), numbered_packet(2, 100));
}

TEST_F(ReceiveBatchTest, ReadsAgainAfterReadsOfAnyNumber) {
  batch_.set_datagram_bytes(100);
  int round = 0;
  for (const int count : {1, 5, 0, 2, 64, 1, 70, 3}) {
    for (int i = 0; i < count; ++i) write(numbered_packet(1, 10U + static_cast<unsigned>(i % 5)));
    int left = count;
    for (int got = batch_.read(sockets_[1]); got > 0; got = batch_.read(sockets_[1])) {
      for (int i = 0; i < got; ++i) {
        EXPECT_EQ(batch_[static_cast<std::size_t>(i)].bytes.size(),
                  10U + static_cast<unsigned>((count - left + i) % 5))
            << "round " << round;
      }
      left -= got;
    }
    EXPECT_EQ(left, 0);
    ++round;
  }
}

TEST_F(ReceiveBatchTest, SaysWhenNothingWaits) {
  batch_.set_datagram_bytes(100);
  EXPECT_EQ(batch_.read(sockets_[1]), -1);
  EXPECT_EQ(errno, EAGAIN);
}

TEST_F(ReceiveBatchTest, CutsADatagramThatIsTooLong) {
  batch_.set_datagram_bytes(50);
  write(numbered_packet(1, 51));
  ASSERT_EQ(batch_.read(sockets_[1]), 1);
  EXPECT_EQ(batch_[0].bytes.size(), 50U);
}

TEST_F(ReceiveBatchTest, TimesADatagramWithoutAStampWhenItIsRead) {
  batch_.set_datagram_bytes(50);
  write(numbered_packet(1, 10));
  const MonotonicTime before = std::chrono::steady_clock::now();
  ASSERT_EQ(batch_.read(sockets_[1]), 1);
  EXPECT_GE(batch_[0].received_at, before);
  EXPECT_LE(batch_[0].received_at, std::chrono::steady_clock::now());
}

}  // namespace
}  // namespace swarmtalk::drivers
