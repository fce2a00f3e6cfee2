// The end of a program by exit() or a return from main, with Clients that were not destroyed: one
// in a local variable of main at std::exit(), one that a pointer keeps, one of C without a close.
#pragma once

#include <atomic>
#include <memory>

namespace swarmtalk::client {

class Engine;

/// For a scope: this thread is in a call that holds locks for moments. A signal's handler that
/// comes then and calls exit() must not wait for them.
class LockingCall {
 public:
  LockingCall() { add(1); }
  ~LockingCall() { add(-1); }
  LockingCall(const LockingCall&) = delete;
  LockingCall& operator=(const LockingCall&) = delete;

  /// Whether this thread is in one.
  static bool is_any() { return depth_.load() > 0; }

 private:
  // Of one thread: atomic for its handlers alone.
  static void add(int more) { depth_.store(depth_.load(kOrder) + more, kOrder); }

  static constexpr auto kOrder = std::memory_order_relaxed;
  static inline thread_local std::atomic<int> depth_{0};
};

/// `engine` gets its end_with_program() then, if it is still there. Any thread.
void end_with_program(const std::shared_ptr<Engine>& engine);

}  // namespace swarmtalk::client
