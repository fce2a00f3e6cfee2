#include "daemon/operator/operator.hpp"

#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#include "daemon/common/logging.hpp"
#include "daemon/common/printable.hpp"
#include "daemon/config/key_file.hpp"
#include "daemon/host/privileges.hpp"
#include "daemon/operator/prometheus.hpp"
#include "daemon/station/link_factory.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::daemon {
namespace {

bool is_same(const std::shared_ptr<const frame::SwarmKey>& a,
             const std::shared_ptr<const frame::SwarmKey>& b) {
  if (a == nullptr || b == nullptr) return a == b;
  return std::memcmp(a->bytes(), b->bytes(), frame::SwarmKey::kBytes) == 0;
}

KeyPair find(const LinkKeys& keys, const std::string& link) {
  const auto found = keys.find(link);
  return found == keys.end() ? KeyPair{} : found->second;
}

bool has_prefix(const std::vector<std::string>& keys, const std::string& prefix) {
  return std::any_of(keys.begin(), keys.end(),
                     [&](const std::string& key) { return key.starts_with(prefix); });
}

}  // namespace

LinkKeys load_keys(const Config& config, const KeyLines& lines) {
  LinkKeys keys;
  for (const LinkConfig& link : config.links) {
    if (link.key_file.empty()) continue;
    try {
      keys[link.name].key = load_key(link.key_file);
    } catch (const std::exception& error) {
      throw lines.error("links." + link.name + ".key_file", error.what());
    }
    if (link.also_key_file.empty()) continue;
    try {
      keys[link.name].also = load_key(link.also_key_file);
    } catch (const std::exception& error) {
      throw lines.error("links." + link.name + ".also_key_file", error.what());
    }
  }
  return keys;
}

Operator::Operator(Parts parts, std::function<ParsedConfig()> load, std::function<Host()> look)
    : parts_(std::move(parts)), load_(std::move(load)), look_(std::move(look)) {}

std::shared_ptr<const frame::SwarmKey> Operator::key_of(const std::string& link) const {
  return find(parts_.keys, link).key;
}

std::shared_ptr<const frame::SwarmKey> Operator::also_key_of(const std::string& link) const {
  return find(parts_.keys, link).also;
}

void Operator::reload_on_signal() {
  ipc::Reloaded ignored;
  reload("SIGHUP", ignored);
}

std::uint32_t Operator::id_now() const {
  ipc::Hello hello;
  parts_.status.fill_hello(hello);
  return hello.node_id();
}

/// Applies the rule anew: the host may have another name or address, and then node.id has changed.
/// An address may be gone for a moment, which must not be in the way of other changes.
/// @return why the id stays as it is; empty: the rule gives one
std::string Operator::find_node_id(ParsedConfig& fresh, ConfigChanges& changes) const {
  NodeConfig& node = fresh.config.node;
  const NodeConfig& before = parts_.config.config.node;
  const bool is_same_rule = !has_prefix(changes.applied, "node.id");
  try {
    resolve_node_id(node, fresh.lines, look_);
  } catch (const ConfigError& error) {
    if (!is_same_rule || node.id_rule != NodeIdRule::kAddress) throw;
    node.id = before.id;
    node.id_source = before.id_source;
    return error.what();
  }
  if (is_same_rule && node.id != before.id) changes.applied.emplace_back("node.id");
  return {};
}

