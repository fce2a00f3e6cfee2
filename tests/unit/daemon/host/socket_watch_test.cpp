#include "daemon/host/socket_watch.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>

namespace swarmtalk::daemon {
namespace {

class SocketWatchTest : public testing::Test {
 protected:
  SocketWatchTest() {
    char name[] = "/tmp/swarmtalk-test-XXXXXX";
    folder_ = mkdtemp(name);
    path_ = folder_ + "/socket";
    make_socket();
    watch_.emplace(io_, path_, [this] {
      ++tried_;
      if (can_restore_) make_socket();
      return can_restore_;
    });
  }
  ~SocketWatchTest() override { std::filesystem::remove_all(folder_); }

  void make_socket() const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    const int made = socket(AF_UNIX, SOCK_STREAM, 0);
    EXPECT_EQ(bind(made, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    close(made);
  }
  void step() {
    io_.restart();
    io_.poll();
  }

  std::string folder_, path_;
  boost::asio::io_context io_;
  bool can_restore_ = true;
  int tried_ = 0;
  std::optional<SocketWatch> watch_;
};

TEST_F(SocketWatchTest, SocketThatSomebodyDeletesIsRestoredEachTime) {
  for (int i = 1; i <= 3; ++i) {
    std::filesystem::remove(path_);
    step();
    EXPECT_EQ(tried_, i);
    EXPECT_TRUE(std::filesystem::exists(path_));
  }
}

TEST_F(SocketWatchTest, SocketThatIsMovedAwayIsRestored) {
  std::filesystem::rename(path_, folder_ + "/elsewhere");
  step();
  EXPECT_EQ(tried_, 1);
}

TEST_F(SocketWatchTest, OtherFilesOfTheFolderDoNotMatter) {
  std::ofstream(folder_ + "/other") << "x";
  std::filesystem::remove(folder_ + "/other");
  step();
  EXPECT_EQ(tried_, 0);
}

TEST_F(SocketWatchTest, WhatComesInItsPlaceAndIsNoSocketIsNotTakenForIt) {
  can_restore_ = false;
  std::filesystem::remove(path_);
  std::ofstream(path_) << "x";
  step();
  EXPECT_EQ(tried_, 1);
}

}  // namespace
}  // namespace swarmtalk::daemon
