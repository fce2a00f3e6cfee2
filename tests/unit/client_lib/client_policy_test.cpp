// What a client's policies leave out of what has left the daemon, and what it tells of losses.
#include <atomic>
#include <thread>

#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

using namespace std::chrono_literals;

class ClientPolicy : public ClientTest {
 protected:
  ClientPolicy() : daemon(path), client(make_client()) { EXPECT_TRUE(client.connect()); }

  void deliver(const std::string& payload, std::uint32_t sender = 1,
               std::chrono::nanoseconds age = 0ns) {
    ipc::Deliver message;
    message.set_payload(payload);
    message.set_sender(sender);
    const auto received_at = std::chrono::steady_clock::now().time_since_epoch() - age;
    message.set_received_at_ns(
        static_cast<std::uint64_t>(std::chrono::nanoseconds(received_at).count()));
    daemon.deliver(message);
  }
  ReceiveCallback remember() {
    return [this](const Message& message) {
      heard.push_back(message);
      text += message.payload;
    };
  }

  FakeDaemon daemon;
  Client client;
  std::vector<Message> heard;
  std::string text;
};

TEST_F(ClientPolicy, LatestHoldsForWhatWaitsInTheSocketToo) {
  auto subscriber = client.subscribe("hello", Policy::latest(), remember());
  for (const char* payload : {"1", "2", "3", "4"}) deliver(payload);
  ASSERT_TRUE(run_until(client, [&] { return !heard.empty(); }));
  EXPECT_EQ(text, "4");
  EXPECT_EQ(heard[0].lost_before.client, 3U);
  const auto is_report = [](const ipc::Envelope& envelope) {
    return envelope.has_client_loss() && envelope.client_loss().messages() == 3;
  };
  EXPECT_TRUE(run_until(client, [&] { return daemon.count(is_report) == 1; }));
}

TEST_F(ClientPolicy, LatestFromEachKeepsOneOfEachSender) {
  auto subscriber = client.subscribe("hello", Policy::latest_from_each(), remember());
  deliver("a1", 1);
  deliver("b1", 2);
  deliver("a2", 1);
  ASSERT_TRUE(run_until(client, [&] { return heard.size() == 2; }));
  EXPECT_EQ(text, "b1a2");
  EXPECT_EQ(heard[0].lost_before.client, 1U);
}

TEST_F(ClientPolicy, WhatHasGrownTooOldInTheSocketIsDroppedAndTold) {
  auto subscriber = client.subscribe("hello", Policy().no_older_than(1000ms), remember());
  deliver("old", 1, 3s);
  deliver("young");
  ASSERT_TRUE(run_until(client, [&] { return !heard.empty(); }));
  EXPECT_EQ(text, "young");
  EXPECT_EQ(heard[0].lost_before.client, 1U);
}

TEST_F(ClientPolicy, TheWholePolicyIsAskedOfTheDaemon) {
  auto subscriber = client.subscribe(
      "hello", Policy::last(7).within(1.5F).known_distance_only().no_older_than(250ms).looking_on(),
      [](const Message&) {});
  const auto is_it = [](const ipc::Envelope& envelope) {
    const ipc::Subscribe& asked = envelope.subscribe();
    return asked.keep_last() == 7 && asked.max_distance_m() == 1.5F && asked.looks_on() &&
           asked.drop_unknown_distance() && asked.max_age_ms() == 250 && !asked.latest_of_each();
  };
  EXPECT_EQ(daemon.count(is_it), 1);
}

TEST_F(ClientPolicy, AGapIsToldBeforeItsMessage) {
  std::string order;
  client.on_gap([&](const Message& message) {
    order += "gap of " + std::to_string(message.lost_before.total()) + " ";
  });
  auto subscriber =
      client.subscribe("hello", [&](const Message& message) { order += message.payload + " "; });
  deliver("a");
  ipc::Deliver after;
  after.set_payload("b");
  after.mutable_lost_before()->set_air(2);
  after.mutable_lost_before()->set_kernel(1);
  daemon.deliver(after);
  ASSERT_TRUE(run_until(client, [&] { return order.find('b') != std::string::npos; }));
  EXPECT_EQ(order, "a gap of 3 b ");
}

TEST_F(ClientPolicy, TheDelayGoesOnUntilTheCallback) {
  auto subscriber = client.subscribe("hello", remember());
  ipc::Deliver message;
  message.set_buffering_delay_us(1000);
  const auto received_at = std::chrono::steady_clock::now().time_since_epoch() - 2s;
  message.set_received_at_ns(
      static_cast<std::uint64_t>(std::chrono::nanoseconds(received_at).count()));
  daemon.deliver(message);
  ASSERT_TRUE(run_until(client, [&] { return !heard.empty(); }));
  EXPECT_GE(*heard[0].buffering_delay, 2001ms);
  EXPECT_LT(*heard[0].buffering_delay, 7s);
}

TEST_F(ClientPolicy, APublisherWithAQueueIsBusyWhenItIsFull) {
  daemon.answers_publish = false;
  auto publisher = client.advertise("hello", Sending::queued(2));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(publisher.send("x"));
  EXPECT_TRUE(publisher.busy());
  EXPECT_EQ(publisher.send("x").code(), StatusCode::kBusy);
}

