// Operator: changes the running daemon as its operator asks, by SIGHUP or over the socket. Reads
// the configuration again, applies what can be applied, and says what needs a restart.
#pragma once

#include <spdlog/common.h>

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "daemon/common/log_limiter.hpp"
#include "daemon/config/config_changes.hpp"
#include "daemon/config/config_parser.hpp"
#include "daemon/config/node_id_rule.hpp"
#include "daemon/hub/channel_table.hpp"
#include "daemon/hub/hub.hpp"
#include "daemon/operator/capture.hpp"
#include "daemon/operator/metrics_file.hpp"
#include "daemon/operator/status_report.hpp"
#include "daemon/pose/pose_keeper.hpp"
#include "daemon/session/operations.hpp"

namespace swarmtalk::daemon {

/// Swarm keys by the name of their link. Links without one have no entry.
struct KeyPair {
  std::shared_ptr<const frame::SwarmKey> key;
  std::shared_ptr<const frame::SwarmKey> also;  // null: none
};
using LinkKeys = std::map<std::string, KeyPair>;

/// @throws ConfigError  a key file that is missing or not safe
LinkKeys load_keys(const Config& config, const KeyLines& lines);

class Operator final : public Operations {
 public:
  /// What it changes. All references must outlive it.
  struct Parts {
    ParsedConfig& config;  // in force; the limits in it are read where they count
    LinkKeys keys;         // in force
    Hub& hub;
    PoseKeeper& poses;
    ChannelTable& names;
    StatusReport& status;
    MetricsFile& metrics;
    Capture& capture;
  };
  /// @param load  reads the configuration file again, with the command line's options on top;
  ///   throws ConfigError
  /// @param look  at what node.id may be taken from
  Operator(Parts parts, std::function<ParsedConfig()> load,
           std::function<Host()> look = look_at_host);

  /// Key of a link; null: none.
  std::shared_ptr<const frame::SwarmKey> key_of(const std::string& link) const;
  /// The other key whose frames it takes; null: none.
  std::shared_ptr<const frame::SwarmKey> also_key_of(const std::string& link) const;

  /// Whether some link has a key.
  bool has_keys() const { return !parts_.keys.empty(); }

  /// As asked by a signal: answers go to the log only.
  void reload_on_signal();

  std::optional<Refusal> reload(const std::string& who, ipc::Reloaded& reply) override;
  std::optional<Refusal> check_configuration(ipc::Reloaded& reply) override;
  std::optional<Refusal> set_log_level(const std::string& who,
                                       const ipc::SetLogLevel& request) override;
  void fill_log_levels(ipc::LogLevels& reply) override;
  std::optional<Refusal> set_node_id(const std::string& who,
                                     std::optional<std::uint32_t> node_id) override;
  void fill_metrics(ipc::Metrics& reply) override;
  void start_capture(const std::string& who, CaptureListener& listener) override;
  void stop_capture(CaptureListener& listener) override;

 private:
  std::uint32_t id_now() const;
  bool log_change(LogLimiter& limiter, const std::string& who, const std::string& what,
                  spdlog::level::level_enum level = spdlog::level::info);
  std::string find_node_id(ParsedConfig& fresh, ConfigChanges& changes) const;
  void apply(const ParsedConfig& fresh, const ConfigChanges& changes);

  Parts parts_;
  std::function<ParsedConfig()> load_;
  std::function<Host()> look_;
  // So many changes at once are told one by one, then one a second.
  LogLimiter reload_log_{kLinesAtOnce};
  LogLimiter level_log_{kLinesAtOnce};
  LogLimiter id_log_{kLinesAtOnce};
  LogLimiter capture_log_{kLinesAtOnce};

  static constexpr std::uint32_t kLinesAtOnce = 10;
};

}  // namespace swarmtalk::daemon
