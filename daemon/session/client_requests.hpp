// ClientRequests: what each request of one client does and how it is answered (ipc.proto). It hands
// on what ClientChannels and ClientOperations do. On the daemon's thread.
#pragma once

#include <optional>
#include <string>

#include "daemon/common/daemon_counters.hpp"
#include "daemon/pose/pose_keeper.hpp"
#include "daemon/session/client_answers.hpp"
#include "daemon/session/client_channels.hpp"
#include "daemon/session/client_identity.hpp"
#include "daemon/session/client_operations.hpp"
#include "ipc/ipc.pb.h"

namespace swarmtalk::daemon {

/// What a session tells about the daemon as a whole.
class StatusSource {
 public:
  virtual ~StatusSource() = default;
  virtual void fill_hello(ipc::Hello& hello) = 0;
  virtual void fill_status(ipc::Status& status) = 0;
  virtual void fill_neighbours(ipc::Neighbours& reply) = 0;
};

/// Why nothing more of this client is read.
struct StreamEnd {
  ipc::ErrorCode code;
  std::string text;
  bool is_malformed;
};

/// The robot's own pose: of one that is too old its age, who told it and the limit only.
void fill_own_pose(const PoseKeeper& poses, ipc::Pose& reply);

class ClientRequests {
 public:
  /// All references must outlive it.
  ClientRequests(StatusSource& status, PoseKeeper& poses, const Shares& shares,
                 DaemonCounters& counters, ClientIdentity& client, ClientAnswers& answers,
                 ClientChannels& channels, ClientOperations& operations)
      : status_(status),
        poses_(poses),
        shares_(shares),
        counters_(counters),
        client_(client),
        answers_(answers),
        channels_(channels),
        operations_(operations) {}

  /// Does and answers one request. @param requests_left  in this turn; a costly one takes several
  /// @return none: go on reading
  std::optional<StreamEnd> handle(const ipc::Envelope& request, int& requests_left);

  bool has_greeted() const { return has_greeted_; }

 private:
  std::optional<Refusal> check_rate(const ipc::Envelope& request, int cost);
  void answer(const ipc::Envelope& request);
  std::optional<StreamEnd> greet(const ipc::Hello& hello);
  void set_pose(const ipc::SetPose& request);
  void get_pose();

  StatusSource& status_;
  PoseKeeper& poses_;
  const Shares& shares_;
  DaemonCounters& counters_;
  ClientIdentity& client_;
  ClientAnswers& answers_;
  ClientChannels& channels_;
  ClientOperations& operations_;
  bool has_greeted_ = false;
};

}  // namespace swarmtalk::daemon
