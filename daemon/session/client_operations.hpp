// ClientOperations: what one client asks of the daemon as an operator, of its links' frames
// (capture) and of Kilobots; and what it is told of them later. On the daemon's thread.
#pragma once

#include <cstdint>

#include "daemon/config/config.hpp"
#include "daemon/kilobot/kilobot_control.hpp"
#include "daemon/session/client_answers.hpp"
#include "daemon/session/client_identity.hpp"
#include "daemon/session/client_output.hpp"
#include "daemon/session/operations.hpp"

namespace swarmtalk::daemon {

class ClientOperations final : public CaptureListener, public KilobotClient {
 public:
  /// All must outlive it. @param operations, kilobots  null: such requests are refused
  ClientOperations(Operations* operations, KilobotControl* kilobots, const LimitsConfig& limits,
                   const ClientIdentity& client, const ClientOutput& output, ClientAnswers& answers)
      : operations_(operations),
        kilobots_(kilobots),
        limits_(limits),
        client_(client),
        output_(output),
        answers_(answers) {}

  /// Nothing is told from then on. Before the destructor.
  void leave();

  /// @return false, and nothing answered: no operator's request
  bool operate(const ipc::Envelope& request);
  /// Whether a reload was done for this client that began after all that has been read came.
  bool has_reloaded() const { return has_reloaded_; }
  /// More has been read.
  void forget_reload() { has_reloaded_ = false; }

  void begin_kilobot(const ipc::KilobotCommand& command);
  void cancel_kilobot(std::uint32_t operation_id);

  void on_captured(ipc::Captured& captured) override;
  void on_kilobot_progress(const ipc::KilobotProgress& progress) override;
  void on_kilobot_ended(const ipc::KilobotEnded& ended) override;

 private:
  std::optional<Refusal> reload(ipc::Reloaded& reply);

  Operations* operations_;
  KilobotControl* kilobots_;
  const LimitsConfig& limits_;
  const ClientIdentity& client_;
  const ClientOutput& output_;
  ClientAnswers& answers_;
  bool is_capturing_ = false;
  bool has_reloaded_ = false;
  ipc::Reloaded reloaded_;                 // what the last reload
  std::optional<Refusal> reload_refusal_;  // was answered
  std::uint32_t missed_frames_ = 0;        // of the capture, since the last one told
};

}  // namespace swarmtalk::daemon
