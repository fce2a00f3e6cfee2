// Operations: what an operator may ask of the running daemon over the socket. Operator implements
// it; sessions call it. Whoever may connect may ask; each change is logged with who asked.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/message/refusal.hpp"
#include "ipc/ipc.pb.h"

namespace swarmtalk::daemon {

/// A client that asked for a capture.
class CaptureListener {
 public:
  virtual ~CaptureListener() = default;
  /// @param captured  filled but for `missed`; valid during the call only
  virtual void on_captured(ipc::Captured& captured) = 0;
};

class Operations {
 public:
  virtual ~Operations() = default;

  // Each returns none when done. @param who  for the log: "client 'x' (pid 1, uid 0)"
  virtual std::optional<Refusal> reload(const std::string& who, ipc::Reloaded& reply) = 0;
  /// What a reload would do. Changes nothing.
  virtual std::optional<Refusal> check_configuration(ipc::Reloaded& reply) = 0;
  virtual std::optional<Refusal> set_log_level(const std::string& who,
                                               const ipc::SetLogLevel& request) = 0;
  virtual void fill_log_levels(ipc::LogLevels& reply) = 0;
  virtual std::optional<Refusal> set_node_id(const std::string& who,
                                             std::optional<std::uint32_t> node_id) = 0;
  virtual void fill_metrics(ipc::Metrics& reply) = 0;
  /// Until stop_capture(), which may be called for one that is not there.
  virtual void start_capture(const std::string& who, CaptureListener& listener) = 0;
  virtual void stop_capture(CaptureListener& listener) = 0;
};

}  // namespace swarmtalk::daemon
