// Session: requests of an operator.
#include <utility>

#include "daemon/session/session.hpp"

namespace swarmtalk::daemon {

std::string Session::who() const {
  return "client '" + client_name_ + "' (" + peer() + ")";
}

bool Session::operate(const ipc::Envelope& request) {
  if (host_.operations == nullptr) return false;
  Operations& operations = *host_.operations;
  std::optional<Refusal> refusal;
  ipc::Envelope& reply = new_reply();
  if (request.has_reload()) {
    refusal = operations.reload(who(), *reply.mutable_reloaded());
  } else if (request.has_set_log_level()) {
    refusal = operations.set_log_level(who(), request.set_log_level());
    if (!refusal) operations.fill_log_levels(*reply.mutable_log_levels());
  } else if (request.has_set_node_id()) {
    std::optional<std::uint32_t> id;
    if (request.set_node_id().has_node_id()) id = request.set_node_id().node_id();
    refusal = operations.set_node_id(who(), id);
    reply.mutable_done();
  } else if (request.has_get_metrics()) {
    operations.fill_metrics(*reply.mutable_metrics());
  } else if (request.has_capture()) {
    if (!std::exchange(is_capturing_, true)) operations.start_capture(who(), *this);
    reply.mutable_done();
  } else {
    return false;
  }
  if (refusal) {
    refuse(*refusal);
  } else {
    send_reply();
  }
  return true;
}

// A client that is too slow misses frames, and is told how many.
void Session::on_captured(ipc::Captured& captured) {
  constexpr std::size_t kRoomBytes = 4096;  // for what else is to be answered
  const std::size_t waiting = replies_.size() + captured.ByteSizeLong() + kRoomBytes;
  if (is_closed_ || waiting > host_.limits.reply_bytes) {
    ++missed_frames_;
    return;
  }
  captured.set_missed(std::exchange(missed_frames_, 0));
  *new_notice().mutable_captured() = captured;
  send_notice();
}

}  // namespace swarmtalk::daemon
