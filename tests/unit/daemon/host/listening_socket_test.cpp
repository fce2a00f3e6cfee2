#include "daemon/host/listening_socket.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

namespace swarmtalk::daemon {
namespace {

class ListeningSocketTest : public testing::Test {
 protected:
  ListeningSocketTest() {
    char name[] = "/tmp/swarmtalk-test-XXXXXX";
    folder_ = mkdtemp(name);
    config_.path = folder_ + "/d.sock";
  }
  ~ListeningSocketTest() override { std::filesystem::remove_all(folder_); }

  ListeningSocket open() const { return ListeningSocket::open(config_, lines_); }
  std::string error() const {
    try {
      open();
    } catch (const ConfigError& caught) {
      return caught.what();
    }
    return "";
  }
  bool can_connect() const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, config_.path.c_str(), sizeof address.sun_path - 1);
    const int descriptor = socket(AF_UNIX, SOCK_STREAM, 0);
    const bool ok = connect(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    close(descriptor);
    return ok;
  }
  /// One of several daemons that start at once. @return exit code: 0 won, 1 refused, 3 deaf winner
  int try_once(int start, int tried, int done) const {
    char byte = 0;
    (void)!read(start, &byte, 1);
    try {
      const ListeningSocket socket = open();
      const bool is_heard = can_connect();
      (void)!write(tried, &byte, 1);
      (void)!read(done, &byte, 1);  // holds it until all have tried
      return is_heard ? 0 : 3;
    } catch (const ConfigError&) {
      (void)!write(tried, &byte, 1);
      return 1;
    }
  }
  /// Leaves a socket behind as a daemon does that was killed.
  void leave_stale_socket() const {
    const pid_t pid = fork();
    if (pid == 0) {
      const ListeningSocket socket = open();
      _exit(0);  // no destructor runs
    }
    waitpid(pid, nullptr, 0);
    ASSERT_TRUE(std::filesystem::exists(config_.path));
  }

  static constexpr int kDaemons = 8;

