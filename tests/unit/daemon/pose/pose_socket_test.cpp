#include "daemon/pose/pose_socket.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>

namespace swarmtalk::daemon {
namespace {

constexpr uid_t kNobody = 65534;

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
  static std::string text_of(const std::exception_ptr& refusal) {
    try {
      if (refusal) std::rethrow_exception(refusal);
    } catch (const ConfigError& caught) {
      return caught.what();
    }
    return "";
  }
  std::string error() {
    try {
      open();
    } catch (...) {
      return text_of(std::current_exception());
    }
    return "";
  }
  sockaddr_un address() const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    return address;
  }
  /// Somebody else's, at our path.
  int bound_socket(int type) const {
    const sockaddr_un at = address();
    const int descriptor = socket(AF_UNIX, type, 0);
    EXPECT_EQ(bind(descriptor, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    return descriptor;
  }
  ino_t inode() const {
    struct stat named {};
    return lstat(path_.c_str(), &named) == 0 ? named.st_ino : 0;
  }
  bool write(std::string_view text) {
    const sockaddr_un at = address();
    return sendto(writer_, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&at),
                  sizeof at) == static_cast<ssize_t>(text.size());
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
  close(bound_socket(SOCK_DGRAM));
  EXPECT_FALSE(write("1 2 3"));
  const auto socket = open();
  EXPECT_TRUE(write("1 2 3"));
}

TEST_F(PoseSocketTest, SocketThatSomebodyReadsIsLeftToHim) {
  const auto socket = open();
  EXPECT_EQ(error(), "f.toml: key 'node.pose_socket': " + path_ +
                         " is read by a running program; stop it, or choose another path");
}

TEST_F(PoseSocketTest, SocketThatMayNotBeWrittenToIsLeftToItsOwner) {
  if (geteuid() != 0) GTEST_SKIP() << "becoming another user needs root";
  const auto socket = open();
  ASSERT_EQ(chown(folder_.c_str(), kNobody, kNobody), 0);
  ASSERT_EQ(chmod(path_.c_str(), 0600), 0);
  const ino_t before = inode();
  ASSERT_EQ(seteuid(kNobody), 0);
  const std::string told = error();
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_EQ(told, "f.toml: key 'node.pose_socket': cannot tell whether a program reads " + path_ +
                      ": Permission denied; remove it if none does, or choose another path");
  EXPECT_EQ(inode(), before);
}

TEST_F(PoseSocketTest, SocketOfAnotherTypeThatIsServedIsLeftToItsOwner) {
  const int served = bound_socket(SOCK_STREAM);
  ASSERT_EQ(listen(served, 1), 0);
  EXPECT_NE(error().find("cannot tell whether a program reads " + path_), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(path_));
  close(served);
}

TEST_F(PoseSocketTest, WithoutADescriptorNothingIsRemoved) {
  open();  // from now on the io_context has the descriptors that it needs itself
  close(bound_socket(SOCK_DGRAM));
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  const rlimit none{0, limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  std::exception_ptr refusal;  // looked at later: sanitizers need descriptors for it
  try {
    open();
  } catch (...) {
    refusal = std::current_exception();
  }
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
  EXPECT_EQ(text_of(refusal), "f.toml: key 'node.pose_socket': " + path_ + ": Too many open files");
  EXPECT_TRUE(std::filesystem::exists(path_));
}

TEST_F(PoseSocketTest, WhatIsNoSocketIsNotRemoved) {
  std::ofstream(path_) << "precious";
  EXPECT_EQ(error(), "f.toml: key 'node.pose_socket': " + path_ +
                         " exists and is not a socket; remove it, or choose another path");
  EXPECT_TRUE(std::filesystem::exists(path_));
}

TEST_F(PoseSocketTest, UnknownGroupIsToldAndNoFileStays) {
  access_.group = "no-such-group";
  EXPECT_NE(error().find("key 'socket.group': there is no group"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(PoseSocketTest, FolderThatIsNotThereIsTold) {
  path_ = folder_ + "/none/pose.sock";
  EXPECT_NE(error().find("none does not exist; create it"), std::string::npos);
}

TEST_F(PoseSocketTest, DeletedFileIsMadeAgain) {
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
