#include "drivers/link/link_state.hpp"

#include <utility>

namespace swarmtalk::drivers {

LinkState::LinkState(boost::asio::io_context& io, Log log, std::chrono::milliseconds interval)
    : log_(std::move(log)), interval_(interval), timer_(io) {}

bool LinkState::set(bool is_up, const std::string& text) {
  const bool has_turned = std::exchange(is_up_, is_up) != is_up;
  if (text == text_) return has_turned;
  text_ = text;
  if (is_timer_armed_) {
    ++unlogged_changes_;
  } else {
    log();
  }
  return has_turned;
}

void LinkState::log() {
  const std::uint64_t changes = std::exchange(unlogged_changes_, 0);
  log_(is_up_, changes > 1
                   ? text_ + " (" + std::to_string(changes) + " changes since the last line)"
                   : text_);
  is_timer_armed_ = true;
  timer_.expires_after(interval_);
  timer_.async_wait(
      [this, alive = std::weak_ptr<bool>(alive_)](const boost::system::error_code& error) {
        if (alive.expired() || error) return;
        is_timer_armed_ = false;
        if (unlogged_changes_ > 0) log();
      });
}

}  // namespace swarmtalk::drivers
