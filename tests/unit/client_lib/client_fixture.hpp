// A client whose errors are collected, and waiting for what it should see.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include <swarmtalk/client.hpp>

#include "tests/support/patience.hpp"
#include "tests/unit/client_lib/fake_daemon.hpp"

namespace swarmtalk::test {

class ClientTest : public ::testing::Test {
 protected:
  ClientTest() : path(test_socket_path()) {}

  ClientOptions options() const {
    ClientOptions options;
    options.socket_path = path;
    options.connect_timeout = options.request_timeout = kPatience;
    return options;
  }

  Client make_client() {
    Client client("test", options());
    collect_errors(client);
    return client;
  }

  void collect_errors(Client& client) {
    client.on_error([this](const Status& status) { errors.push_back(status); });
    client.on_disconnect([this](const Status& status) { losses.push_back(status); });
    client.on_reconnect([this] { ++reconnects; });
  }

  /// Runs the client until `holds`, at most kPatience. @return whether it holds
  static bool run_until(Client& client, const std::function<bool()>& holds) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (!holds() && std::chrono::steady_clock::now() < deadline) {
      client.run_once(std::chrono::milliseconds(50));
    }
    return holds();
  }

  std::string path;
  std::vector<Status> errors;
  std::vector<Status> losses;
  int reconnects = 0;
};

}  // namespace swarmtalk::test
