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
  using Tell =
      std::function<void(const std::string& label, const std::string& why, bool is_unread)>;

  /// @param told  called when nobody has looked, with the other two
  Unread(Tell told, std::string name, std::string reason)
      : tell(std::move(told)), label(std::move(name)), why(std::move(reason)) {}
  Unread(const Unread&) = delete;
  Unread& operator=(const Unread&) = delete;
  ~Unread();
  /// For the C interface, which had to look itself: whether its program does cannot be seen, and it
  /// is told in any case.
  static void tell_anyway(const Status& status);

  std::atomic<bool> is_read{false};
  std::atomic<bool> tells_anyway{false};
  Tell tell;
  std::string label;  // of the channel
  std::string why;
};

}  // namespace swarmtalk::client
