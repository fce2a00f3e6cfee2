#include "emulation/kilobot/terminal_reader.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <chrono>
#include <optional>
#include <string>
#include <thread>

namespace swarmtalk::emulator {
namespace {

constexpr std::uint64_t kByteNs = 260'000;
constexpr auto kForEver = ~std::uint64_t{0};

class TerminalReaderTest : public testing::Test {
 protected:
  void SetUp() override {
    host_ = ::open(terminal_.device().c_str(), O_RDWR | O_NOCTTY);
    ASSERT_GE(host_, 0);
  }
  void TearDown() override { ::close(host_); }

  void write(const std::string& bytes) {
    ASSERT_EQ(::write(host_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }

  static std::uint64_t clock_ns() {
    return static_cast<std::uint64_t>(
        std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count());
  }
  /// Asked by poll(), which looks for bytes that are still on their way; FIONREAD does not.
  void wait_until_it_is_read() const {
    pollfd terminal{terminal_.descriptor(), POLLIN, 0};
    for (int i = 0; i < 60'000 && ::poll(&terminal, 1, 0) != 0; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ASSERT_EQ(::poll(&terminal, 1, 0), 0);
  }
  static std::optional<TimedByte> waited_for(TerminalReader& reader) {
    for (int i = 0; i < 60'000; ++i) {
      if (const auto byte = reader.take(kForEver)) return byte;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return std::nullopt;
  }

  Pty terminal_{""};
  int host_ = -1;
};

TEST_F(TerminalReaderTest, TakesBytesAsFastAsTheLine) {
  PacedReader reader(terminal_, kByteNs);
  std::uint64_t now_ns = 1'000'000'000;
  write("abcdefgh");
  // Late by four bytes at most: that many are there at once, the others take their time.
  std::uint64_t last_ns = 0;
  for (int i = 0; i < 4; ++i) {
    const auto byte = reader.next(now_ns);
    ASSERT_TRUE(byte);
    EXPECT_EQ(byte->byte, 'a' + i);
    EXPECT_TRUE(last_ns == 0 || byte->at_ns == last_ns + kByteNs);
    last_ns = byte->at_ns;
  }
  EXPECT_EQ(last_ns, now_ns);
  EXPECT_FALSE(reader.next(now_ns + kByteNs - 1));
  for (char expected = 'e'; expected <= 'h'; ++expected) {
    now_ns += kByteNs;
    const auto byte = reader.next(now_ns);
    ASSERT_TRUE(byte);
    EXPECT_EQ(byte->byte, expected);
    EXPECT_EQ(byte->at_ns, now_ns);
  }
  EXPECT_FALSE(reader.next(now_ns + 100 * kByteNs)) << "nothing was written";
}

TEST_F(TerminalReaderTest, KeepsASilenceForWhoeverLooksLate) {
  TerminalReader reader(terminal_, kByteNs);
  write("a");
  const auto first = waited_for(reader);
  ASSERT_TRUE(first);
  while (clock_ns() < first->at_ns + 20 * kByteNs) std::this_thread::yield();  // the silence
  const std::uint64_t before_ns = clock_ns();
  write("b");
  wait_until_it_is_read();
  const std::uint64_t after_ns = clock_ns();
  EXPECT_FALSE(reader.take(before_ns - 4 * kByteNs)) << "it came later";
  const auto second = waited_for(reader);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->byte, 'b');
  EXPECT_GE(second->at_ns, before_ns - 4 * kByteNs);
  EXPECT_LE(second->at_ns, after_ns) << "that of the look";
}

}  // namespace
}  // namespace swarmtalk::emulator
