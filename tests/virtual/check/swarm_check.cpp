// swarm_check: tells stories of swarms to whole robots in virtual time, one for each seed, and
// judges what comes of them. Each story has a process of its own, so that one that crashes or hangs
// is a story that breaks a promise, and the others go on. See docs/testing.md.
#include <getopt.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include "tests/virtual/check/judge.hpp"
#include "tests/virtual/check/shorten.hpp"
#include "tests/virtual/check/story.hpp"
#include "tests/virtual/check/telling.hpp"
#include "tests/virtual/virtual_log.hpp"

namespace swarmtalk::test {
namespace {

constexpr unsigned kStorySeconds = 120;  // of this machine, for one story; it takes less than one
constexpr unsigned kTrySeconds = 10;     // for one that is shortened
constexpr int kShorteningTries = 300;
constexpr std::chrono::seconds kLongestShortening(60);

constexpr const char* kUsage =
    "usage: swarm-check [--seeds N] [--first K] [--jobs N]   N stories from seed K on: 300 from 1, "
    "all cores\n"
    "       swarm-check --seed K                             that story alone, with the daemons' "
    "log\n"
    "       swarm-check --seed K --shortened                 the same, with what breaks its "
    "promise "
    "alone\n"
    "       swarm-check --story K                            prints that story\n"
    "       swarm-check --courses                            also prints each story's course, a "
    "number\n";

/// Of one story, as its process hands it on: no pointers.
struct Outcome {
  std::array<std::uint64_t, kKinds> struck{};
  std::array<std::uint64_t, kPromises> decided{};
  std::uint64_t course = 0;
  double seconds = 0;
  std::uint32_t robots = 0;
  std::uint32_t violations = 0;
  Promise promise = Promise::kAlive;  // the first that is broken
  std::array<char, 512> text{};
};

Outcome outcome_of(const Story& story) {
  Outcome outcome;
  outcome.robots = static_cast<std::uint32_t>(story.robots.size());
  Verdict verdict;
  try {
    const Record record = tell(story);
    outcome.struck = record.struck;
    outcome.course = record.course;
    outcome.seconds = record.seconds;
    verdict = judge(story, record);
  } catch (const std::exception& error) {
    verdict.violations.push_back({Promise::kAlive, error.what()});
  }
  outcome.decided = verdict.decided;
  outcome.violations = static_cast<std::uint32_t>(verdict.violations.size());
  if (!verdict.violations.empty()) {
    outcome.promise = verdict.violations[0].promise;
    verdict.violations[0].text.copy(outcome.text.data(), outcome.text.size() - 1);
  }
  return outcome;
}

Outcome died(const Story& story, const std::string& how) {
  Outcome outcome;
  outcome.robots = static_cast<std::uint32_t>(story.robots.size());
  outcome.violations = 1;
  how.copy(outcome.text.data(), outcome.text.size() - 1);
  return outcome;
}

/// A story in a process of its own.
class Child {
 public:
  explicit Child(const Story& story, unsigned seconds = kStorySeconds)
      : story_(story), seconds_(seconds) {
    std::array<int, 2> ends{};
    if (::pipe(ends.data()) != 0) fail("pipe");
    std::fflush(stdout);
    process_ = ::fork();
    if (process_ < 0) fail("fork");
    if (process_ == 0) {
      ::close(ends[0]);
      silence_virtual_logs();
      ::alarm(seconds_);
      const Outcome outcome = outcome_of(story);
      const bool is_told = ::write(ends[1], &outcome, sizeof outcome) == sizeof outcome;
      ::_exit(is_told ? 0 : 1);
    }
    ::close(ends[1]);
    result_ = ends[0];
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() { ::close(result_); }

  int result() const { return result_; }
  std::uint64_t seed() const { return story_.seed; }

  /// Waits for it.
  Outcome outcome() {
    Outcome outcome;
    const ssize_t size = ::read(result_, &outcome, sizeof outcome);
    int status = 0;
    while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    if (size == static_cast<ssize_t>(sizeof outcome)) return outcome;
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
      return died(story_, "it has not ended after " + std::to_string(seconds_) + " s");
    }
    return died(story_, WIFSIGNALED(status)
                            ? std::string("it ended by ") + ::strsignal(WTERMSIG(status))
                            : "it ended with " + std::to_string(WEXITSTATUS(status)));
  }

 private:
  [[noreturn]] static void fail(const char* what) {
    throw std::system_error(errno, std::system_category(), what);
  }

