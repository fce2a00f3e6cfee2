// The connection's life: greeting, loss and return, and what is told of it, without an Engine.
#include "client_lib/connection_keeper.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/support/patience.hpp"
#include "tests/unit/client_lib/armed_timer.hpp"
#include "tests/unit/client_lib/fake_daemon.hpp"

namespace swarmtalk::client {
namespace {

class KeeperAlone : public testing::Test {
 protected:
  KeeperAlone() : path_(test::test_socket_path()) {}

  ClientOptions options() const {
    ClientOptions options;
    options.socket_path = path_;
    options.connect_timeout = std::chrono::milliseconds(5000);
    options.reconnect_first = options.reconnect_max = std::chrono::milliseconds(1);
    return options;
  }
  ClientOptions patient() const {
    ClientOptions patient = options();
    patient.reconnect_max = std::chrono::minutes(5);
    return patient;
  }
  ConnectionKeeper::Hooks hooks() {
    return {
        .on_message =
            [this](const ipc::DeliverFrame& message, bool may_call) {
              heard_.emplace_back(message.payload);
              may_call_ = may_call;
            },
        .on_envelope = [this](const ipc::Envelope& envelope, bool) { came_.push_back(envelope); },
        .on_greeted =
            [this] {
              happened_.emplace_back("greeted");
              if (is_up_at_once_) keeper_.become_up();
            },
        .on_return = [this] { happened_.emplace_back("return"); },
        .on_loss = [this](const Status& why) { tell("loss", why); },
        .on_failure = [this](const Status& why) { tell("failure", why); },
        .on_down = [this] { happened_.emplace_back("down"); }};
  }
  void tell(const std::string& what, const Status& why) {
    happened_.push_back(what + " " + std::to_string(static_cast<int>(why.code())));
  }
  static std::string told(const std::string& what, StatusCode code) {
    return what + " " + std::to_string(static_cast<int>(code));
  }
  /// At most test::kPatience.
  bool wait_until(const std::function<bool()>& enough) {
    return keeper_.wait_until(Wakeup::Clock::now() + test::kPatience, enough);
  }
  std::vector<std::string> happened() { return std::exchange(happened_, {}); }