  std::string folder_;
  SocketConfig config_;
  KeyLines lines_{"f.toml"};
};

TEST_F(ListeningSocketTest, KnowsWhetherAProgramWaits) {
  const ListeningSocket socket = open();
  EXPECT_FALSE(socket.is_awaited());
  EXPECT_TRUE(can_connect());
  EXPECT_TRUE(socket.is_awaited());
}

TEST_F(ListeningSocketTest, ListensWithTheModeAndGoesAway) {
  config_.mode = 0640;
  {
    const ListeningSocket socket = open();
    EXPECT_TRUE(can_connect());
    struct stat made {};
    ASSERT_EQ(stat(config_.path.c_str(), &made), 0);
    EXPECT_EQ(made.st_mode & 07777, 0640u);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(ListeningSocketTest, SocketOfALiveDaemonIsNeverTouched) {
  const ListeningSocket socket = open();
  EXPECT_EQ(error(), "f.toml: key 'socket.path': " + config_.path +
                         " is served by a running swarmtalkd (process " + std::to_string(getpid()) +
                         "); stop it, or choose another path");
  EXPECT_TRUE(can_connect());
}

TEST_F(ListeningSocketTest, LiveSocketWithoutALockIsNotTouchedEither) {
  const ListeningSocket socket = open();
  std::filesystem::remove(config_.path + ".lock");
  EXPECT_NE(error().find("is served by a running swarmtalkd"), std::string::npos);
  EXPECT_TRUE(can_connect());
}

TEST_F(ListeningSocketTest, LockFileThatCannotBeOpenedIsNamedWithTheRemedy) {
  std::filesystem::create_directory(config_.path + ".lock");
  const std::string text = error();
  EXPECT_NE(text.find("cannot open the lock file " + config_.path + ".lock"), std::string::npos)
      << text;
  EXPECT_NE(text.find("remove it"), std::string::npos) << text;
}

TEST_F(ListeningSocketTest, StaleSocketIsTakenOver) {
  leave_stale_socket();
  EXPECT_FALSE(can_connect());
  const ListeningSocket socket = open();
  EXPECT_TRUE(can_connect());
}

TEST_F(ListeningSocketTest, OnlyOneOfManyDaemonsThatStartAtOnceWins) {
  for (int round = 0; round < 20; ++round) {
    leave_stale_socket();
    int start[2];  // closed: all begin at once
    int tried[2];  // a byte from each that has tried
    int done[2];   // closed: the winner may let go
    ASSERT_TRUE(pipe(start) == 0 && pipe(tried) == 0 && pipe(done) == 0);
    std::vector<pid_t> children;
    for (int i = 0; i < kDaemons; ++i) {
      const pid_t pid = fork();
      if (pid == 0) {
        close(start[1]);
        close(done[1]);
        _exit(try_once(start[0], tried[1], done[0]));
      }
      children.push_back(pid);
    }
    close(start[0]);
    close(done[0]);
    close(start[1]);
    char byte = 0;
    for (int i = 0; i < kDaemons; ++i) ASSERT_EQ(read(tried[0], &byte, 1), 1);
    close(done[1]);
    close(tried[0]);
    close(tried[1]);
    int winners = 0;
    for (const pid_t pid : children) {
      int status = 0;
      waitpid(pid, &status, 0);
      ASSERT_TRUE(WIFEXITED(status));
      EXPECT_NE(WEXITSTATUS(status), 3);
      winners += WEXITSTATUS(status) == 0;
    }
    EXPECT_EQ(winners, 1) << "round " << round;
  }
}

TEST_F(ListeningSocketTest, SocketThatSomebodyElseMadeMeanwhileIsLeftAlone) {
  {
    const ListeningSocket socket = open();
    std::filesystem::remove(config_.path);
    std::ofstream(config_.path) << "mine";
  }
  EXPECT_TRUE(std::filesystem::exists(config_.path));
}

TEST_F(ListeningSocketTest, SocketOfSystemdIsUsedAndNotRemoved) {
  const pid_t pid = fork();
  if (pid == 0) {
    {
      const ListeningSocket outer = open();  // stands for systemd's
      dup2(outer.descriptor(), 3);
      setenv("LISTEN_PID", std::to_string(getpid()).c_str(), 1);
      setenv("LISTEN_FDS", "1", 1);
      {
        const ListeningSocket passed = open();
        if (!passed.is_from_systemd() || passed.descriptor() != 3) _exit(1);
      }
      if (!std::filesystem::exists(config_.path)) _exit(2);
    }
    _exit(0);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(ListeningSocketTest, SomethingElsePassedBySystemdIsRefused) {
  const pid_t pid = fork();
  if (pid == 0) {
    dup2(STDERR_FILENO, 3);
    setenv("LISTEN_PID", std::to_string(getpid()).c_str(), 1);
    setenv("LISTEN_FDS", "1", 1);
    _exit(error().find("ListenStream=") != std::string::npos ? 0 : 1);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(ListeningSocketTest, MissingFolderIsNamed) {
  config_.path = folder_ + "/none/d.sock";
  EXPECT_EQ(error(), "f.toml: key 'socket.path': the folder " + folder_ +
                         "/none does not exist; create it, or choose another path");
}

TEST_F(ListeningSocketTest, FileThatIsNoSocketIsNotRemoved) {
  std::ofstream(config_.path) << "precious";
  EXPECT_EQ(error(), "f.toml: key 'socket.path': " + config_.path +
                         " exists and is not a socket; remove it, or choose another path");
  EXPECT_TRUE(std::filesystem::exists(config_.path));
}

TEST_F(ListeningSocketTest, UnknownGroupIsNamedAtItsKey) {
  config_.group = "no-such-group";
  EXPECT_EQ(error(),
            "f.toml: key 'socket.group': there is no group 'no-such-group'; create it (`groupadd "
            "--system no-such-group`), or leave the key out");
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(ListeningSocketTest, MissingPermissionSaysWhere) {
  if (geteuid() != 0) GTEST_SKIP() << "becoming another user needs root";
  chmod(folder_.c_str(), 0755);
  const pid_t pid = fork();
  if (pid == 0) {
    if (setgid(65534) != 0 || setuid(65534) != 0) _exit(2);
    const std::string wanted = "f.toml: key 'socket.path': no permission to create " +
                               config_.path + "; run swarmtalkd as a user who may write to " +
                               folder_ + ", or choose another path";
    _exit(error() == wanted ? 0 : 1);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace swarmtalk::daemon
