// Connected programs as a whole: whom the listening socket lets in, and what is told of them.
#include "daemon/session/clients.hpp"

#include <spdlog/spdlog.h>
#include <sys/un.h>

#include <filesystem>

#include "daemon/common/logging.hpp"
#include "tests/unit/daemon/session/session_harness.hpp"

namespace swarmtalk::daemon {
namespace {

class ClientsTest : public SessionTest {
 protected:
  ClientsTest() {
    char name[] = "/tmp/swarmtalk-test-XXXXXX";
    folder_ = mkdtemp(name);
  }
  ~ClientsTest() override { std::filesystem::remove_all(folder_); }

  static sockaddr_un address(const std::string& path) {
    sockaddr_un to{};
    to.sun_family = AF_UNIX;
    path.copy(to.sun_path, sizeof to.sun_path - 1);
    return to;
  }
  /// Clients listen there from now on.
  void listen(const std::string& file) {
    const int listening = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0);
    const sockaddr_un to = address(folder_ + file);
    ASSERT_EQ(::bind(listening, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    ASSERT_EQ(::listen(listening, 100), 0);
    clients_.listen(listening);
    ::close(listening);
  }
  /// @return null: nobody listens there
  std::unique_ptr<TestPeer> call(const std::string& file) {
    const int descriptor = ::socket(AF_UNIX, SOCK_STREAM, 0);
    const sockaddr_un to = address(folder_ + file);
    if (::connect(descriptor, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
      ::close(descriptor);
      return nullptr;
    }
    return std::make_unique<TestPeer>(descriptor);
  }
  std::vector<ipc::ClientStatus> told() {
    google::protobuf::RepeatedPtrField<ipc::ClientStatus> statuses;
    clients_.fill(statuses);
    return {statuses.begin(), statuses.end()};
  }

  std::string folder_;
};

TEST_F(ClientsTest, AllThatCallAreLetInAlsoManyAtOnceAndLater) {
  limits_.clients = limits_.clients_per_user = 71;
  listen("/socket");
  std::vector<std::unique_ptr<TestPeer>> peers;
  for (int i = 0; i < 70; ++i) {
    peers.push_back(call("/socket"));
    ASSERT_NE(peers.back(), nullptr);
    peers.back()->hello();
  }
  step();
  EXPECT_EQ(clients_.size(), 70u);
  EXPECT_EQ(counters_.clients_accepted, 70u);
  for (const auto& peer : peers) EXPECT_EQ(peer->receive().size(), 1u);
  peers.push_back(call("/socket"));
  peers.back()->hello();
  step();
  EXPECT_EQ(peers.back()->receive().size(), 1u);
}

TEST_F(ClientsTest, ListenOnOneSocketTheLastAndOnNoneWhenAllAreClosed) {
  listen("/old");
  listen("/new");
  EXPECT_EQ(call("/old"), nullptr);
  const auto peer = call("/new");
  ASSERT_NE(peer, nullptr);
  step();
  EXPECT_EQ(clients_.size(), 1u);
  clients_.close_all("it ends");
  EXPECT_EQ(clients_.size(), 0u);
  EXPECT_EQ(call("/new"), nullptr);
}

TEST_F(ClientsTest, AreToldOfOnceTheyHaveGreetedThoseWithMostToReadFirst) {
  const auto silent = connect();
  const auto idle = greeted();
  const auto slow = greeted();
  subscribed(*slow, "hello");
  receive_on_air("hello", std::string(500, 'x'));
  const auto all = told();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].subscriptions(), 1u);
  EXPECT_GE(all[0].queued_bytes(), 500u);
  EXPECT_EQ(all[1].subscriptions(), 0u);
  EXPECT_EQ(all[1].queued_bytes(), 0u);
  EXPECT_EQ(clients_.size(), 3u);
}

TEST_F(ClientsTest, AreToldOfUpToAHundredAndTwentyEight) {
  limits_.clients = limits_.clients_per_user = 200;
  std::vector<std::unique_ptr<TestPeer>> peers;
  for (int i = 0; i < 130; ++i) peers.push_back(greeted());
  EXPECT_EQ(told().size(), 128u);
  EXPECT_EQ(clients_.size(), 130u);
}

TEST_F(ClientsTest, ThatAreClosedForAMistakeAreLoggedAndThoseThatHangUpAreNot) {
  const auto before = spdlog::default_logger();
  testing::internal::CaptureStderr();
  start_logging("info");
  auto gone = greeted();
  gone.reset();
  step();
  auto other = connect();
  other->hello(7);
  step();
  EXPECT_TRUE(other->is_closed || !other->receive().empty());
  const std::string log = testing::internal::GetCapturedStderr();
  spdlog::set_default_logger(before);
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), 1) << log;
  EXPECT_NE(log.find(" closed: the client speaks protocol 7.0, this daemon "), std::string::npos)
      << log;
}

}  // namespace
}  // namespace swarmtalk::daemon
