#include "drivers/link/link_seal.hpp"

#include <chrono>

#include "loop/clock.hpp"

namespace swarmtalk::drivers {

void LinkSeal::use(std::uint32_t epoch) {
  if (!is_fresh_) {
    freshness_.reset();
    return use_key(key_, builder_, receiver_, also_key_);
  }
  use_key_freshly(key_, also_key_, epoch, loop::now(), freshness_, builder_, receiver_);
  arm();
}

std::string LinkSeal::remark() const {
  return key_ != nullptr && !is_fresh_ ? ", sealed, freshness not checked" : "";
}

void LinkSeal::arm_timer() {
  armed_for_ = freshness_->speak_at();
  timer_.at(MonotonicTime(std::chrono::milliseconds(armed_for_)));
}

void LinkSeal::on_time() {
  armed_for_ = 0;
  if (freshness_ == nullptr) return;
  const MonotonicTime now = loop::now();
  const bool is_due = freshness_->speak_at() <= milliseconds(now);
  if (is_due && !speak_(now)) freshness_->postpone(milliseconds(now));
  arm();
}

}  // namespace swarmtalk::drivers