TEST_F(ClientPolicy, AQueueWithoutACallbackIsToldOfSeveralMessagesAtOnce) {
  daemon.answers_publish = false;
  auto publisher = client.advertise("hello", Sending::queued(15));
  const auto asks_for = [](std::uint32_t sent_every) {
    return [=](const ipc::Envelope& envelope) {
      return envelope.has_advertise() && envelope.advertise().sent_every() == sent_every;
    };
  };
  EXPECT_EQ(daemon.count(asks_for(4)), 1);
  for (int i = 0; i < 16; ++i) EXPECT_TRUE(publisher.send("x"));
  EXPECT_TRUE(publisher.busy());
  const auto all_came = [&] {
    return daemon.count([](const ipc::Envelope& envelope) { return envelope.has_publish(); }) == 16;
  };
  ASSERT_TRUE(run_until(client, all_came));
  daemon.answer_publish();  // one answer for the last, and so for all
  ASSERT_TRUE(run_until(client, [&] { return !publisher.busy(); }));
  for (int i = 0; i < 16; ++i) EXPECT_TRUE(publisher.send("x"));
  EXPECT_TRUE(publisher.busy());
  auto told = client.advertise("told", Sending::queued(15), [](const Status&) {});
  EXPECT_EQ(daemon.count(asks_for(0)), 1) << "who wants to know of each is told of each";
}

TEST_F(ClientPolicy, APublisherOfTheNewestIsNeverBusyWhileTheDaemonReads) {
  daemon.answers_publish = false;
  auto publisher = client.advertise("hello", Sending::newest(1).repeated(3, 5ms));
  for (int i = 0; i < 50; ++i) EXPECT_TRUE(publisher.send("x"));
  const auto is_it = [](const ipc::Envelope& envelope) {
    const ipc::Advertise& asked = envelope.advertise();
    return asked.queue() == 1 && asked.drop_oldest() && asked.copies() == 3 &&
           asked.copy_interval_ms() == 5;
  };
  EXPECT_EQ(daemon.count(is_it), 1);
}

TEST_F(ClientPolicy, APublisherAsksForRedundancy) {
  const auto three = client.advertise("hello", Sending::queued(4).redundant(3));
  const auto automatic = client.advertise("auto", Sending::queued(4).redundant());
  const auto none = client.advertise("none", Sending::queued(4));
  const auto count = [&](std::uint32_t repairs, bool is_auto) {
    return daemon.count([&](const ipc::Envelope& envelope) {
      const ipc::Advertise& asked = envelope.advertise();
      return envelope.has_advertise() && asked.redundancy() == repairs &&
             asked.auto_redundancy() == is_auto;
    });
  };
  EXPECT_EQ(count(3, false), 1);
  EXPECT_EQ(count(0, true), 1);
  EXPECT_EQ(count(0, false), 1);
  EXPECT_FALSE(three.has_redundancy()) << "an older daemon does not say so";
}

TEST_F(ClientPolicy, AnyThreadMaySend) {
  constexpr int kThreads = 4;
  constexpr int kMessages = 200;
  std::atomic<int> accepted{0};
  std::atomic<int> ended{0};
  std::vector<Publisher> publishers;
  for (int i = 0; i < kThreads; ++i) {
    publishers.push_back(client.channel(i).publisher([&](const Status&) { ++ended; }));
  }
  std::atomic<bool> is_over{false};
  std::vector<std::thread> threads;
  for (Publisher& publisher : publishers) {
    threads.emplace_back([&] {
      for (int i = 0; i < kMessages && !is_over;) {
        const Status status = publisher.send(std::string(50, 'x'));
        if (status) {
          ++accepted;
          ++i;
        } else {
          EXPECT_EQ(status.code(), StatusCode::kBusy);
          std::this_thread::yield();
        }
      }
    });
  }
  run_until(client, [&] { return ended == kThreads * kMessages; });
  is_over = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(ended, kThreads * kMessages);
  EXPECT_EQ(accepted, kThreads * kMessages);
  const auto is_publish = [](const ipc::Envelope& envelope) {
    return envelope.has_publish() && envelope.publish().payload().size() == 50;
  };
  EXPECT_EQ(daemon.count(is_publish), kThreads * kMessages);
}

TEST_F(ClientPolicy, AThreadThatSendsWhileTheDaemonDiesIsToldAndNothingIsLostUnsaid) {
  std::atomic<int> accepted{0};
  std::atomic<int> ended{0};
  auto publisher = client.channel(1).publisher([&](const Status&) { ++ended; });
  std::atomic<bool> is_over{false};
  std::thread thread([&] {
    while (!is_over) {
      if (publisher.send("x")) ++accepted;
      std::this_thread::yield();
    }
  });
  run_until(client, [&] { return ended > 20; });
  daemon.kill();
  EXPECT_TRUE(run_until(client, [&] { return !losses.empty(); }));
  daemon.restart();
  EXPECT_TRUE(run_until(client, [&] { return reconnects == 1; }));
  const int before = ended;
  run_until(client, [&] { return ended > before + 20; });
  is_over = true;
  thread.join();
  EXPECT_TRUE(run_until(client, [&] { return ended == accepted; }));
}

}  // namespace
}  // namespace swarmtalk::test
