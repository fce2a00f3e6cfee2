#include "drivers/link/link_state.hpp"

#include <utility>

namespace swarmtalk::drivers {

LinkState::LinkState(boost::asio::io_context& io, Log log, std::chrono::milliseconds interval)
    : log_(std::move(log)), interval_(interval), timer_(io, [this] {
        if (unlogged_changes_ > 0) this->log();
      }) {}

bool LinkState::set(bool is_up, const std::string& text) {
  const bool has_turned = std::exchange(is_up_, is_up) != is_up;
  if (text == text_) return has_turned;
  text_ = text;
  if (timer_.is_armed()) {
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
  timer_.after(interval_);
}

}  // namespace swarmtalk::drivers
