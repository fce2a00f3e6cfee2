#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

using ClientReconnect = ClientTest;

TEST_F(ClientReconnect, LossIsToldAtOnce) {
  FakeDaemon daemon(path);
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  daemon.kill();
  client.process();
  ASSERT_EQ(losses.size(), 1u);
  EXPECT_EQ(losses[0].code(), StatusCode::kDisconnected);
  EXPECT_EQ(client.process().code(), StatusCode::kDisconnected);
  EXPECT_FALSE(client.is_connected());
}

TEST_F(ClientReconnect, LossSeenBySendIsToldByItsStatusAndByTheNextProcess) {
  FakeDaemon daemon(path);
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  auto publisher = client.channel("hello").publisher();
  daemon.kill();
  EXPECT_EQ(publisher.send("x").code(), StatusCode::kDisconnected);
  EXPECT_TRUE(losses.empty()) << "no callback outside process()";
  EXPECT_FALSE(publisher.busy());
  client.process();
  EXPECT_EQ(losses.size(), 1u);
}

TEST_F(ClientReconnect, WhatTheDaemonSaidBeforeItClosedIsReadFirst) {
  FakeDaemon daemon(path);
  Client client = make_client();
  int heard = 0;
  auto subscriber = client.channel("hello").subscriber([&](const Message&) { ++heard; });
  auto publisher = client.channel("hello").publisher();
  daemon.deliver("last words");
  ipc::Envelope farewell;
  farewell.mutable_failure()->set_code(ipc::ERROR_LIMIT);
  farewell.mutable_failure()->set_text("it does not read");
  std::string bytes;
  ipc::append_frame(farewell, bytes);
  daemon.send_raw(bytes);
  daemon.kill();
  EXPECT_EQ(publisher.send("x").code(), StatusCode::kDisconnected);
  EXPECT_EQ(heard, 0) << "no callback outside process()";
  client.process();
  EXPECT_EQ(heard, 1);
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].text(), "it does not read");
  EXPECT_EQ(losses.size(), 1u);
}

// How soon, client_backoff_test.cpp has.
TEST_F(ClientReconnect, IsBackAndRegisteredEachTimeTheDaemonIs) {
  FakeDaemon daemon(path);
  Client client = make_client();
  int heard = 0;
  auto channel = client.channel("hello");
  auto subscriber = channel.subscriber([&](const Message&) { ++heard; });
  auto publisher = channel.publisher();
  for (int round = 1; round <= 3; ++round) {
    daemon.kill();
    const auto lost = static_cast<std::size_t>(round);
    ASSERT_TRUE(run_until(client, [&] { return losses.size() == lost; }));
    EXPECT_FALSE(client.is_connected());
    daemon.restart();
    ASSERT_TRUE(run_until(client, [&] { return reconnects == round; }));
    EXPECT_TRUE(publisher.send("x"));
    daemon.deliver("again");
    ASSERT_TRUE(run_until(client, [&] { return heard == round; }));
  }
  EXPECT_EQ(losses.size(), 3u);
  EXPECT_TRUE(errors.empty()) << errors[0].text();
}

TEST_F(ClientReconnect, AMessageInFlightEndsAsDisconnected) {
  FakeDaemon daemon(path);
  daemon.answers_publish = false;
  Client client = make_client();
  std::vector<StatusCode> order;
  client.on_disconnect([&](const Status&) { order.push_back(StatusCode::kSystem); });
  auto publisher = client.channel("hello").publisher(
      [&](const Status& status) { order.push_back(status.code()); });
  ASSERT_TRUE(publisher.send("x"));
  daemon.kill();
  client.process();
  EXPECT_EQ(order, (std::vector<StatusCode>{StatusCode::kSystem, StatusCode::kDisconnected}));
  EXPECT_FALSE(publisher.busy());
}

TEST_F(ClientReconnect, AWaitingCallEndsWhenTheDaemonDies) {
  FakeDaemon daemon(path);
  daemon.answers_requests = false;
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  std::thread killer([&] {
    while (daemon.count([](const auto& e) { return e.has_get_status(); }) == 0) {
      std::this_thread::yield();
    }
    daemon.kill();
  });
  DaemonStatus status;
  EXPECT_EQ(client.get_status(status).code(), StatusCode::kDisconnected);
  killer.join();
}

TEST_F(ClientReconnect, MessagesReadBeforeTheLossAreDelivered) {
  FakeDaemon daemon(path);
  Client client = make_client();
  std::vector<std::string> heard;
  auto subscriber =
      client.channel("hello").subscriber([&](const Message& m) { heard.emplace_back(m.text()); });
  daemon.deliver("last words");
  daemon.kill();
  ASSERT_TRUE(run_until(client, [&] { return losses.size() == 1; }));
  EXPECT_EQ(heard, std::vector<std::string>{"last words"});
}

TEST_F(ClientReconnect, HandleDestroyedWhileTheDaemonIsAwayIsNotRegisteredAgain) {
  FakeDaemon daemon(path);
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  {
    auto subscriber = client.channel("hello").subscriber([](const Message&) {});
    daemon.kill();
    client.process();
  }
  daemon.restart();
  ASSERT_TRUE(run_until(client, [&] { return reconnects == 1; }));
  EXPECT_EQ(daemon.count([](const auto& e) { return e.has_subscribe(); }), 1);
}

}  // namespace
}  // namespace swarmtalk::test
