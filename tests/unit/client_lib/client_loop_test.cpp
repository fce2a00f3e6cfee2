#include <poll.h>

#include <algorithm>
#include <csignal>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

using ClientLoop = ClientTest;

/// An app's own loop: poll on fd(), process() when readable.
bool poll_until(Client& client, int fd, const std::function<bool()>& holds) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!holds() && std::chrono::steady_clock::now() < deadline) {
    pollfd descriptor{fd, POLLIN, 0};
    if (::poll(&descriptor, 1, 1000) == 1) client.process();
  }
  return holds();
}

TEST_F(ClientLoop, OneDescriptorServesConnectDeliverLossAndReturn) {
  FakeDaemon daemon(path);
  Client client = make_client();
  const int fd = client.fd();
  ASSERT_TRUE(poll_until(client, fd, [&] { return client.is_connected(); }))
      << "polling alone connects";
  int heard = 0;
  auto subscriber = client.channel("hello").subscriber([&](const Message&) { ++heard; });
  daemon.deliver("one");
  ASSERT_TRUE(poll_until(client, fd, [&] { return heard == 1; }));
  daemon.kill();
  ASSERT_TRUE(poll_until(client, fd, [&] { return losses.size() == 1; }));
  daemon.restart();
  ASSERT_TRUE(poll_until(client, fd, [&] { return reconnects == 1; }));
  EXPECT_EQ(client.fd(), fd);
  daemon.deliver("two");
  EXPECT_TRUE(poll_until(client, fd, [&] { return heard == 2; }));
}

TEST_F(ClientLoop, DescriptorIsQuietWhenNothingHappens) {
  FakeDaemon daemon(path);
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  auto subscriber = client.channel("hello").subscriber([](const Message&) {});
  client.process();
  pollfd descriptor{client.fd(), POLLIN, 0};
  EXPECT_EQ(::poll(&descriptor, 1, 30), 0);
}

// process() begins to watch whether it hears anything, and nothing else may ever wake the loop.
TEST_F(ClientLoop, ASubscriptionMakesTheDescriptorReadableOnce) {
  FakeDaemon daemon(path);
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  client.process();
  pollfd descriptor{client.fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&descriptor, 1, 0), 0);
  auto subscriber = client.channel("hello").subscriber([](const Message&) {});
  EXPECT_EQ(::poll(&descriptor, 1, 0), 1);
  client.process();
  EXPECT_EQ(::poll(&descriptor, 1, 0), 0);
}

TEST_F(ClientLoop, AProgramThatIsThereBeforeTheDaemonLooksWhyItHearsNothing) {
  Client client = make_client();
  client.process();
  auto subscriber = client.channel("hello").subscriber([](const Message&) {});
  FakeDaemon daemon(path);
  EXPECT_TRUE(poll_until(client, client.fd(), [&] {
    return daemon.count([](const ipc::Envelope& each) { return each.has_get_status(); }) == 1;
  }));
}

TEST_F(ClientLoop, WhatCameDuringAWaitingCallMakesTheDescriptorReadable) {
  FakeDaemon daemon(path);
  Client client = make_client();
  std::vector<std::string> heard;
  auto subscriber =
      client.channel("hello").subscriber([&](const Message& m) { heard.emplace_back(m.text()); });
  client.process();
  daemon.deliver("early");
  DaemonStatus status;
  ASSERT_TRUE(client.get_status(status));
  EXPECT_TRUE(heard.empty()) << "no callback inside a waiting call";
  pollfd descriptor{client.fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&descriptor, 1, 0), 1);
  client.process();
  EXPECT_EQ(heard, std::vector<std::string>{"early"});
}

TEST_F(ClientLoop, ProcessInsideACallbackIsRefused) {
  FakeDaemon daemon(path);
  Client client = make_client();
  Status nested;
  auto subscriber =
      client.channel("hello").subscriber([&](const Message&) { nested = client.process(); });
  daemon.deliver("x");
  ASSERT_TRUE(run_until(client, [&] { return !nested; }));
  EXPECT_EQ(nested.code(), StatusCode::kBadArgument);
}

TEST_F(ClientLoop, StopEndsRunFromACallback) {
  FakeDaemon daemon(path);
  Client client = make_client();
  auto subscriber = client.channel("hello").subscriber([&](const Message&) { client.stop(); });
  daemon.deliver("x");
  client.run();
  SUCCEED();
}

Client* signalled_client = nullptr;

