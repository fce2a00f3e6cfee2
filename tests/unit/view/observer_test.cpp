// What the view asks a daemon for and makes of its answers, at a daemon that says what it is told.
#include "view/observer.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "report/report.hpp"
#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::view {
namespace {

class ObserverTest : public testing::Test {
 protected:
  ObserverTest() {
    daemon_.says = [this](const ipc::Envelope& asked) { return answer(asked); };
    daemon_.max_message_bytes = 1000;
  }

  /// On the daemon's thread.
  std::vector<ipc::Envelope> answer(const ipc::Envelope& asked) {
    ipc::Envelope envelope;
    if (asked.has_get_neighbours()) {
      envelope.mutable_neighbours()->add_neighbours()->set_node_id(7);
    } else if (asked.has_get_status()) {
      envelope.mutable_status()->set_version("9.9");
      envelope.mutable_status()->set_node_id(42);
    } else if (asked.has_subscribe() && asked.subscribe().channel().name() == refused_) {
      envelope.mutable_failure()->set_code(ipc::ERROR_BAD_CHANNEL);
      envelope.mutable_failure()->set_text("it is off");
    } else {
      return {};
    }
    return {envelope};
  }
  Observer& make(std::vector<std::string> channels = {}) {
    return observer_.emplace(io_, ObserverOptions{path_, std::move(channels)});
  }
  bool run_until(const std::function<bool()>& holds) {
    const auto deadline = std::chrono::steady_clock::now() + test::kPatience;
    while (!holds() && std::chrono::steady_clock::now() < deadline) {
      io_.restart();
      io_.run_for(std::chrono::milliseconds(5));
    }
    return holds();
  }
  /// Requests in their order, a letter each: s for a status, n for neighbours.
  std::string asked() {
    std::string letters;
    for (const ipc::Envelope& each : daemon_.received()) {
      if (each.has_get_status()) letters += 's';
      if (each.has_get_neighbours()) letters += 'n';
    }
    return letters;
  }
  std::vector<report::Look> looks() {
    std::vector<report::Look> found;
    for (const ipc::Envelope& each : daemon_.received()) {
      if (!each.has_publish()) continue;
      if (const auto look = report::decode_look(each.publish().payload())) found.push_back(*look);
    }
    return found;
  }
  std::vector<std::string> advertised() {
    std::vector<std::string> names;
    for (const ipc::Envelope& each : daemon_.received()) {
      if (!each.has_advertise()) continue;
      const ipc::Channel& channel = each.advertise().channel();
      names.push_back(channel.has_name() ? channel.name() : std::to_string(channel.number()));
    }
    return names;
  }