std::optional<Refusal> Operator::reload(const std::string& who, ipc::Reloaded& reply) {
  ConfigChanges changes;
  std::string what_else;
  try {
    ParsedConfig fresh = load_();
    LinkKeys keys = load_keys(fresh.config, fresh.lines);
    changes = compare(parts_.config.lines, fresh.lines);
    const std::string why_it_stays = find_node_id(fresh, changes);
    if (has_prefix(changes.applied, "node.id")) {
      const auto refusal = parts_.hub.set_node_id(fresh.config.node.id);
      if (refusal) throw fresh.lines.error("node.id", refusal->text);
      parts_.status.set_node_id_source(fresh.config.node.id_source);
      what_else = fmt::format("; this is now node {} ({})", id_now(), fresh.config.node.id_source);
    }
    if (!why_it_stays.empty()) {
      reply.set_node_id_stays(why_it_stays);
      what_else = fmt::format("; the node id stays {}: {}", id_now(), why_it_stays);
    }
    for (Station* station : parts_.hub.stations()) {
      const KeyPair pair = find(keys, station->name());
      const KeyPair before = find(parts_.keys, station->name());
      if (is_same(before.key, pair.key) && is_same(before.also, pair.also)) continue;
      station->link().set_also_key(pair.also);
      station->link().set_key(pair.key);
      const std::string changed = "links." + station->name() +
                                  (is_same(before.key, pair.key) ? ".also_key_file" : ".key_file");
      if (!has_prefix(changes.applied, changed)) changes.applied.push_back(changed);  // new content
    }
    parts_.keys = std::move(keys);
    if (has_keys()) forbid_dumps();
    apply(fresh, changes);
  } catch (const std::exception& error) {
    log_change(reload_log_, who,
               std::string("configuration not reloaded, nothing is changed: ") + error.what(),
               spdlog::level::err);
    return Refusal{ipc::ERROR_CONFIGURATION, std::string("nothing is changed: ") + error.what(),
                   std::nullopt};
  }
  for (const std::string& key : changes.applied) reply.add_applied(key);
  for (const std::string& key : changes.need_restart) reply.add_needs_restart(key);
  const std::string applied =
      fmt::format("configuration reloaded; {}{}{}",
                  changes.applied.empty() ? "nothing new applies" : "now applies: ",
                  fmt::join(changes.applied, ", "), what_else);
  const bool is_logged =
      log_change(reload_log_, who, applied,
                 reply.has_node_id_stays() ? spdlog::level::warn : spdlog::level::info);
  if (is_logged && !changes.need_restart.empty()) {
    log_of("daemon")->warn("configuration: these need a restart: {}",
                           fmt::join(changes.need_restart, ", "));
  }
  return std::nullopt;
}

std::optional<Refusal> Operator::check_configuration(ipc::Reloaded& reply) {
  ConfigChanges changes;
  try {
    ParsedConfig fresh = load_();
    load_keys(fresh.config, fresh.lines);
    changes = compare(parts_.config.lines, fresh.lines);
    const std::string why_it_stays = find_node_id(fresh, changes);
    if (!why_it_stays.empty()) reply.set_node_id_stays(why_it_stays);
  } catch (const std::exception& error) {
    return Refusal{ipc::ERROR_CONFIGURATION, error.what(), std::nullopt};
  }
  for (const std::string& key : changes.applied) reply.add_applied(key);
  for (const std::string& key : changes.need_restart) reply.add_needs_restart(key);
  return std::nullopt;
}

// Who asks for changes all the time must not fill the disk with them.
bool Operator::log_change(LogLimiter& limiter, const std::string& who, const std::string& what,
                          spdlog::level::level_enum level) {
  const auto silent = limiter.pass(loop::now());
  if (!silent) return false;
  const std::string more =
      *silent == 0 ? "" : " (" + std::to_string(*silent) + " more since the last line)";
  log_of("daemon")->log(level, "{}: {}{}", who, what, more);
  return true;
}

