// Session: commands to Kilobots.
#include "daemon/session/session.hpp"

namespace swarmtalk::daemon {

void Session::begin_kilobot(const ipc::KilobotCommand& command) {
  if (host_.kilobots == nullptr) {
    return refuse({ipc::ERROR_BAD_COMMAND,
                   "this daemon has no link of type kilobot; add one to its configuration",
                   std::nullopt});
  }
  ipc::KilobotStarted started;
  if (const auto refusal = host_.kilobots->begin(command, *this, started)) return refuse(*refusal);
  *new_reply().mutable_kilobot_started() = std::move(started);
  send_reply();
}

void Session::cancel_kilobot(std::uint32_t operation_id) {
  if (host_.kilobots == nullptr) return refuse({ipc::ERROR_UNKNOWN_ID, "no command", std::nullopt});
  if (const auto refusal = host_.kilobots->cancel(operation_id, *this)) return refuse(*refusal);
  new_reply().mutable_done();
  send_reply();
}

void Session::on_kilobot_progress(const ipc::KilobotProgress& progress) {
  *new_notice().mutable_kilobot_progress() = progress;
  send_notice();
}

void Session::on_kilobot_ended(const ipc::KilobotEnded& ended) {
  *new_notice().mutable_kilobot_ended() = ended;
  send_notice();
}

}  // namespace swarmtalk::daemon
