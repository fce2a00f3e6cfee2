// The end of a program, and the child of one: other processes, with the daemon in this one.
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <thread>
#include <utility>

#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

bool is_publication(const ipc::Envelope& envelope) {
  return envelope.has_publish();
}

class ClientEnd : public ClientTest {
 protected:
  static pid_t fork_quietly() {
    std::fflush(nullptr);  // or both would write it
    return ::fork();
  }
  /// Runs it in a child, whose exit code it is. @return that of the child
  static int in_child(const std::function<int()>& program) {
    const pid_t child = fork_quietly();
    if (child == 0) ::_exit(program());
    return exit_code(child);
  }
  /// One that waits for begin(). It is made before the daemon: to a checker of leaks what a thread
  /// of its parent held would be lost in it.
  pid_t program_that_exits(const std::function<void()>& program) {
    EXPECT_EQ(::pipe(start_), 0);
    const pid_t child = fork_quietly();
    if (child != 0) return child;
    ::close(start_[1]);
    char begun = 0;
    if (::read(start_[0], &begun, 1) != 1) ::_exit(5);
    program();
    std::exit(0);
  }
  void begin() const {
    EXPECT_EQ(::write(start_[1], "", 1), 1);
    for (const int end : start_) ::close(end);
  }
  /// How many have come, when there are so many, or after kPatience.
  static int publications(FakeDaemon& daemon, int enough) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (daemon.count(is_publication) < enough && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::yield();
    }
    return daemon.count(is_publication);
  }
  static int exit_code(pid_t child) {
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + status;
  }
  /// It waits for something, or it has ended; at most kPatience.
  static void wait_until_still(pid_t process) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < deadline) {
      std::ifstream stream("/proc/" + std::to_string(process) + "/stat");
      const std::string stat((std::istreambuf_iterator<char>(stream)), {});
      const auto name_end = stat.rfind(')');
      if (name_end == std::string::npos) return;
      if (stat[name_end + 2] == 'S' || stat[name_end + 2] == 'Z') return;
    }
  }

 private:
  int start_[2] = {-1, -1};
};

TEST_F(ClientEnd, ExitWritesWhatTheSocketDidNotTake) {
  constexpr int kCount = 60;
  constexpr std::size_t kBytes = 16000;  // with the others more than any socket holds
  const pid_t child = program_that_exits([this] {
    static auto* const client = new Client("test", options());
    static auto* const publisher = new Publisher(client->advertise("a", Sending::queued(200)));
    for (int i = 0; i < kCount; ++i) {
      if (!publisher->send(std::string(kBytes, 'x'))) std::exit(2);
    }
  });
  FakeDaemon daemon(path);
  daemon.max_message_bytes = kBytes;
  daemon.says = [&, is_first = true](const ipc::Envelope& request) mutable {
    if (request.has_publish() && std::exchange(is_first, false)) wait_until_still(child);
    return std::vector<ipc::Envelope>();
  };
  begin();
  EXPECT_EQ(exit_code(child), 0);
  EXPECT_EQ(publications(daemon, kCount), kCount);
}

TEST_F(ClientEnd, ExitInACallbackWritesWhatTheCallbackSent) {
  const pid_t child = program_that_exits([this] {
    Client client = make_client();
    Publisher publisher = client.advertise("a");
    Publisher first = client.advertise("b", {}, [&](const Status&) {
      const bool is_taken = publisher.send("last").ok();
      std::exit(is_taken ? 0 : 2);
    });
    if (!first.send("now")) std::exit(3);
    client.run_for(kPatience);
    std::exit(4);
  });
  FakeDaemon daemon(path);
  begin();
  EXPECT_EQ(exit_code(child), 0);
  EXPECT_EQ(publications(daemon, 2), 2);
}

TEST_F(ClientEnd, AChildOfAForkCallsNothingAndDisturbsNothing) {
  FakeDaemon daemon(path);
  int heard = 0;
  {
    Client client = make_client();
    Publisher publisher = client.advertise("a");
    auto subscriber = std::make_unique<Subscriber>(
        client.channel("b").subscriber([&](const Message&) { ++heard; }));
    client.process();
    const auto before = daemon.received().size();
    EXPECT_EQ(in_child([&] {
                std::optional<Pose> pose;
                const Status answers[] = {publisher.send("x"),       client.process(),
                                          client.run_for(kPatience), client.get_pose(pose),
                                          client.set_pose(1, 2, 3),  client.log("x"),
                                          publisher.status()};
                for (const Status& answer : answers) {
                  if (answer.code() != StatusCode::kBadArgument) return 2;
                  if (answer.text().find("after the fork") == std::string_view::npos) return 3;
                }
                if (publisher.busy()) return 4;
                client.stop();
                subscriber.reset();
                Client last = std::move(client);  // destroyed here
                return 0;
              }),
              0);
    EXPECT_EQ(daemon.received().size(), before);
    daemon.deliver("hi");
    EXPECT_TRUE(run_until(client, [&] { return heard > 0; }));
    EXPECT_TRUE(publisher.send("mine"));
    EXPECT_TRUE(losses.empty() && errors.empty());
  }
  EXPECT_EQ(daemon.count(is_publication), 1);
}

}  // namespace
}  // namespace swarmtalk::test
