// One thread owns a Client: a second one that comes in is told, whatever the first is doing.
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <iterator>
#include <thread>

#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

using ClientThreads = ClientTest;

/// Waits, at most kPatience, until `thread` of this process sleeps in the kernel. proc(5)
bool sleeps(pid_t thread) {
  const std::string file = "/proc/self/task/" + std::to_string(thread) + "/stat";
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < deadline) {
    std::ifstream stream(file);
    const std::string stat((std::istreambuf_iterator<char>(stream)), {});
    const auto name_end = stat.rfind(')');
    if (name_end != std::string::npos && stat.substr(name_end + 2, 1) == "S") return true;
    std::this_thread::yield();
  }
  return false;
}

TEST_F(ClientThreads, ASecondOneIsRefusedWhileTheFirstRunsACallback) {
  FakeDaemon daemon(path);
  Client client = make_client();
  Status answer;
  auto subscriber = client.channel("hello").subscriber(
      [&](const Message&) { std::thread([&] { answer = client.process(); }).join(); });
  daemon.deliver("x");
  ASSERT_TRUE(run_until(client, [&] { return !errors.empty(); }));
  EXPECT_EQ(answer.code(), StatusCode::kBadArgument);
  EXPECT_NE(errors[0].text().find("another thread"), std::string_view::npos);
}

TEST_F(ClientThreads, ASecondOneIsRefusedWhileTheFirstWaitsInRun) {
  FakeDaemon daemon(path);
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  client.process();
  std::atomic<pid_t> owner{0};
  std::thread thread([&] {
    owner = ::gettid();
    client.run();
  });
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (owner == 0 && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  EXPECT_TRUE(sleeps(owner));
  DaemonStatus status;
  const Status processed = client.process();
  const Status ran = client.run_for(std::chrono::seconds(5));
  const Status asked = client.get_status(status);
  const Status made = client.channel("hello").publisher().status();
  client.stop();
  thread.join();
  for (const Status& answer : {processed, ran, asked, made}) {
    EXPECT_EQ(answer.code(), StatusCode::kBadArgument);
    EXPECT_NE(answer.text().find("another thread is inside"), std::string_view::npos);
  }
  client.process();
  EXPECT_GE(errors.size(), 4u) << "and the program is told";
}

TEST_F(ClientThreads, ThatPollAndProcessInTurnAreToldOnce) {
  FakeDaemon daemon(path);
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  EXPECT_TRUE(client.process());
  std::thread([&] { EXPECT_TRUE(client.process()); }).join();
  EXPECT_TRUE(errors.empty()) << "a Client may be handed over";
  EXPECT_TRUE(client.process()) << "what is asked for is done";
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].text().find("by two threads in turn"), std::string_view::npos);
  std::thread([&] { EXPECT_TRUE(client.process()); }).join();
  EXPECT_TRUE(client.process());
  EXPECT_EQ(errors.size(), 1u);
}

TEST_F(ClientThreads, OneThatIsGivenTheClientOwnsIt) {
  FakeDaemon daemon(path);
  Client client = make_client();
  ASSERT_TRUE(client.connect());
  int heard = 0;
  auto subscriber = client.channel("hello").subscriber([&](const Message&) {
    ++heard;
    client.stop();
  });
  std::thread thread([&] { EXPECT_TRUE(client.run()); });
  daemon.deliver("x");
  thread.join();
  EXPECT_EQ(heard, 1);
  DaemonStatus status;
  EXPECT_TRUE(client.get_status(status));
  client.process();
  EXPECT_TRUE(errors.empty());
}

}  // namespace
}  // namespace swarmtalk::test
