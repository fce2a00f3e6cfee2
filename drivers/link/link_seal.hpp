// LinkSeal: the keys of a link, and the timer for frames that show others that we live: they
// believe us, and we them, only if we speak. Owned by the link, on its thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "drivers/link/framer.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::drivers {

class LinkSeal {
 public:
  /// Both ends of the link must outlive it.
  /// @param speak  sends a frame, with or without packets. @return false: none can leave now
  LinkSeal(boost::asio::io_context& io, FrameBuilder& builder, FrameReceiver& receiver,
           std::function<bool(MonotonicTime now)> speak)
      : builder_(builder),
        receiver_(receiver),
        speak_(std::move(speak)),
        timer_(io, [this] { on_time(); }) {}

  // Used from the next use() on. Null: none.
  void set_key(std::shared_ptr<const frame::SwarmKey> key) { key_ = std::move(key); }
  void set_also_key(std::shared_ptr<const frame::SwarmKey> key) { also_key_ = std::move(key); }
  /// Whether frames have to be fresh.
  void set_freshness(bool is_on) { is_fresh_ = is_on; }

  bool is_sealed() const { return key_ != nullptr; }
  /// What the seal lacks, to follow the state of the link.
  std::string remark() const;

  /// Both ends of the link go over to the keys. @param epoch  of the transmitter
  void use(std::uint32_t epoch);

  /// Frames have come, after which we may have to speak.
  void arm() {
    if (freshness_ != nullptr && freshness_->speak_at() != armed_for_) arm_timer();
  }

 private:
  void arm_timer();
  void on_time();

  FrameBuilder& builder_;
  FrameReceiver& receiver_;
  std::function<bool(MonotonicTime)> speak_;
  std::shared_ptr<const frame::SwarmKey> key_;
  std::shared_ptr<const frame::SwarmKey> also_key_;
  std::shared_ptr<frame::Freshness> freshness_;  // null: frames are not checked
  bool is_fresh_ = true;
  loop::Timer timer_;
  frame::Freshness::Ms armed_for_ = 0;  // 0: not
};

}  // namespace swarmtalk::drivers
