// Several sends in a row: they wait, or whoever sends is told.
#include <poll.h>

#include <algorithm>
#include <thread>

#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

class ClientSending : public ClientTest {
 protected:
  ClientSending() : daemon(path), client(make_client()) { EXPECT_TRUE(client.connect()); }

  /// What `action` writes to stderr.
  template <typename Action>
  static std::string stderr_of(Action action) {
    testing::internal::CaptureStderr();
    action();
    return testing::internal::GetCapturedStderr();
  }

  /// A client as a program has it that replaces no callback.
  Client plain_client() {
    Client plain("plain", {.socket_path = path});
    EXPECT_TRUE(plain.connect());
    return plain;
  }

  /// Messages that clients refused themselves, as the daemon was told.
  std::uint32_t refused() {
    std::uint32_t sum = 0;
    for (const ipc::Envelope& each : daemon.received()) sum += each.client_loss().refused();
    return sum;
  }

  FakeDaemon daemon;
  Client client;
};

TEST_F(ClientSending, TwoSendsInARowBothLeave) {
  auto publisher = client.channel("hello").publisher();
  EXPECT_TRUE(publisher.send("position"));
  EXPECT_TRUE(publisher.send("battery"));
  EXPECT_TRUE(client.sync());
  EXPECT_EQ(daemon.count(is_publish), 2);
}

TEST_F(ClientSending, OneAtATimeAsksForNoQueue) {
  auto waits = client.channel("hello").publisher();
  auto waits_not = client.advertise("hello", Sending::one_at_a_time().repeated(2));
  const auto queue_of = [](const ipc::Envelope& envelope, std::uint32_t queue) {
    return envelope.has_advertise() && envelope.advertise().queue() == queue;
  };
  EXPECT_EQ(daemon.count([&](const auto& each) { return queue_of(each, 16); }), 1);
  EXPECT_EQ(daemon.count([&](const auto& each) { return queue_of(each, 0); }), 1);
}

TEST_F(ClientSending, ARefusalThatNobodyLooksAtIsToldOnceASecond) {
  daemon.answers_publish = false;
  Client plain = plain_client();
  auto publisher = plain.advertise("hello", Sending::one_at_a_time());
  const std::string told = stderr_of([&] {
    for (int i = 0; i < 1000; ++i) static_cast<void>(publisher.send("x"));
  });
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 1) << told;
  for (const char* words :
       {"swarmtalk: channel hello: a message was not sent",
        "nobody looked at what send() returned: 1 message is not confirmed yet",
        "call run() or process() between sends", "longer queue", "drops the oldest"}) {
    EXPECT_NE(told.find(words), std::string::npos) << words << " is not in: " << told;
  }
}

TEST_F(ClientSending, ARefusalThatIsLookedAtIsNotTold) {
  daemon.answers_publish = false;
  Client plain = plain_client();
  auto publisher = plain.advertise("hello", Sending::one_at_a_time());
  EXPECT_TRUE(publisher.send("x"));
  const auto by_bool = [&] { return publisher.send("x") ? 1 : 0; };
  const auto by_code = [&] { return publisher.send("x").code() == StatusCode::kBusy ? 1 : 0; };
  const auto by_text = [&] { return publisher.send("x").text().empty() ? 1 : 0; };
  const auto by_copy = [&] {
    const Status original = publisher.send("x");
    const Status copy = original;
    return copy.ok() ? 1 : 0;
  };
  int looks = 0;
  EXPECT_EQ(stderr_of([&] { looks = by_bool() + by_code() + by_text() + by_copy(); }), "");
  EXPECT_EQ(looks, 1) << "all four were refused, and one asks for the refusal";
}

TEST_F(ClientSending, AnOnErrorOfTheProgramsOwnIsToldInsteadOfStderr) {
  daemon.answers_publish = false;
  auto publisher = client.advertise("hello", Sending::one_at_a_time());
  EXPECT_EQ(stderr_of([&] {
              for (int i = 0; i < 3; ++i) static_cast<void>(publisher.send("x"));
            }),
            "");
  ASSERT_TRUE(run_until(client, [&] { return !errors.empty(); }));
  EXPECT_EQ(errors[0].code(), StatusCode::kBusy);
}

TEST_F(ClientSending, TheDaemonLearnsHowManyMessagesWereRefusedHere) {
  daemon.answers_publish = false;
  {
    auto publisher = client.advertise("hello", Sending::one_at_a_time());
    EXPECT_TRUE(publisher.send("x"));
    EXPECT_FALSE(publisher.send("x")) << "is told at once: this program may never run";
    EXPECT_TRUE(run_until(client, [&] { return refused() == 1; }));
    for (int i = 0; i < 10; ++i) EXPECT_FALSE(publisher.send("x"));
    EXPECT_TRUE(run_until(client, [&] { return refused() == 11; }));
    for (int i = 0; i < 5; ++i) EXPECT_FALSE(publisher.send("x"));
  }
  EXPECT_TRUE(run_until(client, [&] { return refused() == 16; })) << "at the publisher's end";
}

