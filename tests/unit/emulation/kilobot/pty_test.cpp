#include "emulation/kilobot/pty.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace swarmtalk::emulator {
namespace {

std::string link_path() {
  return testing::TempDir() + "swarmtalk-pty-" + std::to_string(::getpid());
}

TEST(Pty, CarriesBytesBothWaysUnchanged) {
  Pty pty(link_path());
  const int host = ::open(link_path().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
  ASSERT_GE(host, 0);
  const std::vector<std::uint8_t> bytes{0, 3, 10, 13, 0x11, 0x13, 0x1A, 0x7F, 0xFF};
  ASSERT_EQ(::write(host, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  std::vector<std::uint8_t> received;
  EXPECT_EQ(pty.read_into(received), bytes.size());
  EXPECT_EQ(received, bytes);
  pty.write(bytes);
  std::vector<std::uint8_t> back(bytes.size());
  EXPECT_EQ(::read(host, back.data(), back.size()), static_cast<ssize_t>(bytes.size()));
  EXPECT_EQ(back, bytes);
  ::close(host);
}

TEST(Pty, StaysWhenTheHostGoes) {
  Pty pty(link_path());
  for (int i = 0; i < 2; ++i) {
    const int host = ::open(link_path().c_str(), O_RDWR | O_NOCTTY);
    ASSERT_GE(host, 0);
    ASSERT_EQ(::write(host, "x", 1), 1);
    std::vector<std::uint8_t> received;
    EXPECT_EQ(pty.read_into(received), 1u);
    ::close(host);
  }
}

TEST(Pty, CountsWhatNobodyReads) {
  Pty pty("");
  const std::vector<std::uint8_t> bytes(1000);
  for (int i = 0; i < 200; ++i) pty.write(bytes);
  EXPECT_GT(pty.dropped_bytes(), 0u);
}

TEST(Pty, ReplacesAnOldLinkButNothingElse) {
  std::filesystem::create_symlink("/nonexistent", link_path());
  { Pty pty(link_path()); }
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(link_path())));
  std::ofstream(link_path()) << "precious";
  EXPECT_THROW(Pty{link_path()}, std::runtime_error);
  EXPECT_TRUE(std::filesystem::exists(link_path()));
  std::filesystem::remove(link_path());
}

}  // namespace
}  // namespace swarmtalk::emulator
