// What a body hears, and what is told when there is none.
#include "platforms/coachbot/body_port.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace swarmtalk::platforms {
namespace {

class BodyPortTest : public ::testing::Test {
 protected:
  void SetUp() override {
    char pattern[] = "/tmp/swarmtalk-body-XXXXXX";
    folder_ = mkdtemp(pattern);
    path_ = folder_ + "/body";
  }
  void TearDown() override {
    if (fd_ >= 0) close(fd_);
    std::filesystem::remove_all(folder_);
  }
  void listen() {
    fd_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const sockaddr_un address = body_address(path_);
    ASSERT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  std::string heard() {
    char text[64];
    const ssize_t n = recv(fd_, text, sizeof text, 0);
    return n < 0 ? "nothing" : std::string(text, static_cast<size_t>(n));
  }
  std::string folder_;
  std::string path_;
  int fd_ = -1;
};

TEST_F(BodyPortTest, SaysCommandsInPercent) {
  listen();
  BodyPort body(path_);
  body.drive(1, -0.5);
  body.led(kYellow);
  EXPECT_EQ(heard(), "vel 100 -50");
  EXPECT_EQ(heard(), "led 100 100 0");
  EXPECT_EQ(body.unsent(), 0U);
}

TEST_F(BodyPortTest, NamesThePathWhereNobodyListens) {
  try {
    BodyPort body(path_);
    FAIL() << "there is no body";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("no body at " + path_), std::string::npos);
  }
  EXPECT_THROW(BodyPort(std::string(200, 'x')), std::runtime_error);
}

TEST_F(BodyPortTest, CountsCommandsToABodyThatHasGone) {
  listen();
  BodyPort body(path_);
  close(fd_);
  fd_ = -1;
  body.drive(0, 0);
  EXPECT_EQ(body.unsent(), 1U);
}

}  // namespace
}  // namespace swarmtalk::platforms