void Operator::apply(const ParsedConfig& fresh, const ConfigChanges& changes) {
  Config& config = parts_.config.config;
  const auto is_changed = [&](const char* prefix) { return has_prefix(changes.applied, prefix); };
  if (is_changed("node.pose") && fresh.config.node.pose != config.node.pose) {
    if (const auto& pose = fresh.config.node.pose) {
      parts_.poses.set(pose->x_m, pose->y_m, pose->theta_rad, std::nullopt);
    } else {
      parts_.poses.forget(*config.node.pose);
    }
  }
  parts_.poses.set_max_age_ms(fresh.config.node.pose_max_age_ms);
  if (is_changed("channels.")) parts_.names.configure(fresh.config.channels);
  if (is_changed("channels.") || is_changed("reserved.")) {
    parts_.hub.set_reserved(fresh.config.reserved, how_to_change(fresh));
  }
  if (is_changed("log.")) {
    daemon::set_log_level("", fresh.config.log_level);
    for (const auto& [subsystem, level] : fresh.config.log_levels) {
      daemon::set_log_level(subsystem, level);
    }
  }
  parts_.metrics.configure(fresh.config.metrics);
  for (const LinkConfig& link : fresh.config.links) {
    if (!is_changed(("links." + link.name + ".").c_str())) continue;
    for (Station* station : parts_.hub.stations()) {
      if (station->name() != link.name) continue;
      station->link().set_pacing(pacing_of(link));
      station->link().set_air_rate(link.air_rate_mbps);
      station->link().set_beacon(std::chrono::milliseconds(link.beacon_ms));
      station->set_virtual_range(link.virtual_range);
      station->set_ghosts(link.hears_ghosts);
      station->set_forwarding(link.forwarding);
    }
  }
  config.node = fresh.config.node;
  config.channels = fresh.config.channels;
  config.limits = fresh.config.limits;
  config.log_level = fresh.config.log_level;
  config.log_levels = fresh.config.log_levels;
  config.metrics = fresh.config.metrics;
  config.reserved = fresh.config.reserved;
  // What needs a restart stays different until then, so that the next reload tells it again.
  KeyLines lines = fresh.lines;
  for (const std::string& key : changes.need_restart) lines.keep_value(key, parts_.config.lines);
  parts_.config.lines = std::move(lines);
}

std::optional<Refusal> Operator::set_log_level(const std::string& who,
                                               const ipc::SetLogLevel& request) {
  if (!request.has_level()) return std::nullopt;
  if (!daemon::set_log_level(request.subsystem(), request.level())) {
    return Refusal{ipc::ERROR_BAD_ARGUMENT,
                   fmt::format("subsystems are {}; levels are {}", fmt::join(kSubsystems, ", "),
                               fmt::join(kLogLevels, ", ")),
                   std::nullopt};
  }
  log_change(level_log_, who,
             fmt::format("log level of {} is now {}",
                         request.has_subsystem() ? request.subsystem() : "all subsystems",
                         request.level()));
  return std::nullopt;
}

void Operator::fill_log_levels(ipc::LogLevels& reply) {
  for (const auto& [subsystem, level] : log_levels()) {
    ipc::LogLevel& entry = *reply.add_levels();
    entry.set_subsystem(subsystem);
    entry.set_level(level);
  }
}

std::optional<Refusal> Operator::set_node_id(const std::string& who,
                                             std::optional<std::uint32_t> node_id) {
  if (node_id && (*node_id < kNodeIdLimits.least || *node_id > kNodeIdLimits.most)) {
    return Refusal{ipc::ERROR_BAD_ARGUMENT, "a node id is 1 to 65534, or automatic", std::nullopt};
  }
  std::optional<std::uint16_t> id;
  if (node_id) id = static_cast<std::uint16_t>(*node_id);
  if (auto refusal = parts_.hub.set_node_id(id)) return refusal;
  const char* source = id ? "set by swarmtalk-cli node-id" : kIdByChance;
  parts_.status.set_node_id_source(source);
  log_change(id_log_, who, fmt::format("node id is now {} ({})", id_now(), source));
  return std::nullopt;
}

void Operator::start_capture(const std::string& who, CaptureListener& listener) {
  parts_.capture.add(listener);
  log_change(capture_log_, who, "captures all frames");
}

void Operator::stop_capture(CaptureListener& listener) {
  parts_.capture.remove(listener);
}

void Operator::fill_metrics(ipc::Metrics& reply) {
  ipc::Status status;
  parts_.status.fill_status(status);
  reply.set_text(prometheus_text(status));
}

}  // namespace swarmtalk::daemon
