// A fixture for tests of swarmtalk-cli itself against a fake daemon.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <functional>
#include <string>

#include "tests/unit/cli/program.hpp"
#include "tests/unit/client_lib/fake_daemon.hpp"

namespace swarmtalk::test {

class Cli : public ::testing::Test {
 protected:
  Cli() : path(test_socket_path()), daemon(path) {}

  Strings with_socket(Strings arguments) const {
    arguments.insert(arguments.begin(), {"--socket", path});
    return arguments;
  }
  Result run(const Strings& arguments, const std::string& input = {}) const {
    Program program(with_socket(arguments));
    if (!input.empty()) program.write(input);
    return program.finish();
  }
  /// Until the daemon has heard so many of what `matches`, for a minute at most.
  void wait_for(const std::function<bool(const ipc::Envelope&)>& matches, int count) {
    for (int i = 0; i < 60'000; ++i) {
      if (daemon.count(matches) >= count) return;
      ::usleep(1000);
    }
    FAIL() << "the daemon has not heard it";
  }
  void wait_for_subscriptions(int count) {
    wait_for([](const auto& envelope) { return envelope.has_subscribe(); }, count);
  }
  void wait_for_publications(int count) { wait_for(is_publish, count); }
  ipc::Publish last_publish() {
    const auto envelopes = daemon.received();
    const auto found = std::find_if(envelopes.rbegin(), envelopes.rend(),
                                    [](const auto& e) { return e.has_publish(); });
    return found == envelopes.rend() ? ipc::Publish() : found->publish();
  }
  static int lines(const std::string& text) {
    return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
  }

  std::string path;
  FakeDaemon daemon;
};

}  // namespace swarmtalk::test
