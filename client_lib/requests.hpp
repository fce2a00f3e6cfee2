// Requests: numbers what is asked of the daemon and brings each answer to who asked. On the owner's
// thread.
#pragma once

#include <cstdint>
#include <functional>
#include <unordered_map>
#include <utility>

#include <swarmtalk/client/status.hpp>

#include "ipc/ipc.pb.h"

namespace swarmtalk::client {

class Requests {
 public:
  /// `reply` is null when the request was refused; `status` then says why.
  using Completion = std::function<void(const ipc::Envelope* reply, const Status& status)>;

  /// @param append  puts a frame into what is to be written; false: it is too long
  explicit Requests(std::function<bool(const ipc::Envelope&)> append)
      : append_(std::move(append)) {}

  /// An empty envelope, to be filled; one of the next three sends it.
  ipc::Envelope& make() {
    outgoing_.Clear();
    return outgoing_;
  }
  /// @return its number, for abandon()
  std::uint32_t send(Completion done);
  /// Nobody waits for the answer; a refusal is kept for take_refusal().
  void send_only();
  /// What is not answered.
  void send_unnumbered() { append_(outgoing_); }

  /// An answer has come.
  void answer(const ipc::Envelope& envelope);
  /// Its caller gives up waiting.
  void abandon(std::uint32_t id) { pending_.erase(id); }
  /// Answers all that waits with this.
  void fail_all(const Status& why);
  void clear() { pending_.clear(); }
  bool is_empty() const { return pending_.empty(); }

  void note_refusal(const Status& status) {
    if (first_refusal_) first_refusal_ = status;
  }
  /// The first since the last call; ok: none.
  Status take_refusal() { return std::exchange(first_refusal_, Status()); }

 private:
  std::function<bool(const ipc::Envelope&)> append_;
  ipc::Envelope outgoing_;
  std::uint32_t last_id_ = 0;
  std::unordered_map<std::uint32_t, Completion> pending_;
  Status first_refusal_;
};

}  // namespace swarmtalk::client