  using Story = std::vector<std::string>;
  std::string path_;
  bool is_up_at_once_ = true;
  bool may_call_ = false;
  std::vector<std::string> heard_;
  std::vector<ipc::Envelope> came_;
  Story happened_;
  std::mutex gate_;
  Wakeup wakeup_;
  Connection connection_;
  ConnectionKeeper keeper_{"test", options(), gate_, wakeup_, connection_, hooks()};
};

TEST_F(KeeperAlone, GreetsAndIsUpWhenItsUserSaysSo) {
  test::FakeDaemon daemon(path_);
  is_up_at_once_ = false;
  EXPECT_FALSE(keeper_.has_started());
  keeper_.attempt_in_background();
  ASSERT_TRUE(wait_until([this] { return keeper_.is_greeted(); }));
  EXPECT_FALSE(keeper_.is_up());
  keeper_.become_up();
  EXPECT_TRUE(keeper_.is_up());
  EXPECT_EQ(happened(), Story{"greeted"}) << "the first time is not a return";
}

TEST_F(KeeperAlone, TellsLossAndReturnOnceEach) {
  test::FakeDaemon daemon(path_);
  ASSERT_TRUE(keeper_.connect());
  EXPECT_EQ(happened(), Story{"greeted"});
  daemon.kill();
  ASSERT_TRUE(wait_until([this] { return !keeper_.is_greeted(); }));
  EXPECT_EQ(happened(), (Story{told("loss", StatusCode::kDisconnected), "down"}));
  daemon.restart();
  ASSERT_TRUE(wait_until([this] { return keeper_.is_up(); }));
  EXPECT_EQ(happened(), (Story{"greeted", "return"})) << "that it was away is not told again";
}

TEST_F(KeeperAlone, TellsNoSecondLossOfADaemonThatHasNotComeBack) {
  test::FakeDaemon daemon(path_);
  ASSERT_TRUE(keeper_.connect());
  for (int times = 0; times < 2; ++times) {
    daemon.kill();
    ASSERT_TRUE(wait_until([this] { return !keeper_.is_greeted(); }));
    happened();
    daemon.refuse_clients.set_code(ipc::ERROR_LIMIT);
    daemon.restart();
    const auto is_down = [this] { return happened_.size() >= 2; };
    ASSERT_TRUE(wait_until(is_down));
    EXPECT_EQ(happened(), (Story{told("failure", StatusCode::kLimit), "down"}));
    daemon.kill();
    daemon.refuse_clients.Clear();
    daemon.restart();
    ASSERT_TRUE(wait_until([this] { return keeper_.is_up(); }));
    const Story back = happened();
    ASSERT_GE(back.size(), 2u);
    EXPECT_EQ(Story(back.end() - 2, back.end()), (Story{"greeted", "return"}));
    EXPECT_EQ(std::count(back.begin(), back.end(), "return"), 1);
  }
}

TEST_F(KeeperAlone, TellsWhyItCannotConnectOnceForAllAttempts) {
  for (int i = 0; i < 3; ++i) keeper_.on_timer();
  EXPECT_EQ(happened(), Story{told("failure", StatusCode::kNoDaemon)});
  EXPECT_EQ(keeper_.require().code(), StatusCode::kNoDaemon);
}

TEST_F(KeeperAlone, AnswersConnectWithTheFailureAndTellsNobodyElse) {
  EXPECT_EQ(keeper_.connect().code(), StatusCode::kNoDaemon);
  keeper_.on_timer();
  EXPECT_EQ(happened(), Story{});
}

TEST_F(KeeperAlone, DropsADaemonThatIsMalformed) {
  test::FakeDaemon daemon(path_);
  ASSERT_TRUE(keeper_.connect());
  daemon.send_raw(std::string("\x03\x00\x00\x00\xff\xff\xff", 7));
  ASSERT_TRUE(wait_until([this] { return !keeper_.is_greeted(); }));
  EXPECT_EQ(happened(), (Story{"greeted", told("loss", StatusCode::kProtocol), "down"}));
}

TEST_F(KeeperAlone, GivesUpADaemonThatDoesNotAnswer) {
  test::FakeDaemon daemon(path_);
  daemon.says_hello = false;
  keeper_.attempt_in_background();
  keeper_.on_timer();
  EXPECT_EQ(happened(), (Story{told("failure", StatusCode::kTimeout), "down"}));
}

TEST_F(KeeperAlone, ReadsWhyTheConnectionEndsWhenNothingCanBeWritten) {
  test::FakeDaemon daemon(path_);
  ASSERT_TRUE(keeper_.connect());
  ipc::Envelope last_words;
  last_words.mutable_failure()->set_code(ipc::ERROR_LIMIT);
  std::string bytes;
  ASSERT_TRUE(ipc::append_frame(last_words, bytes));
  daemon.send_raw(bytes);
  daemon.kill();
  connection_.append(last_words);
  for (int i = 0; i < 3 && keeper_.is_up(); ++i) keeper_.flush();
  EXPECT_FALSE(keeper_.is_up());
  ASSERT_EQ(came_.size(), 1u);
  EXPECT_EQ(came_[0].failure().code(), ipc::ERROR_LIMIT);
}

TEST_F(KeeperAlone, WaitsLongestForADaemonOfAnotherVersion) {
  test::FakeDaemon daemon(path_);
  daemon.major = 99;
  ConnectionKeeper keeper("test", patient(), gate_, wakeup_, connection_, hooks());
  keeper.attempt_in_background();
  const auto deadline = Wakeup::Clock::now() + test::kPatience;
  ASSERT_TRUE(keeper.wait_until(deadline, [this] { return !happened_.empty(); }));
  EXPECT_EQ(happened(), (Story{told("failure", StatusCode::kVersionMismatch), "down"}));
  EXPECT_GT(test::left_on_the_timer(), std::chrono::minutes(1));
}

TEST_F(KeeperAlone, BeginsWithTheShortestWaitAgainAfterASuccess) {
  is_up_at_once_ = false;
  ConnectionKeeper keeper("test", patient(), gate_, wakeup_, connection_, hooks());
  for (int i = 0; i < 20; ++i) keeper.on_timer();
  EXPECT_GT(test::left_on_the_timer(), std::chrono::minutes(1));
  test::FakeDaemon daemon(path_);
  keeper.on_timer();
  const auto deadline = Wakeup::Clock::now() + test::kPatience;
  ASSERT_TRUE(keeper.wait_until(deadline, [&] { return keeper.is_greeted(); }));
  keeper.become_up();
  daemon.kill();
  ASSERT_TRUE(keeper.wait_until(deadline, [&] { return !keeper.is_greeted(); }));
  EXPECT_LE(test::left_on_the_timer(), std::chrono::milliseconds(1));
}

TEST_F(KeeperAlone, SaysWhetherCallbacksMayRun) {
  test::FakeDaemon daemon(path_);
  ASSERT_TRUE(keeper_.connect());
  ipc::Envelope subscribe;
  subscribe.set_request_id(1);
  subscribe.mutable_subscribe()->mutable_channel()->set_name("hello");
  connection_.append(subscribe);
  ASSERT_TRUE(wait_until([this] { return !came_.empty(); }));
  daemon.deliver("while somebody waits");
  ASSERT_TRUE(wait_until([this] { return !heard_.empty(); }));
  EXPECT_FALSE(may_call_);
  daemon.deliver("while nobody does");
  while (heard_.size() < 2) {
    wakeup_.wait_for_socket(Wakeup::Clock::now() + test::kPatience);
    keeper_.read({});
    ASSERT_TRUE(keeper_.is_up());
  }
  EXPECT_TRUE(may_call_);
}

}  // namespace
}  // namespace swarmtalk::client