  const std::string path_ = test::test_socket_path();
  std::string refused_ = "none";  // a channel
  test::FakeDaemon daemon_{path_};
  boost::asio::io_context io_;
  std::optional<Observer> observer_;
};

TEST_F(ObserverTest, KnowsTheDaemonAndItsNeighboursFromTheBeginning) {
  ASSERT_TRUE(make().start());
  EXPECT_EQ(observer_->status().version, "9.9");
  EXPECT_EQ(observer_->daemon_name(), "fake 1.0");
  EXPECT_FALSE(observer_->lost_daemon_at());
  EXPECT_EQ(observer_->swarm().self(), 42u);
  EXPECT_NE(observer_->swarm().find(7), nullptr);
  EXPECT_TRUE(observer_->questions());
  EXPECT_EQ(asked(), "sn");
  ASSERT_TRUE(run_until([&] { return asked() == "snsn"; })) << "once a second while nobody looks";
  EXPECT_TRUE(looks().empty());
}

TEST_F(ObserverTest, SaysThatThereIsNoDaemon) {
  daemon_.kill();
  EXPECT_EQ(make().start().code(), StatusCode::kDaemonDead);
}

TEST_F(ObserverTest, SaysWhichChannelItCannotListenTo) {
  refused_ = "b";
  const Status status = make({"a", "b"}).start();
  EXPECT_EQ(status.code(), StatusCode::kBadChannel);
  EXPECT_EQ(status.text(), "--channel b: it is off");
}

TEST_F(ObserverTest, AsksMoreOftenWhileSomebodyLooksAndHasTheSwarmReport) {
  make().set_watched(true);
  ASSERT_TRUE(observer_->start());
  ASSERT_TRUE(run_until([&] { return asked().find("nnn") != std::string::npos; }))
      << "several times for each status";
  ASSERT_TRUE(run_until([&] { return looks().size() == 1; }));
  EXPECT_TRUE(looks()[0].wanted.empty());
  EXPECT_EQ(looks()[0].seconds, 60);
  observer_->want_details(7);
  ASSERT_TRUE(run_until([&] { return looks().size() == 2; }));
  EXPECT_EQ(looks()[1].wanted, std::vector<std::uint16_t>{7});
}

TEST_F(ObserverTest, TellsWhatItHears) {
  std::vector<std::string> messages, lines;
  ASSERT_TRUE(make({"a"}).start());
  observer_->on_message = [&](const HeardMessage& each) { messages.push_back(each.payload); };
  observer_->on_line = [&](const LogLine& each) {
    EXPECT_EQ(each.robot, 3u);
    lines.push_back(each.text);
  };
  ipc::Deliver deliver;
  deliver.set_payload("hello");
  deliver.set_sender(3);
  daemon_.deliver(deliver);  // on each of its channels: debug, harvest and a
  ASSERT_TRUE(run_until([&] { return !messages.empty() && !lines.empty(); }));
  EXPECT_EQ(messages, std::vector<std::string>{"hello"});
  EXPECT_EQ(lines, std::vector<std::string>{"hello"});
}

TEST_F(ObserverTest, LeavesOutAReservedChannelThatIsOff) {
  refused_ = "debug";
  ASSERT_TRUE(make().start());
  ASSERT_TRUE(run_until([&] { return observer_->left_out().contains("debug"); }));
  EXPECT_EQ(observer_->left_out().at("debug"), "it is off");
  EXPECT_FALSE(observer_->left_out().contains("harvest"));
}

TEST_F(ObserverTest, KnowsSinceWhenTheDaemonIsGoneAndThatItIsBack) {
  ASSERT_TRUE(make().start());
  const Time before = std::chrono::steady_clock::now();
  daemon_.kill();
  ASSERT_TRUE(run_until([&] { return observer_->lost_daemon_at().has_value(); }));
  EXPECT_GE(*observer_->lost_daemon_at(), before);
  daemon_.restart();
  ASSERT_TRUE(run_until([&] { return !observer_->lost_daemon_at(); }));
  const std::size_t questions = asked().size();
  ASSERT_TRUE(run_until([&] { return asked().size() >= questions + 2; }));
}

TEST_F(ObserverTest, SendsOnSixteenChannelsAndTheLongestUnusedGivesWay) {
  ASSERT_TRUE(make().start());
  const std::size_t own = advertised().size();
  for (int i = 1; i <= 16; ++i) ASSERT_TRUE(observer_->publish("c" + std::to_string(i), "x"));
  ASSERT_TRUE(observer_->publish("c1", "x"));
  ASSERT_TRUE(run_until([&] { return daemon_.count(test::is_publish) == 17; }));
  EXPECT_EQ(advertised().size(), own + 16) << "a channel is advertised once";
  ASSERT_TRUE(observer_->publish("17", "x"));
  ASSERT_TRUE(run_until([&] { return advertised().size() == own + 17; }));
  EXPECT_EQ(advertised().back(), "17");
  ASSERT_TRUE(observer_->publish("c1", "y"));
  ASSERT_TRUE(run_until([&] { return daemon_.count(test::is_publish) == 19; }));
  EXPECT_EQ(advertised().size(), own + 17) << "it was used after the others";
  ASSERT_TRUE(observer_->publish("c2", "y"));
  ASSERT_TRUE(run_until([&] { return advertised().size() == own + 18; }));
  EXPECT_EQ(advertised().back(), "c2");
}

TEST_F(ObserverTest, SaysWhyAMessageCannotBeSent) {
  ASSERT_TRUE(make().start());
  daemon_.refuse_channels.set_code(ipc::ERROR_LIMIT);
  daemon_.refuse_channels.set_text("no more");
  EXPECT_FALSE(observer_->publish("", "x"));
  EXPECT_FALSE(observer_->publish("a", "x"));
  daemon_.refuse_channels.set_code(ipc::ERROR_UNSPECIFIED);
  EXPECT_EQ(observer_->publish("b", std::string(2000, 'x')).code(), StatusCode::kTooLong);
}

}  // namespace
}  // namespace swarmtalk::view
