#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>

#include "client_lib/connection.hpp"
#include "client_lib/wakeup.hpp"
#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

using ClientConnect = ClientTest;

bool has(const Status& status, const std::string& part) {
  return status.text().find(part) != std::string_view::npos;
}

/// A variable of the environment that has this value for a while.
class ValueForAWhile {
 public:
  ValueForAWhile(const char* name, const std::string& value) : name_(name) {
    if (const char* const before = std::getenv(name)) before_ = before;
    ::setenv(name, value.c_str(), 1);
  }
  ~ValueForAWhile() {
    if (before_) {
      ::setenv(name_, before_->c_str(), 1);
    } else {
      ::unsetenv(name_);
    }
  }
  ValueForAWhile(const ValueForAWhile&) = delete;
  ValueForAWhile& operator=(const ValueForAWhile&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

/// A bound, listening socket that nobody serves. @return descriptor
int bind_socket(const std::string& path) {
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  EXPECT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  EXPECT_EQ(::listen(fd, 1), 0);
  return fd;
}

TEST_F(ClientConnect, SucceedsAndKnowsTheDaemon) {
  FakeDaemon daemon(path);
  Client client = make_client();
  const Status status = client.connect();
  ASSERT_TRUE(status) << status.text();
  EXPECT_TRUE(client.is_connected());
  EXPECT_EQ(client.node_id(), 42u);
  EXPECT_EQ(client.daemon_name(), "fake 1.0");
  ASSERT_EQ(daemon.received().size(), 1u);
  EXPECT_EQ(daemon.received()[0].hello().name(), "test");
}

TEST_F(ClientConnect, SaysHowToStartADaemonThatIsNotThere) {
  Client client = make_client();
  const Status status = client.connect();
  EXPECT_EQ(status.code(), StatusCode::kNoDaemon);
  EXPECT_TRUE(has(status, path)) << status.text();
  EXPECT_TRUE(has(status, "start swarmtalkd for that socket")) << status.text();
  const ValueForAWhile lab("SWARMTALK_LAB", "none");
  const Status standard = client::connect_error(ENOENT, ipc::kDefaultSocketPath);
  EXPECT_TRUE(has(standard, "systemctl start swarmtalkd")) << standard.text();
}

TEST_F(ClientConnect, SaysBesideALabHowToRunAsItsRobot) {
  const std::string runtime = path + ".runtime";
  const ValueForAWhile lab("SWARMTALK_LAB", "told");
  const ValueForAWhile folder("XDG_RUNTIME_DIR", runtime);
  for (const bool is_up : {false, true}) {
    const Status told = client::connect_error(ENOENT, ipc::kDefaultSocketPath);
    EXPECT_EQ(
        has(told, "; a lab is up, and as its robot 1 a program runs with: swarmtalk-lab exec"),
        is_up)
        << told.text();
    std::filesystem::create_directories(runtime + "/swarmtalk-lab/told");
    ::close(::open((runtime + "/swarmtalk-lab/told/lab.json").c_str(), O_CREAT | O_WRONLY, 0600));
  }
  EXPECT_FALSE(has(client::connect_error(ENOENT, path), "lab is up"));
  ::unsetenv("SWARMTALK_LAB");
  const Status told = client::connect_error(ENOENT, ipc::kDefaultSocketPath);
  EXPECT_TRUE(has(told, ": swarmtalk-lab --name told exec 1 -- PROGRAM")) << told.text();
  std::filesystem::remove_all(runtime);
}

TEST_F(ClientConnect, TellsADeadDaemonByItsSocket) {
  ::close(bind_socket(path));
  Client client = make_client();
  const Status status = client.connect();
  EXPECT_EQ(status.code(), StatusCode::kDaemonDead);
  EXPECT_TRUE(has(status, "died")) << status.text();
  EXPECT_TRUE(has(status, "start swarmtalkd for that socket")) << status.text();
  const Status standard = client::connect_error(ECONNREFUSED, ipc::kDefaultSocketPath);
  EXPECT_TRUE(has(standard, "systemctl restart swarmtalkd")) << standard.text();
}

TEST_F(ClientConnect, TellsAFileThatIsNoSocketFromADeadDaemon) {
  path = "/etc/passwd";
  Client client = make_client();
  const Status status = client.connect();
  EXPECT_EQ(status.code(), StatusCode::kNoDaemon);
  EXPECT_TRUE(has(status, "/etc/passwd is not a socket")) << status.text();
}

TEST_F(ClientConnect, TellsWhatHelpsWhoMayNotConnect) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root to become another user";
  const int fd = bind_socket(path);
  const std::string folder = std::filesystem::path(path).parent_path();
  struct Case {
    gid_t group;
    mode_t mode, folder_mode;
    const char* wanted;
  };
  for (const Case& each : {Case{1, 0660, 0755, "join group daemon: sudo usermod -aG daemon $USER"},
                           Case{0, 0660, 0755, "it is for root alone: run the program as root (su"},
                           Case{1, 0600, 0755, "it is for root alone"},
                           Case{1, 0660, 0700, "its folder is closed to this user"}}) {
    ASSERT_EQ(::chown(path.c_str(), 0, each.group), 0);
    ASSERT_EQ(::chmod(path.c_str(), each.mode), 0);
    ASSERT_EQ(::chmod(folder.c_str(), each.folder_mode), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      if (::setgid(65534) != 0 || ::setuid(65534) != 0) ::_exit(9);
      Client client("test", options());
      const Status status = client.connect();
      ::_exit(status.code() == StatusCode::kNoPermission && has(status, each.wanted) ? 0 : 1);
    }
    int result = -1;
    ::waitpid(child, &result, 0);
    EXPECT_EQ(result, 0) << each.wanted;
  }
  ::close(fd);
  const Status standard = client::connect_error(EACCES, ipc::kDefaultSocketPath + std::string("?"));
  EXPECT_TRUE(has(standard, "join group swarmtalk")) << standard.text();
}

TEST_F(ClientConnect, TellsWhoMayConnectAndCannotThatSomethingElseConfinesIt) {
  const int fd = bind_socket(path);
  const Status confined = client::connect_error(EPERM, path);
  EXPECT_EQ(confined.code(), StatusCode::kNoPermission);
  EXPECT_TRUE(has(confined, "something else confines the program")) << confined.text();
  ::close(fd);
}

TEST_F(ClientConnect, TakesNoPlaceOfAStandardStreamThatIsClosed) {
  const int listening = bind_socket(path);
  const int kept = ::dup(STDIN_FILENO);
  ::close(STDIN_FILENO);
  client::Wakeup wakeup;
  client::Connection connection;
  const Status connected = connection.open(path);
  const bool is_free = ::fcntl(STDIN_FILENO, F_GETFD) == -1;
  ::dup2(kept, STDIN_FILENO);
  ::close(kept);
  ::close(listening);
  EXPECT_TRUE(connected) << connected.text();
  EXPECT_TRUE(is_free);
}

TEST_F(ClientConnect, NamesBothVersionsWhenTheyDiffer) {
  FakeDaemon daemon(path);
  daemon.major = 9;
  Client client = make_client();
  const Status status = client.connect();
  EXPECT_EQ(status.code(), StatusCode::kVersionMismatch);
  EXPECT_TRUE(has(status, "9.0")) << status.text();
  EXPECT_TRUE(has(status, "1.0")) << status.text();
}

TEST_F(ClientConnect, TellsWhyItIsRefusedHoweverSoonTheDaemonCloses) {
  FakeDaemon daemon(path);
  daemon.refuse_clients.set_code(ipc::ERROR_LIMIT);
  daemon.refuse_clients.set_text("64 clients at most");
  for (int i = 0; i < 200; ++i) {  // the greeting comes before or after the close
    Client client = make_client();
    const Status status = client.connect();
    ASSERT_EQ(status.code(), StatusCode::kLimit) << i << ": " << status.text();
    ASSERT_EQ(status.text(), "64 clients at most");
  }
}

TEST_F(ClientConnect, GivesUpOnADaemonThatDoesNotAnswer) {
  const int fd = bind_socket(path);
  ClientOptions bounded = options();
  bounded.connect_timeout = std::chrono::milliseconds(80);
  Client client("test", bounded);
  const auto start = std::chrono::steady_clock::now();
  const Status status = client.connect();
  const auto waited = std::chrono::steady_clock::now() - start;
  ::close(fd);
  EXPECT_EQ(status.code(), StatusCode::kTimeout);
  EXPECT_GE(waited, std::chrono::milliseconds(70));
}

TEST_F(ClientConnect, GivesUpWhenTheQueueOfConnectionsIsFull) {
  const int fd = bind_socket(path);
  std::vector<Client> others;
  ClientOptions bounded = options();
  bounded.connect_timeout = std::chrono::milliseconds(40);
  Status status;
  for (int i = 0; i < 4; ++i) {
    others.emplace_back("test", bounded);
    collect_errors(others.back());
    status = others.back().connect();
    EXPECT_EQ(status.code(), StatusCode::kTimeout) << status.text();
  }
  ::close(fd);
  EXPECT_TRUE(has(status, "accepts no connections")) << status.text();
}

TEST_F(ClientConnect, RefusesAPathThatNoSocketCanHave) {
  path = "/tmp/" + std::string(200, 'x');
  Client client = make_client();
  EXPECT_EQ(client.connect().code(), StatusCode::kBadArgument);
}

TEST_F(ClientConnect, ANameThatIsNotTextIsRefusedBeforeAnythingIsSent) {
  FakeDaemon daemon(path);
  for (const std::string& name : {std::string("\xff\xfe"), std::string(1025, 'x')}) {
    Client client(name, options());
    collect_errors(client);
    EXPECT_EQ(client.connect().code(), StatusCode::kBadArgument);
    client.run_for(std::chrono::milliseconds(50));
  }
  EXPECT_TRUE(daemon.received().empty());
}

TEST_F(ClientConnect, TakesThePathFromTheEnvironment) {
  FakeDaemon daemon(path);
  ::setenv("SWARMTALK_SOCKET", path.c_str(), 1);
  Client client("test");
  ::unsetenv("SWARMTALK_SOCKET");
  EXPECT_TRUE(client.connect());
}

TEST_F(ClientConnect, ThrowsInTheThrowingForm) {
  try {
    Client::connected("test", options());
    FAIL() << "no exception";
  } catch (const Error& error) {
    EXPECT_EQ(error.status().code(), StatusCode::kNoDaemon);
    EXPECT_TRUE(std::string(error.what()).find(path) != std::string::npos);
  }
}

TEST_F(ClientConnect, HandlesMadeBeforeTheDaemonComesAreRegisteredLater) {
  Client client = make_client();
  std::string heard;
  auto channel = client.channel("hello");
  auto subscriber = channel.subscriber([&](const Message& m) { heard = m.text(); });
  auto publisher = channel.publisher();
  EXPECT_EQ(subscriber.status().code(), StatusCode::kDisconnected);
  EXPECT_EQ(publisher.send("x").code(), StatusCode::kDisconnected);
  FakeDaemon daemon(path);
  ASSERT_TRUE(run_until(client, [&] { return client.is_connected(); }));
  EXPECT_TRUE(subscriber.status());
  EXPECT_TRUE(publisher.send("x"));
  daemon.deliver("hello");
  EXPECT_TRUE(run_until(client, [&] { return heard == "hello"; }));
  ASSERT_EQ(errors.size(), 1u) << "the failed first connection is told once";
  EXPECT_EQ(errors[0].code(), StatusCode::kNoDaemon);
}

TEST_F(ClientConnect, ClosesOnGarbageAndComesBack) {
  FakeDaemon daemon(path);
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  daemon.send_raw(std::string("\x03\x00\x00\x00\xff\xff\xff", 7));
  ASSERT_TRUE(run_until(client, [&] { return reconnects == 1; }));
  ASSERT_EQ(losses.size(), 1u);
  EXPECT_EQ(losses[0].code(), StatusCode::kProtocol);
}

TEST_F(ClientConnect, ProtobufItselfSaysNothing) {
  FakeDaemon daemon(path);
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  testing::internal::CaptureStderr();
  // A status whose version is the byte ff, which proto3 does not take for a string.
  daemon.send_raw(std::string("\x05\x00\x00\x00\x7a\x03\x0a\x01\xff", 9));
  ASSERT_TRUE(run_until(client, [&] { return reconnects == 1; }));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  ASSERT_EQ(losses.size(), 1u);
  EXPECT_EQ(losses[0].code(), StatusCode::kProtocol);
}

}  // namespace
}  // namespace swarmtalk::test
