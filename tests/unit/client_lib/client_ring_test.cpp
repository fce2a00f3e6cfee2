// A client whose daemon offers a ring in shared memory for what the client writes.
#include <poll.h>

#include "tests/unit/client_lib/armed_timer.hpp"
#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

constexpr std::size_t kRing = ipc::kRingLeastBytes;

class ClientRing : public ClientTest {
 protected:
  ClientRing() : daemon(path) {
    daemon.ring_bytes = kRing;
    daemon.max_message_bytes = 16384;
  }
  FakeDaemon daemon;
};

TEST_F(ClientRing, CarriesEverythingThatTheClientSays) {
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  int heard = 0;
  int sent = 0;
  auto subscriber = client.channel("hello").subscriber([&](const Message&) { ++heard; });
  auto publisher = client.channel("hello").publisher([&](const Status&) { ++sent; });
  EXPECT_TRUE(publisher.send("x"));
  EXPECT_TRUE(client.set_pose(1, 2, 3));
  daemon.deliver("y");
  EXPECT_TRUE(run_until(client, [&] { return heard == 1 && sent == 1; }));
  EXPECT_TRUE(client.sync());
  EXPECT_EQ(daemon.count(is_publish), 1);
  EXPECT_TRUE(errors.empty() && losses.empty());
}

TEST_F(ClientRing, ADaemonAtWorkIsNotRung) {
  daemon.answers_publish = false;
  Client client = make_client();
  auto publisher = client.channel("hello").publisher({}, Sending::queued(200));
  daemon.read_rings(true);
  const int reads = daemon.reads();
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(publisher.send("x"));
  EXPECT_EQ(daemon.reads(), reads);
  EXPECT_EQ(daemon.count(is_publish), 0);
  daemon.read_rings();
  EXPECT_EQ(daemon.count(is_publish), 50);
}

TEST_F(ClientRing, WhatDoesNotFitWaitsAndGoesWhenThereIsRoom) {
  Client client = make_client();
  int sent = 0;
  auto publisher = client.channel("hello").publisher(
      [&](const Status& status) { sent += status.ok() ? 1 : 0; }, Sending::queued(100));
  daemon.set_reads_ring(false);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(publisher.send(std::string(1000, 'x')));
  client.run_for(std::chrono::milliseconds(20));
  EXPECT_EQ(sent, 0);
  daemon.set_reads_ring(true);
  daemon.read_rings();  // tells that there is room: nothing else wakes the client
  EXPECT_TRUE(run_until(client, [&] { return sent == 100; })) << sent;
  EXPECT_EQ(daemon.count(is_publish), 100);
  EXPECT_TRUE(errors.empty() && losses.empty());
}

TEST_F(ClientRing, AClientWithAFullRingSleeps) {
  daemon.answers_publish = false;
  Client client = make_client();
  auto publisher = client.channel("hello").publisher({}, Sending::queued(100));
  daemon.set_reads_ring(false);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(publisher.send(std::string(1000, 'x')));
  for (int i = 0; i < 5; ++i) client.process();
  pollfd wakes{client.fd(), POLLIN, 0};
  EXPECT_EQ(::poll(&wakes, 1, 0), 0) << "it must not ask again and again whether there is room";
  EXPECT_EQ(left_on_the_timer(), std::chrono::nanoseconds(0));
  daemon.kill();  // else the publisher waits at its end
}

TEST_F(ClientRing, ADaemonThatDiedAtWorkIsNoticedByAProgramThatOnlySends) {
  Client client = make_client();
  auto publisher = client.channel("hello").publisher({}, Sending::newest(1));
  daemon.read_rings(true);  // it will never say that it sleeps
  daemon.kill();
  int accepted = 0;
  while (accepted < 1000 && publisher.send("x")) ++accepted;
  EXPECT_LT(accepted, 64);
  client.process();
  EXPECT_EQ(losses.size(), 1u);
}

TEST_F(ClientRing, AMemoryThatCannotBeMappedIsDoneWithout) {
  daemon.spoils_ring = true;
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  auto publisher = client.channel("hello").publisher();
  EXPECT_TRUE(publisher.send("x"));
  EXPECT_TRUE(client.sync());
  EXPECT_EQ(daemon.count(is_publish), 1);
}

TEST_F(ClientRing, IsANewOneAfterEachReconnect) {
  Client client = make_client();
  int sent = 0;
  auto publisher =
      client.channel("hello").publisher([&](const Status& status) { sent += status.ok() ? 1 : 0; });
  for (int i = 1; i <= 3; ++i) {
    EXPECT_TRUE(publisher.send("x"));
    EXPECT_TRUE(run_until(client, [&] { return sent == i; }));
    daemon.kill();
    client.process();
    daemon.restart();
    ASSERT_TRUE(run_until(client, [&] { return reconnects == i; }));
  }
  EXPECT_EQ(daemon.count(is_publish), 3);
}

}  // namespace
}  // namespace swarmtalk::test
