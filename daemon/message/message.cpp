#include "daemon/message/message.hpp"

namespace swarmtalk::daemon {

void MessageRef::reset() {
  if (block_ != nullptr && --block_->uses == 0) block_->pool->give_back(block_);
  block_ = nullptr;
}

MessageRef MessagePool::take(const MessageHead& head, std::span<const std::uint8_t> payload,
                             bool is_local) {
  std::unique_ptr<MessageRef::Block> block;
  if (free_.empty()) {
    block = std::make_unique<MessageRef::Block>();
    block->pool = this;
  } else {
    block = std::move(free_.back());
    free_.pop_back();
  }
  Message& message = block->message;
  static_cast<MessageHead&>(message) = head;
  message.payload.assign(reinterpret_cast<const char*>(payload.data()), payload.size());
  message.is_local = is_local;
  return MessageRef(block.release());
}

void MessagePool::give_back(MessageRef::Block* block) {
  std::unique_ptr<MessageRef::Block> owned(block);
  if (free_.size() >= kMostFree) return;
  if (free_.capacity() == 0) free_.reserve(kMostFree);
  free_.push_back(std::move(owned));
}

}  // namespace swarmtalk::daemon
