// KilobotControl: commands of clients (`swarmtalk-cli kilobot`) to the Kilobots of a link: checks
// them, turns them into frame sequences, and tells the client how far they are. One command at a
// time and link. Robots answer nothing, so the end of a command says what was sent and no more.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/message/refusal.hpp"
#include "ipc/framing.hpp"
#include "kilobot_bridge/kilobot_link.hpp"

namespace swarmtalk::daemon {

/// Who gave a command: a session. Called after begin() has returned.
class KilobotClient {
 public:
  virtual ~KilobotClient() = default;
  virtual void on_kilobot_progress(const ipc::KilobotProgress& progress) = 0;
  virtual void on_kilobot_ended(const ipc::KilobotEnded& ended) = 0;
};

class KilobotControl {
 public:
  KilobotControl();
  ~KilobotControl();

  /// Both must outlive this object's use.
  void add(const std::string& name, kilobot_bridge::KilobotLink& link);

  /// @return none: begun, `started` is filled, and one on_kilobot_ended() follows
  std::optional<Refusal> begin(const ipc::KilobotCommand& command, KilobotClient& client,
                               ipc::KilobotStarted& started);
  /// Stops a command of this client's own.
  std::optional<Refusal> cancel(std::uint32_t operation_id, const KilobotClient& client);
  /// The client is gone: its command is stopped.
  void forget(const KilobotClient& client);

 private:
  class LinkCommands;  // one link

  std::optional<Refusal> find(const ipc::KilobotCommand& command, LinkCommands*& found) const;

  std::vector<std::unique_ptr<LinkCommands>> links_;
  std::uint32_t last_operation_id_ = 0;
};

}  // namespace swarmtalk::daemon
