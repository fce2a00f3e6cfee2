#include "loop/loop.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <chrono>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "loop/asio_poll.hpp"
#include "tests/support/patience.hpp"

namespace swarmtalk::loop {
namespace {

using namespace std::chrono_literals;

struct Pair {
  Pair() {
    std::array<int, 2> ends{};
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends.data()), 0);
    ours = ends[0];
    theirs = ends[1];
  }
  ~Pair() {
    if (theirs >= 0) ::close(theirs);
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;
  void write(const std::string& text) const {
    EXPECT_EQ(send(theirs, text.data(), text.size(), 0), static_cast<ssize_t>(text.size()));
  }

  int ours = -1;
  int theirs = -1;
};

std::string read_all(int descriptor) {
  std::array<char, 256> bytes;
  const ssize_t got = recv(descriptor, bytes.data(), bytes.size(), 0);
  return got > 0 ? std::string(bytes.data(), static_cast<std::size_t>(got)) : std::string();
}

/// Both ways to run: the loop itself, and the io_context, as tests do.
class Loops : public testing::TestWithParam<bool> {
 protected:
  void turn() {
    if (GetParam()) return loop_.poll();
    io_.restart();
    io_.poll();
  }

  boost::asio::io_context io_;
  Loop& loop_ = Loop::of(io_);
};

TEST_P(Loops, TellAReadableDescriptorEachTime) {
  Pair pair;
  std::vector<std::string> read;
  Descriptor descriptor(loop_, [&](std::uint32_t) { read.push_back(read_all(pair.ours)); });
  descriptor.own(pair.ours);
  descriptor.watch(EPOLLIN);
  for (const char* text : {"a", "b", "c"}) {
    pair.write(text);
    turn();
  }
  EXPECT_EQ(read, (std::vector<std::string>{"a", "b", "c"}));
}

TEST_P(Loops, TellAgainWhatNobodyHasRead) {
  Pair pair;
  int told = 0;
  Descriptor descriptor(loop_, [&](std::uint32_t) {
    if (++told == 2) read_all(pair.ours);
  });
  descriptor.own(pair.ours);
  descriptor.watch(EPOLLIN);
  pair.write("a");
  turn();
  turn();
  EXPECT_EQ(told, 2);
  turn();
  EXPECT_EQ(told, 2);
}

TEST_P(Loops, SayNothingOfADescriptorThatIsNotWatched) {
  Pair pair;
  int told = 0;
  Descriptor descriptor(loop_, [&](std::uint32_t) {
    ++told;
    read_all(pair.ours);
  });
  descriptor.own(pair.ours);
  descriptor.watch(EPOLLIN);
  descriptor.watch(0);
  pair.write("a");
  turn();
  EXPECT_EQ(told, 0);
  descriptor.watch(EPOLLIN);
  turn();
  EXPECT_EQ(told, 1);
}

TEST_P(Loops, SayNothingToADescriptorThatAnotherHasClosedInTheSameTurn) {
  Pair one;
  Pair two;
  int told = 0;
  std::unique_ptr<Descriptor> first;
  std::unique_ptr<Descriptor> second;
  const auto end_the_other = [&](const Pair& pair, std::unique_ptr<Descriptor>& other) {
    ++told;
    read_all(pair.ours);
    other.reset();
  };
  first = std::make_unique<Descriptor>(loop_, [&](std::uint32_t) { end_the_other(one, second); });
  second = std::make_unique<Descriptor>(loop_, [&](std::uint32_t) { end_the_other(two, first); });
  for (auto [descriptor, pair] : {std::pair(first.get(), &one), std::pair(second.get(), &two)}) {
    descriptor->own(pair->ours);
    descriptor->watch(EPOLLIN);
    pair->write("a");
  }
  turn();
  EXPECT_EQ(told, 1);
}

TEST_P(Loops, DoDeferredWorkOnceForAllWhoAskForItInATurn) {
  int done = 0;
  Deferred work(loop_, [&] { ++done; });
  work.at_end();
  work.at_end();
  EXPECT_TRUE(work.is_due());
  turn();
  EXPECT_EQ(done, 1);
  EXPECT_FALSE(work.is_due());
}

TEST_P(Loops, DoDeferredWorkBehindAllThatWasReady) {
  Pair one;
  Pair two;
  std::string order;
  Deferred work(loop_, [&] { order += 'w'; });
  const auto on_event = [&](int descriptor) {
    order += read_all(descriptor);
    work.at_end();
  };
  Descriptor first(loop_, [&](std::uint32_t) { on_event(one.ours); });
  Descriptor second(loop_, [&](std::uint32_t) { on_event(two.ours); });
  first.own(one.ours);
  second.own(two.ours);
  first.watch(EPOLLIN);
  second.watch(EPOLLIN);
  one.write("r");
  two.write("r");
  turn();
  EXPECT_EQ(order, "rrw");
}

TEST_P(Loops, ForgetDeferredWorkWithItsOwner) {
  int done = 0;
  {
    Deferred work(loop_, [&] { ++done; });
    work.at_end();
  }
  turn();
  EXPECT_EQ(done, 0);
}

TEST_P(Loops, DoWorkThatAsksForItselfAgainWithoutEndOnlyWithLooksForEventsBetween) {
  Pair pair;
  int rounds = 0;
  bool is_read = false;
  Deferred work(loop_, [&] {
    if (++rounds < 1000 && !is_read) work.at_end();
  });
  Descriptor descriptor(loop_, [&](std::uint32_t) { is_read = !read_all(pair.ours).empty(); });
  descriptor.own(pair.ours);
  descriptor.watch(EPOLLIN);
  Deferred first(loop_, [&] {
    pair.write("a");
    work.at_end();
  });
  first.at_end();
  turn();
  EXPECT_TRUE(is_read);
  EXPECT_LT(rounds, 100);
}

TEST_P(Loops, KeepAnObjectThatEndsInsideItsOwnWork) {
  struct Owner {
    explicit Owner(Loop& loop)
        : work(loop, [this, &loop] {
            loop.keep(std::move(self));
            value = 7;  // still there
          }) {}
    std::shared_ptr<Owner> self;
    Deferred work;
    int value = 0;
  };
  auto owner = std::make_shared<Owner>(loop_);
  const std::weak_ptr<Owner> watched = owner;
  owner->self = owner;
  owner->work.at_end();
  owner.reset();
  turn();
  turn();
  EXPECT_TRUE(watched.expired());
}

TEST_P(Loops, RunTimersAndPostsOfTheIoContext) {
  bool is_posted = false;
  bool has_fired = false;
  boost::asio::steady_timer timer(io_, 0ms);
  timer.async_wait([&](const boost::system::error_code&) { has_fired = true; });
  boost::asio::post(io_, [&] { is_posted = true; });
  for (int i = 0; i < 1000 && !has_fired; ++i) turn();
  EXPECT_TRUE(is_posted);
  EXPECT_TRUE(has_fired);
}

INSTANTIATE_TEST_SUITE_P(Both, Loops, testing::Bool(),
                         [](const auto& each) { return each.param ? "ByItself" : "ByAsio"; });

TEST(Loop, RunsUntilTheIoContextIsStoppedByATimer) {
  boost::asio::io_context io;
  boost::asio::steady_timer timer(io, 20ms);
  timer.async_wait([&](const boost::system::error_code&) { io.stop(); });
  Loop::of(io).run();
  EXPECT_TRUE(io.stopped());
}

TEST(Loop, WakesForADescriptorWhileItSleeps) {
  boost::asio::io_context io;
  Loop& loop = Loop::of(io);
  Pair pair;
  Descriptor descriptor(loop, [&](std::uint32_t) { io.stop(); });
  descriptor.own(pair.ours);
  descriptor.watch(EPOLLIN);
  boost::asio::steady_timer timer(io, 5ms);
  timer.async_wait([&](const boost::system::error_code&) { pair.write("a"); });
  boost::asio::steady_timer limit(io, test::kPatience);
  bool is_late = false;
  limit.async_wait([&](const boost::system::error_code& error) {
    is_late = !error;
    io.stop();
  });
  loop.run();
  EXPECT_FALSE(is_late);
}

bool is_readable(int descriptor) {
  pollfd look{descriptor, POLLIN, 0};
  return poll(&look, 1, 0) == 1;
}

TEST(AsioPoll, IsReadableWhenATimerOfThatIoContextHasExpired) {
  boost::asio::io_context io;
  boost::asio::io_context other;
  Loop::of(io);  // has a descriptor of the same kind
  Loop::of(other);
  const int descriptor = poll_descriptor(io);
  const int of_other = poll_descriptor(other);
  EXPECT_NE(descriptor, of_other);
  EXPECT_EQ(poll_descriptor(io), descriptor);
  boost::asio::steady_timer never(other, 1h);
  never.async_wait([](const boost::system::error_code&) {});
  other.poll();  // takes what it told itself as it began
  boost::asio::steady_timer timer(io, 0ms);
  bool has_fired = false;
  timer.async_wait([&](const boost::system::error_code&) { has_fired = true; });
  pollfd look{descriptor, POLLIN, 0};
  ASSERT_EQ(poll(&look, 1, 10'000), 1);
  EXPECT_FALSE(is_readable(of_other));
  io.poll();
  EXPECT_TRUE(has_fired);
  EXPECT_FALSE(is_readable(descriptor));
}

TEST(AsioPoll, SaysThatNoDescriptorIsLeft) {
  boost::asio::io_context io;
  Loop::of(io);
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit none{0, before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &none);
  int code = 0;
  try {
    poll_descriptor(io);
  } catch (const std::system_error& error) {
    code = error.code().value();
  }
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(code, EMFILE);
}

}  // namespace
}  // namespace swarmtalk::loop
