// One end of steady traffic, which keeps account of every message and says so at its end.
//   traffic send NAME CHANNEL RATE_HZ BYTES
//   traffic hear NAME CHANNEL
// Both run until SIGTERM, survive the daemon, and print on stdout: a line "ready" when connected
// and registered, "lost NS" and "back NS" (CLOCK_MONOTONIC) when the daemon goes and returns, and
// one line of JSON at the end.
//
// send: every accepted message must end in exactly one sent(): "open" in the account is 0.
// hear: the numbers of each sender, from the first heard to the last, are either heard or told as
// lost: "unaccounted" is 0. A new connection starts a new account, since nobody listened between.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <swarmtalk/client.hpp>
#include <utility>
#include <vector>

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

volatile std::sig_atomic_t stopping = 0;

void say_time(const char* what) {
  std::printf("%s %lld\n", what, static_cast<long long>(Clock::now().time_since_epoch().count()));
  std::fflush(stdout);
}

void watch(swarmtalk::Client& robot) {
  robot.on_error([](const swarmtalk::Status&) {});  // losses are in the account
  robot.on_disconnect([](const swarmtalk::Status&) { say_time("lost"); });
}

void say_ready() {
  std::printf("ready\n");
  std::fflush(stdout);
}

struct SendAccount {
  unsigned long accepted = 0, sent = 0, unsent = 0, busy = 0, disconnected = 0, refused = 0;
};

int send(const char* name, const char* channel, double rate_hz, std::size_t size_bytes) {
  SendAccount account;
  auto robot = swarmtalk::Client::connected(name);
  watch(robot);
  robot.on_reconnect([] { say_time("back"); });
  auto publisher = robot.channel(channel).publisher(
      [&](const swarmtalk::Status& status) { ++(status ? account.sent : account.unsent); },
      swarmtalk::Sending::one_at_a_time());
  say_ready();
  const auto gap =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / rate_hz));
  const std::string message(size_bytes, 's');
  auto next = Clock::now();
  while (!stopping) {
    const auto now = Clock::now();
    if (now < next) {
      robot.run_once(next - now);
      continue;
    }
    const swarmtalk::Status status = publisher.send(message);
    if (status.code() == swarmtalk::StatusCode::kBusy) {
      ++account.busy;
      robot.run_once(1ms);  // and then the same message
      continue;
    }
    next = std::max(next + gap, now - 100ms);  // catches up a little, not for ever
    if (status) {
      ++account.accepted;
    } else if (status.code() == swarmtalk::StatusCode::kDisconnected) {
      ++account.disconnected;
      robot.run_once(10ms);
    } else {
      ++account.refused;
      robot.run_once(10ms);
    }
  }
  const auto deadline = Clock::now() + 1min;
  while (account.sent + account.unsent < account.accepted && Clock::now() < deadline)
    robot.run_once(10ms);
  std::printf(
      "{\"accepted\": %lu, \"sent\": %lu, \"unsent\": %lu, \"open\": %ld, \"busy\": %lu, "
      "\"disconnected\": %lu, \"refused\": %lu}\n",
      account.accepted, account.sent, account.unsent,
      static_cast<long>(account.accepted) - static_cast<long>(account.sent + account.unsent),
      account.busy, account.disconnected, account.refused);
  return 0;
}

/// Numbers of one sender, as heard over one connection.
struct Span {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
};

class Listener {
 public:
  void on_message(const swarmtalk::Message& message) {
    ++received_;
    if (heard_now_ == 0) {
      // What was lost before the first message of a connection is before all spans.
      ignored_ += message.lost_before;
    } else {
      lost_ += message.lost_before;
    }
    ++heard_now_;
    const auto key = std::pair(message.sender, message.epoch);
    const auto [found, is_new] =
        spans_.try_emplace(key, Span{message.message_number, message.message_number});
    if (is_new) return;
    Span& span = found->second;
    if (message.message_number <= span.last) ++late_or_twice_;
    span.last = std::max(span.last, message.message_number);
    span.first = std::min(span.first, message.message_number);
  }

  /// Closes the account of a connection that has ended.
  void settle() {
    unsigned long expected = 0;
    for (const auto& [key, span] : spans_) expected += span.last - span.first + 1;
    const auto told = static_cast<long>(lost_.total()) - static_cast<long>(lost_.late);
    unaccounted_ += static_cast<long>(expected) - static_cast<long>(heard_now_) - told;
    expected_ += expected;
    total_lost_ += lost_;
    lost_ = {};
    spans_.clear();
    heard_now_ = 0;
  }

  void report() const {
    std::printf(
        "{\"received\": %lu, \"expected\": %lu, \"unaccounted\": %ld, \"air\": %lu, "
        "\"kernel\": %lu, \"daemon\": %lu, \"client\": %lu, \"late\": %lu, "
        "\"late_or_twice\": %lu}\n",
        received_, expected_, unaccounted_, static_cast<unsigned long>(total_lost_.air),
        static_cast<unsigned long>(total_lost_.kernel),
        static_cast<unsigned long>(total_lost_.daemon),
        static_cast<unsigned long>(total_lost_.client),
        static_cast<unsigned long>(total_lost_.late), late_or_twice_);
  }

 private:
  std::map<std::pair<std::uint32_t, std::uint32_t>, Span> spans_;
  swarmtalk::Loss lost_, total_lost_, ignored_;
  unsigned long received_ = 0, expected_ = 0, heard_now_ = 0, late_or_twice_ = 0;
  long unaccounted_ = 0;
};

int hear(const char* name, const char* channel) {
  Listener listener;
  auto robot = swarmtalk::Client::connected(name);
  robot.on_error([](const swarmtalk::Status&) {});
  robot.on_disconnect([&](const swarmtalk::Status&) {
    listener.settle();
    say_time("lost");
  });
  robot.on_reconnect([] { say_time("back"); });
  auto subscriber = robot.channel(channel).subscriber(
      [&](const swarmtalk::Message& message) { listener.on_message(message); },
      swarmtalk::Policy::last(1000));
  say_ready();
  while (!stopping) robot.run_for(50ms);
  listener.settle();
  listener.report();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  struct sigaction action {};
  action.sa_handler = [](int) { stopping = 1; };
  sigaction(SIGTERM, &action, nullptr);
  try {
    if (argc == 6 && std::strcmp(argv[1], "send") == 0)
      return send(argv[2], argv[3], std::strtod(argv[4], nullptr),
                  std::strtoul(argv[5], nullptr, 10));
    if (argc == 4 && std::strcmp(argv[1], "hear") == 0) return hear(argv[2], argv[3]);
  } catch (const swarmtalk::Error& error) {
    std::fprintf(stderr, "traffic: %s\n", error.what());
    return 1;
  }
  std::fprintf(stderr, "usage: traffic send NAME CHANNEL RATE_HZ BYTES | hear NAME CHANNEL\n");
  return 2;
}