  Story story_;
  unsigned seconds_;
  pid_t process_ = -1;
  int result_ = -1;
};

Story shortened(const Story& story, const Outcome& outcome) {
  const auto end = std::chrono::steady_clock::now() + kLongestShortening;
  return shortened(
      story,
      [&](const Story& without) {
        if (std::chrono::steady_clock::now() > end) return false;
        const Outcome now = Child(without, kTrySeconds).outcome();
        return now.violations > 0 && now.promise == outcome.promise;
      },
      kShorteningTries);
}

void print_violation(const Story& story, const Outcome& outcome) {
  std::printf("seed %llu breaks a promise, %s: %s (%u in all)\n",
              static_cast<unsigned long long>(story.seed), name_of(outcome.promise),
              outcome.text.data(), outcome.violations);
  const Story shorter = shortened(story, outcome);
  std::printf(
      "%zu of its %zu events are enough: %s\n%sagain: tools/swarm-check --seed %llu "
      "--shortened\n\n",
      shorter.events.size(), story.events.size(), Child(shorter, kTrySeconds).outcome().text.data(),
      told(shorter).c_str(), static_cast<unsigned long long>(story.seed));
}

struct Options {
  std::uint64_t seeds = 300;
  std::uint64_t first = 1;
  unsigned jobs = std::max(1u, std::thread::hardware_concurrency());
  bool is_one = false;
  bool is_told_only = false;
  bool has_courses = false;
  bool is_shortened = false;
};

std::optional<std::uint64_t> number_of(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return number;
}

std::optional<Options> parse(int argc, char** argv) {
  static const std::array<option, 8> kOptions{{{"seeds", required_argument, nullptr, 'n'},
                                               {"first", required_argument, nullptr, 'f'},
                                               {"jobs", required_argument, nullptr, 'j'},
                                               {"seed", required_argument, nullptr, 's'},
                                               {"story", required_argument, nullptr, 't'},
                                               {"courses", no_argument, nullptr, 'c'},
                                               {"shortened", no_argument, nullptr, 'x'},
                                               {}}};
  Options options;
  for (int key = 0; (key = ::getopt_long(argc, argv, "", kOptions.data(), nullptr)) != -1;) {
    if (key == 'c') options.has_courses = true;
    if (key == 'x') options.is_shortened = true;
    if (key == 'c' || key == 'x') continue;
    const auto number = key == '?' ? std::nullopt : number_of(optarg);
    if (!number || (key == 'j' && (*number == 0 || *number > 1024))) return {};
    if (key == 'n') options.seeds = *number;
    if (key == 'j') options.jobs = static_cast<unsigned>(*number);
    if (key == 'f' || key == 's' || key == 't') options.first = *number;
    options.is_one = options.is_one || key == 's';
    options.is_told_only = options.is_told_only || key == 't';
  }
  if (optind != argc) return {};
  return options;
}

int tell_one(const Story& story) {
  std::printf("%s", told(story).c_str());
  std::fflush(stdout);
  const Verdict verdict = judge(story, tell(story));
  for (const Violation& each : verdict.violations) {
    std::printf("%s: %s\n", name_of(each.promise), each.text.c_str());
  }
  if (verdict.violations.empty()) std::printf("every promise was kept\n");
  return verdict.violations.empty() ? 0 : 1;
}

/// What all stories together have come to.
class Sum {
 public:
  void add(const Outcome& outcome) {
    for (std::size_t i = 0; i < kKinds; ++i) struck_[i] += outcome.struck[i];
    for (std::size_t i = 0; i < kPromises; ++i) decided_[i] += outcome.decided[i];
    robots_ += outcome.robots;
    seconds_ += outcome.seconds;
    if (outcome.violations > 0) ++broken_;
  }

  /// @return whether every promise was kept
  bool print(const Options& options) const {
    std::printf("%llu stories from seed %llu on, %llu robots, %.0f s of the swarms' time\n",
                static_cast<unsigned long long>(options.seeds),
                static_cast<unsigned long long>(options.first),
                static_cast<unsigned long long>(robots_), seconds_);
    for (std::size_t i = 0; i < std::max(kKinds, kPromises); ++i) {
      std::printf("%-10s struck %9llu", name_of(static_cast<Kind>(i)),
                  static_cast<unsigned long long>(struck_.at(i)));
      if (i < kPromises) {
        std::printf("   %-13s decided %10llu", name_of(static_cast<Promise>(i)),
                    static_cast<unsigned long long>(decided_.at(i)));
      }
      std::printf("\n");
    }
    if (broken_ == 0) {
      std::printf("every promise was kept\n");
    } else {
      std::printf("%llu stories broke a promise\n", static_cast<unsigned long long>(broken_));
    }
    return broken_ == 0;
  }

 private:
  std::array<std::uint64_t, kKinds> struck_{};
  std::array<std::uint64_t, kPromises> decided_{};
  std::uint64_t robots_ = 0;
  std::uint64_t broken_ = 0;
  double seconds_ = 0;
};

bool tell_all(const Options& options) {
  Sum sum;
  std::map<int, std::unique_ptr<Child>> children;  // by the descriptor of their result
  std::uint64_t next = options.first;
  const std::uint64_t end = options.first + options.seeds;
  while (next != end || !children.empty()) {
    while (next != end && children.size() < options.jobs) {
      auto child = std::make_unique<Child>(draw_story(next++));
      const int result = child->result();
      children[result] = std::move(child);
    }
    std::vector<pollfd> waiting;
    for (const auto& [result, child] : children) waiting.push_back({result, POLLIN, 0});
    if (::poll(waiting.data(), waiting.size(), -1) < 0 && errno != EINTR) {
      throw std::system_error(errno, std::system_category(), "poll");
    }
    for (const pollfd& each : waiting) {
      if (each.revents == 0) continue;
      const std::uint64_t seed = children.at(each.fd)->seed();
      const Outcome outcome = children.at(each.fd)->outcome();
      children.erase(each.fd);
      sum.add(outcome);
      if (options.has_courses) {
        std::printf("seed %llu: course %016llx\n", static_cast<unsigned long long>(seed),
                    static_cast<unsigned long long>(outcome.course));
      }
      if (outcome.violations > 0) print_violation(draw_story(seed), outcome);
    }
  }
  return sum.print(options);
}

int run(int argc, char** argv) {
  const auto options = parse(argc, argv);
  if (!options) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  if (options->is_told_only) {
    std::printf("%s", told(draw_story(options->first)).c_str());
    return 0;
  }
  if (options->is_one) {
    const Story story = draw_story(options->first);
    if (!options->is_shortened) return tell_one(story);
    const Outcome outcome = Child(story).outcome();
    return tell_one(outcome.violations == 0 ? story : shortened(story, outcome));
  }
  return tell_all(*options) ? 0 : 1;
}

}  // namespace
}  // namespace swarmtalk::test

int main(int argc, char** argv) {
  try {
    return swarmtalk::test::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "swarm-check: %s\n", error.what());
    return 1;
  }
}
