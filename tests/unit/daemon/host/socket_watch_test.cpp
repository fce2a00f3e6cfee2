#include "daemon/host/socket_watch.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>

#include "daemon/host/privileges.hpp"

namespace swarmtalk::daemon {
namespace {

class SocketWatchTest : public testing::Test {
 protected:
  SocketWatchTest() {
    char name[] = "/tmp/swarmtalk-test-XXXXXX";
    folder_ = mkdtemp(name);
    path_ = folder_ + "/socket";
    make_socket();
    watch(std::chrono::seconds(5));
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
  void watch(std::chrono::milliseconds retry) {
    const auto restore = [this] {
      ++tried_;
      if (can_restore_) make_socket();
      return can_restore_;
    };
    watch_.emplace(io_, path_, restore, retry);
  }
  /// So many things that happen, none of which takes long.
  void steps(int count) {
    for (int i = 0; i < count; ++i) {
      io_.restart();
      io_.run_one_for(std::chrono::milliseconds(20));
    }
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

TEST_F(SocketWatchTest, WithoutAWatchTheFileIsLookedAtByTheClock) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  watch_.reset();
  const int next = dup(0);
  close(next);
  const rlimit none_left{static_cast<rlim_t>(next), before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none_left), 0);
  watch(std::chrono::milliseconds(1));  // as where all inotify instances of a user are taken
  setrlimit(RLIMIT_NOFILE, &before);
  std::filesystem::remove(path_);
  steps(3);
  EXPECT_EQ(tried_, 1);
  EXPECT_TRUE(std::filesystem::exists(path_));
  std::filesystem::remove(path_);  // by now there is a watch
  step();
  EXPECT_EQ(tried_, 2);
}

TEST_F(SocketWatchTest, FolderThatMayNotBeEnteredIsNoDeletedSocket) {
  std::filesystem::permissions(folder_, std::filesystem::perms::none);
  testing::internal::CaptureStdout();  // one of them has the log
  testing::internal::CaptureStderr();
  std::thread([this] {  // whose capabilities are its own
    drop_privileges();
    watch(std::chrono::milliseconds(1));
    steps(3);
  })
      .join();
  const std::string told =
      testing::internal::GetCapturedStderr() + testing::internal::GetCapturedStdout();
  EXPECT_EQ(tried_, 0);
  EXPECT_NE(told.find("may not look either"), std::string::npos) << told;
  std::filesystem::permissions(folder_, std::filesystem::perms::owner_all);
  std::filesystem::remove(path_);
  steps(3);
  EXPECT_EQ(tried_, 1);
}

}  // namespace
}  // namespace swarmtalk::daemon
