// Turn: which thread is inside a Client. One thread owns it; a second one that comes in while the
// first is in there, also while that one only waits, is refused, and two that call it in turn are
// noticed.
#pragma once

#include <atomic>
#include <thread>

namespace swarmtalk::client {

class Turn {
 public:
  /// For a scope: inside, if nobody else is. Any thread.
  class Stay {
   public:
    explicit Stay(Turn& turn);
    ~Stay();
    Stay(const Stay&) = delete;
    Stay& operator=(const Stay&) = delete;

    bool is_first() const { return is_first_; }           // nobody was inside
    bool is_refused() const { return other_is_inside_; }  // another thread is; else ours may be

   private:
    Turn& turn_;
    bool is_first_ = false;
    bool other_is_inside_ = false;
  };

  /// Whether the calling thread is inside. Any thread.
  bool is_mine() const { return inside_.load() == std::this_thread::get_id(); }

  /// Whether the calling thread is the last that was inside: the owner. Any thread.
  bool is_owner() const { return owner_.load() == std::this_thread::get_id(); }

  /// The calling thread runs the callbacks. @pre inside
  /// @return true once: it did so before, and another thread has since. A Client that is handed
  ///   over does not come back.
  bool is_called_in_turn();

 private:
  std::atomic<std::thread::id> inside_{};
  std::atomic<std::thread::id> owner_{};
  // Changed inside only.
  std::thread::id last_;
  std::thread::id before_last_;
  bool is_told_ = false;
};

}  // namespace swarmtalk::client
