// A refused message whose Status nobody has looked at yet: all copies of the Status share it. When
// the last is destroyed unread, the program's owner is told. Any thread.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include <swarmtalk/client/status.hpp>

namespace swarmtalk::client {

class Engine;

struct Unread {
  Unread(std::weak_ptr<Engine> of, std::string name, std::string reason)
      : engine(std::move(of)), label(std::move(name)), why(std::move(reason)) {}
  Unread(const Unread&) = delete;
  Unread& operator=(const Unread&) = delete;
  ~Unread();
  static void not_looked_at(const Status& status);

  std::atomic<bool> is_read{false};
  std::weak_ptr<Engine> engine;
  std::string label;  // of the channel
  std::string why;
};

}  // namespace swarmtalk::client
