#include "drivers/socket/transmit_queue.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "tests/unit/drivers/test_link_user.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;
const MonotonicTime kStart = MonotonicTime(100s);

class TransmitQueueTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0, sockets_), 0);
  }
  void TearDown() override {
    close(sockets_[0]);
    close(sockets_[1]);
  }

  void push(std::uint32_t number, MonotonicTime at = kStart) {
    const Bytes frame = numbered_packet(number, 20);
    const std::span<std::uint8_t> slot = queue_.slot(50);
    ASSERT_EQ(slot.size(), 50U);
    std::copy(frame.begin(), frame.end(), slot.begin());
    queue_.push(frame.size(), 1, at);
  }

  Bytes receive() const {
    Bytes bytes(100);
    const ssize_t size = recv(sockets_[1], bytes.data(), bytes.size(), 0);
    bytes.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
    return bytes;
  }

  int sockets_[2] = {-1, -1};
  TransmitQueue queue_;
  LinkCounters counters_;
};

TEST_F(TransmitQueueTest, SendsInOrderBehindTheMediumHeader) {
  const Bytes header = {1, 2, 3};
  queue_.set_medium_header(header);
  push(7);
  push(8);
  EXPECT_EQ(queue_.send(sockets_[0], counters_), 0);
  EXPECT_TRUE(queue_.is_empty());
  for (const std::uint32_t number : {7U, 8U}) {
    Bytes expected = header;
    const Bytes frame = numbered_packet(number, 20);
    expected.insert(expected.end(), frame.begin(), frame.end());
    EXPECT_EQ(receive(), expected);
  }
  EXPECT_EQ(counters_.frames_sent, 2U);
  EXPECT_EQ(counters_.packets_sent, 2U);
  EXPECT_EQ(counters_.bytes_sent, 40U) << "without the medium's header";
}

TEST_F(TransmitQueueTest, KeepsWhatTheKernelDoesNotTake) {
  std::uint32_t pushed = 0;
  int error = 0;
  for (int turn = 0; turn < 1000 && error == 0; ++turn) {
    while (!queue_.is_full()) push(pushed++);
    error = queue_.send(sockets_[0], counters_);
  }
  ASSERT_EQ(error, EAGAIN);
  for (std::uint32_t expected = 0; expected < pushed;) {
    const Bytes frame = receive();
    if (frame.empty()) {
      queue_.send(sockets_[0], counters_);
      continue;
    }
    ASSERT_EQ(frame, numbered_packet(expected++, 20));
  }
  EXPECT_EQ(counters_.frames_sent, pushed);
}

TEST_F(TransmitQueueTest, GivesUpFramesThatAreTooOld) {
  push(1, kStart);
  push(2, kStart + 1s);
  EXPECT_EQ(queue_.drop_built_before(kStart + 500ms), 1U);
  EXPECT_EQ(queue_.send(sockets_[0], counters_), 0);
  EXPECT_EQ(receive(), numbered_packet(2, 20));
}

TEST_F(TransmitQueueTest, IsEmptyAgainAfterDroppingTheOnlyFrame) {
  push(1);
  EXPECT_EQ(queue_.first_packets(), 1U);
  queue_.drop_first();
  EXPECT_TRUE(queue_.is_empty());
  EXPECT_FALSE(queue_.is_full());
}

}  // namespace
}  // namespace swarmtalk::drivers
