#include "daemon/session/client_operations.hpp"

#include <utility>

namespace swarmtalk::daemon {

void ClientOperations::leave() {
  if (is_capturing_) operations_->stop_capture(*this);
  if (kilobots_ != nullptr) kilobots_->forget(*this);
}

bool ClientOperations::operate(const ipc::Envelope& request) {
  if (operations_ == nullptr) return false;
  Operations& operations = *operations_;
  std::optional<Refusal> refusal;
  ipc::Envelope& reply = answers_.make();
  if (request.has_reload()) {
    refusal = reload(*reply.mutable_reloaded());
  } else if (request.has_check_configuration()) {
    refusal = operations.check_configuration(*reply.mutable_reloaded());
  } else if (request.has_set_log_level()) {
    refusal = operations.set_log_level(client_.who(), request.set_log_level());
    if (!refusal) operations.fill_log_levels(*reply.mutable_log_levels());
  } else if (request.has_set_node_id()) {
    std::optional<std::uint32_t> id;
    if (request.set_node_id().has_node_id()) id = request.set_node_id().node_id();
    refusal = operations.set_node_id(client_.who(), id);
    reply.mutable_done();
  } else if (request.has_get_metrics()) {
    operations.fill_metrics(*reply.mutable_metrics());
  } else if (request.has_capture()) {
    if (!std::exchange(is_capturing_, true)) operations.start_capture(client_.who(), *this);
    reply.mutable_done();
  } else {
    return false;
  }
  if (refusal) {
    answers_.refuse(*refusal);
  } else {
    answers_.send();
  }
  return true;
}

// Many reloads that came at once are one, and each is answered as that was.
std::optional<Refusal> ClientOperations::reload(ipc::Reloaded& reply) {
  if (!std::exchange(has_reloaded_, true)) {
    reloaded_.Clear();
    reload_refusal_ = operations_->reload(client_.who(), reloaded_);
  }
  reply = reloaded_;
  return reload_refusal_;
}

// A client that is too slow misses frames, and is told how many.
void ClientOperations::on_captured(ipc::Captured& captured) {
  constexpr std::size_t kRoomBytes = 4096;  // for what else is to be answered
  const std::size_t waiting = output_.answer_bytes() + captured.ByteSizeLong() + kRoomBytes;
  if (waiting > limits_.reply_bytes) {
    ++missed_frames_;
    return;
  }
  captured.set_missed(std::exchange(missed_frames_, 0));
  *answers_.make_notice().mutable_captured() = captured;
  answers_.send_notice();
}

void ClientOperations::begin_kilobot(const ipc::KilobotCommand& command) {
  if (kilobots_ == nullptr) {
    return answers_.refuse({ipc::ERROR_BAD_COMMAND,
                            "this daemon has no link of type kilobot; add one to its configuration",
                            std::nullopt});
  }
  ipc::KilobotStarted started;
  if (const auto refusal = kilobots_->begin(command, *this, started))
    return answers_.refuse(*refusal);
  *answers_.make().mutable_kilobot_started() = std::move(started);
  answers_.send();
}

void ClientOperations::cancel_kilobot(std::uint32_t operation_id) {
  if (kilobots_ == nullptr)
    return answers_.refuse({ipc::ERROR_UNKNOWN_ID, "no command", std::nullopt});
  if (const auto refusal = kilobots_->cancel(operation_id, *this)) return answers_.refuse(*refusal);
  answers_.send_done();
}

void ClientOperations::on_kilobot_progress(const ipc::KilobotProgress& progress) {
  *answers_.make_notice().mutable_kilobot_progress() = progress;
  answers_.send_notice();
}

void ClientOperations::on_kilobot_ended(const ipc::KilobotEnded& ended) {
  *answers_.make_notice().mutable_kilobot_ended() = ended;
  answers_.send_notice();
}

}  // namespace swarmtalk::daemon
