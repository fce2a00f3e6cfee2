// What both of the daemon's sockets share; what each makes of it is in their own tests.
#include "daemon/host/unix_socket_file.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

namespace swarmtalk::daemon {
namespace {

constexpr SocketKind kTestKind{SOCK_DGRAM, "test.path", "is used by a test", "whether a test uses"};

class SocketFile : public testing::Test {
 protected:
  SocketFile() {
    char name[] = "/tmp/swarmtalk-test-XXXXXX";
    folder_ = mkdtemp(name);
    path_ = folder_ + "/s.sock";
  }
  ~SocketFile() override { std::filesystem::remove_all(folder_); }

  bool is_there() const { return std::filesystem::exists(path_); }

  std::string folder_, path_;
  SocketConfig access_;
  KeyLines lines_{"f.toml"};
};

TEST_F(SocketFile, GoesWithItsObject) {
  {
    UnixSocketFile file(path_, kTestKind);
    EXPECT_FALSE(is_there());
    file.open(access_, lines_);
    EXPECT_TRUE(is_there());
    EXPECT_EQ(file.probe().error, 0);
  }
  EXPECT_FALSE(is_there());
}

TEST_F(SocketFile, StaysWhenItsDescriptorIsReleased) {
  UnixSocketFile file(path_, kTestKind);
  file.open(access_, lines_);
  const int descriptor = file.release();
  EXPECT_EQ(file.descriptor(), -1);
  EXPECT_TRUE(is_there());
  close(descriptor);
  EXPECT_EQ(file.probe().error, ECONNREFUSED);
}

TEST_F(SocketFile, IsLeftAloneWhileSomebodyUsesIt) {
  UnixSocketFile file(path_, kTestKind);
  file.open(access_, lines_);
  {
    UnixSocketFile other(path_, kTestKind);
    EXPECT_THROW(other.open(access_, lines_), ConfigError);
  }
  EXPECT_EQ(file.probe().error, 0);
}

TEST_F(SocketFile, IsNotRemovedWhenSomebodyElseHasTakenItsPlace) {
  UnixSocketFile second(path_, kTestKind);
  {
    UnixSocketFile first(path_, kTestKind);
    first.open(access_, lines_);
    std::filesystem::remove(path_);
    second.open(access_, lines_);
  }
  EXPECT_TRUE(is_there());
}

TEST_F(SocketFile, KeepsTheOldDescriptorWhenANewOneCannotBeMade) {
  UnixSocketFile file(path_, kTestKind);
  file.open(access_, lines_);
  const int before = file.descriptor();
  access_.group = "no-such-group";
  EXPECT_THROW(file.open(access_, lines_), ConfigError);
  EXPECT_EQ(file.descriptor(), before);
  EXPECT_EQ(file.probe().error, 0);
}

}  // namespace
}  // namespace swarmtalk::daemon
