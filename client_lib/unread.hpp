// A refused message whose Status nobody has looked at yet: all copies of the Status share it. When
// the last is destroyed unread, the program's owner is told. Any thread.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>

#include <swarmtalk/client/status.hpp>

namespace swarmtalk::client {

struct Unread {
  /// @param told  called when nobody has looked, with the other two
  Unread(std::function<void(const std::string& label, const std::string& why)> told,
         std::string name, std::string reason)
      : tell(std::move(told)), label(std::move(name)), why(std::move(reason)) {}
  Unread(const Unread&) = delete;
  Unread& operator=(const Unread&) = delete;
  ~Unread();
  static void not_looked_at(const Status& status);

  std::atomic<bool> is_read{false};
  std::function<void(const std::string& label, const std::string& why)> tell;
  std::string label;  // of the channel
  std::string why;
};

}  // namespace swarmtalk::client