TEST_F(ClientLoop, StopEndsRunFromASignalHandler) {
  FakeDaemon daemon(path);
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  signalled_client = &client;
  std::signal(SIGUSR1, [](int) { signalled_client->stop(); });
  const auto thread = ::pthread_self();
  std::thread sender([thread] { ::pthread_kill(thread, SIGUSR1); });
  client.run();
  sender.join();
  std::signal(SIGUSR1, SIG_DFL);
}

TEST_F(ClientLoop, StopBeforeRunIsNotLost) {
  FakeDaemon daemon(path);
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  client.stop();
  client.run();
  SUCCEED();
}

TEST_F(ClientLoop, ACallbackMayThrowAndTheRestComesLater) {
  FakeDaemon daemon(path);
  Client client = make_client();
  std::vector<std::string> heard;
  auto subscriber = client.channel("hello").subscriber([&](const Message& m) {
    heard.emplace_back(m.text());
    if (m.text() == "bad") throw std::runtime_error("bad");
  });
  daemon.deliver("bad");
  daemon.deliver("good");
  EXPECT_THROW(client.run_for(kPatience), std::runtime_error);
  EXPECT_TRUE(run_until(client, [&] { return heard.size() == 2; }));
}

TEST_F(ClientLoop, RunForInsideACallbackIsToldToOnErrorToo) {
  FakeDaemon daemon(path);
  Client client = make_client();
  Status answer;
  auto subscriber = client.channel("hello").subscriber(
      [&](const Message&) { answer = client.run_for(kPatience); });
  daemon.deliver("x");
  ASSERT_TRUE(run_until(client, [&] { return !errors.empty(); }));
  EXPECT_EQ(answer.code(), StatusCode::kBadArgument);
  EXPECT_NE(errors[0].text().find("inside a callback"), std::string_view::npos);
}

TEST_F(ClientLoop, AnOnErrorThatRunsTheClientDoesNotKeepItForEver) {
  FakeDaemon daemon(path);
  Client client = make_client();
  int told = 0;
  client.on_error([&](const Status&) {
    ++told;
    EXPECT_FALSE(client.run_for(std::chrono::milliseconds(1)));
  });
  ASSERT_TRUE(client.connect());
  EXPECT_FALSE(client.set_pose(1e9f, 0, 0));
  client.process();
  EXPECT_GE(told, 1);
  EXPECT_LE(told, 3) << "of what it did itself, the next time";
}

TEST_F(ClientLoop, TheDefaultOnErrorTellsACauseOnceASecond) {
  FakeDaemon daemon(path);
  std::optional<Client> plain(std::in_place, "plain", options());
  ASSERT_TRUE(plain->connect());
  testing::internal::CaptureStderr();
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(plain->set_pose(1e9f, 0, 0));
  plain->process();
  const std::string told = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 1) << told;
  testing::internal::CaptureStderr();
  plain.reset();
  const std::string rest = testing::internal::GetCapturedStderr();
  EXPECT_NE(rest.find(" (4 times since the last line)\n"), std::string::npos) << rest;
}

TEST_F(ClientLoop, AWaitingCallbackMayHoldAHandleWhenTheClientIsDestroyed) {
  FakeDaemon daemon(path);
  {
    Client client = make_client();
    auto pong = std::make_shared<Publisher>(client.channel("pong").publisher());
    std::optional<Subscriber> ping =
        client.channel("ping").subscriber([pong](const Message&) { FAIL(); });
    client.process();
    pong.reset();
    daemon.deliver("x");
    DaemonStatus status;
    ASSERT_TRUE(client.get_status(status)) << "the message waits for process()";
    ping.reset();
  }
  SUCCEED() << "and it did not wait for itself";
}

TEST_F(ClientLoop, AProgramThatNeverRunsItsCallbacksIsTold) {
  FakeDaemon daemon(path);
  testing::internal::CaptureStderr();
  {
    Client plain("plain", options());
    auto subscriber = plain.channel("quiet").subscriber([](const Message&) {});
  }
  EXPECT_NE(testing::internal::GetCapturedStderr().find(
                "channel quiet was subscribed to and nothing was heard: keep what subscribe() "
                "returns, and call run() or process(): callbacks run only inside those"),
            std::string::npos);
}

TEST_F(ClientLoop, RunForEndsInTime) {
  FakeDaemon daemon(path);
  Client client = make_client();
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(client.run_for(std::chrono::milliseconds(20)));
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(20));
}

}  // namespace
}  // namespace swarmtalk::test