TEST_F(ClientSending, TheDaemonLearnsAtTheClientsEndWhatWasRefusedLast) {
  daemon.answers_publish = false;
  std::optional<Client> ending = plain_client();
  auto publisher = ending->advertise("hello", Sending::one_at_a_time());
  EXPECT_TRUE(publisher.send("x"));
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(publisher.send("x"));
  ending.reset();
  EXPECT_EQ(refused(), 5u);
}

TEST_F(ClientSending, WhatAProgramThatNeverRunsDidWrongIsToldAtItsEnd) {
  std::optional<Client> plain = plain_client();
  const std::string told = stderr_of([&] {
    auto publisher = plain->advertise("hello");
    EXPECT_EQ(publisher.send(std::string(1000, 'x')).code(), StatusCode::kTooLong);
    plain.reset();
  });
  EXPECT_EQ(told, "swarmtalk: the message has 1000 bytes; channel hello carries at most 100\n");
}

TEST_F(ClientSending, ADaemonThatDiesBeforeAProgramEndsIsToldWhicheverCallMeetsIt) {
  std::optional<Client> plain = plain_client();
  const std::string told = stderr_of([&] {
    {
      auto publisher = plain->advertise("hello");
      EXPECT_TRUE(publisher.send("x"));
      daemon.kill();
    }
    plain.reset();
  });
  EXPECT_EQ(told,
            "swarmtalk: swarmtalkd was gone when this program ended: whether its last messages "
            "left is not known\n");
}

TEST_F(ClientSending, AProgramThatOnlySendsFindsRoomWithoutRunning) {
  auto state = client.advertise("hello", Sending::newest(1));
  auto queued = client.advertise("hello", Sending::queued(3));
  for (int i = 0; i < 3000; ++i) {
    ASSERT_TRUE(state.send("x"));
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (queued.busy() && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
    ASSERT_TRUE(queued.send("x"));
  }
  EXPECT_TRUE(losses.empty());
  EXPECT_TRUE(client.sync());
  EXPECT_EQ(daemon.count(is_publish), 6000);
}

TEST_F(ClientSending, WhatComesWhileSendLooksForRoomWaitsForTheProgramToRun) {
  int heard = 0;
  auto subscriber = client.subscribe("hello", [&](const Message&) { ++heard; });
  auto publisher = client.advertise("hello", Sending::one_at_a_time());
  daemon.answers_publish = false;
  EXPECT_TRUE(publisher.send("x"));
  daemon.deliver("first");
  daemon.answer_publish();
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!publisher.send("y") && std::chrono::steady_clock::now() < deadline) {
  }
  EXPECT_EQ(heard, 0);
  ASSERT_TRUE(run_until(client, [&] { return heard > 0; }));
  EXPECT_EQ(heard, 1);
}

TEST_F(ClientSending, ALookForRoomThatFindsNothingLeavesTheDescriptorQuiet) {
  daemon.answers_publish = false;
  auto publisher = client.advertise("hello", Sending::one_at_a_time());
  const auto is_readable = [&] {
    pollfd own{client.fd(), POLLIN, 0};
    return ::poll(&own, 1, 0) > 0;
  };
  EXPECT_TRUE(publisher.send("x"));
  for (int i = 0; i < 1000 && is_readable(); ++i) EXPECT_TRUE(client.process());
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(publisher.busy());
  EXPECT_FALSE(is_readable());
}

TEST_F(ClientSending, APublisherWithACallbackIsBusyUntilItCanBeCalled) {
  int sent = 0;
  auto publisher = client.advertise("hello", Sending::one_at_a_time(),
                                    [&](const Status& status) { sent += status ? 1 : 0; });
  EXPECT_TRUE(publisher.send("x"));
  daemon.count(is_publish);  // it has answered
  EXPECT_EQ(publisher.send("y").code(), StatusCode::kBusy);
  ASSERT_TRUE(run_until(client, [&] { return sent == 1; }));
  EXPECT_TRUE(publisher.send("y"));
}

TEST_F(ClientSending, AnotherThreadThatSendsLeavesReadingToTheOwner) {
  auto publisher = client.advertise("hello", Sending::one_at_a_time());
  std::thread([&] {
    EXPECT_TRUE(publisher.send("x"));
    daemon.count(is_publish);  // it has answered
    EXPECT_EQ(publisher.send("y").code(), StatusCode::kBusy);
  }).join();
  EXPECT_TRUE(client.sync());
  EXPECT_TRUE(publisher.send("y"));
}

TEST_F(ClientSending, ARefusalMayOutliveItsClientAndItsThread) {
  daemon.answers_publish = false;
  std::optional<Status> kept;
  {
    Client gone = plain_client();
    auto publisher = gone.advertise("hello", Sending::one_at_a_time());
    EXPECT_TRUE(publisher.send("x"));
    std::thread([&] { kept = publisher.send("x"); }).join();
  }
  EXPECT_EQ(stderr_of([&] { kept.reset(); }), "") << "nobody is left whose channel it was";
}

}  // namespace
}  // namespace swarmtalk::test
