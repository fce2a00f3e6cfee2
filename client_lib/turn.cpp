#include "client_lib/turn.hpp"

#include <utility>

namespace swarmtalk::client {

Turn::Stay::Stay(Turn& turn) : turn_(turn) {
  std::thread::id inside;  // of no thread
  is_first_ = turn_.inside_.compare_exchange_strong(inside, std::this_thread::get_id());
  other_is_inside_ = !is_first_ && inside != std::this_thread::get_id();
  if (is_first_) turn_.owner_.store(std::this_thread::get_id());
}

Turn::Stay::~Stay() {
  if (is_first_) turn_.inside_.store(std::thread::id());
}

bool Turn::is_called_in_turn() {
  const std::thread::id self = std::this_thread::get_id();
  if (self == last_) return false;
  const bool is_back = self == std::exchange(before_last_, last_);
  last_ = self;
  return is_back && !std::exchange(is_told_, true);
}

}  // namespace swarmtalk::client
