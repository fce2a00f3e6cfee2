#include "daemon/pose/pose_socket.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>

namespace swarmtalk::daemon {
namespace {

class PoseSocketTest : public testing::Test {
 protected:
  PoseSocketTest() {
    char name[] = "/tmp/swarmtalk-test-XXXXXX";
    folder_ = mkdtemp(name);
    path_ = folder_ + "/pose.sock";
  }
  ~PoseSocketTest() override {
    close(writer_);
    std::filesystem::remove_all(folder_);
  }

  std::unique_ptr<PoseSocket> open() {
    return std::make_unique<PoseSocket>(io_, path_, access_, KeyLines("f.toml"), poses_, counters_);
  }
  std::string error() {
    try {
      open();
    } catch (const ConfigError& caught) {
      return caught.what();
    }
    return "";
  }
  bool write(std::string_view text) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    return sendto(writer_, text.data(), text.size(), 0, reinterpret_cast<sockaddr*>(&address),
                  sizeof address) == static_cast<ssize_t>(text.size());
  }
  std::optional<OwnPose> pose() const { return poses_.valid(std::chrono::steady_clock::now()); }

  std::string folder_, path_;
  SocketConfig access_;
  boost::asio::io_context io_;
  PoseKeeper poses_{NodeConfig{}};
  DaemonCounters counters_;
  int writer_ = socket(AF_UNIX, SOCK_DGRAM, 0);
};

TEST_F(PoseSocketTest, LastPoseOfThoseThatWaitCounts) {
  const auto socket = open();
  socket->start();
  ASSERT_TRUE(write("9 9 9") && write("1 2 3\n"));
  io_.poll();
  ASSERT_TRUE(pose());
  EXPECT_DOUBLE_EQ(pose()->x_m, 1.0);
  EXPECT_DOUBLE_EQ(pose()->theta_rad, 3.0);
  EXPECT_EQ(counters_.poses_received, 2u);
}

TEST_F(PoseSocketTest, AgeCounts) {
  const auto socket = open();
  socket->start();
  write("1 2 3 60");
  io_.poll();
  EXPECT_FALSE(pose()) << "pose_max_age_ms is 2 s";
  EXPECT_GE(poses_.age_ms(std::chrono::steady_clock::now()), 60000u);
}

TEST_F(PoseSocketTest, GarbageIsCountedAndChangesNothing) {
  const auto socket = open();
  socket->start();
  for (const std::string text : {"", "x", "1 2", "33 0 0", "1 2 3 4 5"}) ASSERT_TRUE(write(text));
  ASSERT_TRUE(write("1 2 3" + std::string(300, ' ')));
  io_.poll();
  EXPECT_FALSE(pose());
  EXPECT_EQ(counters_.poses_refused, 6u);
}

TEST_F(PoseSocketTest, FileHasModeOfTheConfigurationAndGoesWithTheSocket) {
  access_.mode = 0620;
  {
    const auto socket = open();
    struct stat made {};
    ASSERT_EQ(lstat(path_.c_str(), &made), 0);
    EXPECT_EQ(made.st_mode & 0777u, 0620u);
  }
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(PoseSocketTest, SocketThatADeadProgramLeftIsTakenOver) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
  const int dead = socket(AF_UNIX, SOCK_DGRAM, 0);
  ASSERT_EQ(bind(dead, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  close(dead);
  EXPECT_FALSE(write("1 2 3"));
  const auto socket = open();
  EXPECT_TRUE(write("1 2 3"));
}

TEST_F(PoseSocketTest, SocketThatSomebodyReadsIsLeftToHim) {
  const auto socket = open();
  EXPECT_EQ(error(), "f.toml: key 'node.pose_socket': " + path_ +
                         " is read by a running program; stop it, or choose another path");
}

TEST_F(PoseSocketTest, WhatIsNoSocketIsNotRemoved) {
  std::ofstream(path_) << "precious";
  EXPECT_EQ(error(), "f.toml: key 'node.pose_socket': " + path_ +
                         " exists and is no socket; remove it, or choose another path");
  EXPECT_TRUE(std::filesystem::exists(path_));
}

TEST_F(PoseSocketTest, UnknownGroupIsToldAndNoFileStays) {
  access_.group = "no-such-group";
  EXPECT_NE(error().find("key 'socket.group': cannot give " + path_), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(PoseSocketTest, FolderThatIsNotThereIsTold) {
  path_ = folder_ + "/none/pose.sock";
  EXPECT_NE(error().find("its folder must exist"), std::string::npos);
}

TEST_F(PoseSocketTest, DeletedFileIsMadeAnew) {
  const auto socket = open();
  socket->start();
  std::filesystem::remove(path_);
  io_.poll();
  ASSERT_TRUE(write("1 2 3"));
  io_.poll();
  EXPECT_TRUE(pose());
}

}  // namespace
}  // namespace swarmtalk::daemon
