// Reads a configuration file (TOML) into a Config. Called once at start, before the event loop.
// Looks at the file only: whether an interface or a folder exists is found out when it is opened.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"

namespace swarmtalk::daemon {

struct ParsedConfig {
  Config config;
  KeyLines lines;
};

/// What the command line says instead of the file.
struct ConfigOptions {
  std::optional<std::string> socket_path;  // --socket
  std::optional<std::string> node_id;      // --node-id
  std::optional<std::string> log_level;    // --log-level, a legal one
};

/// @param file  name for messages
/// @throws ConfigError  "FILE:LINE: key 'x': what is wrong; remedy", for the first thing wrong; an
///   option in place of "FILE:LINE: key 'x'" for what it says
ParsedConfig parse_config(std::string_view text, const std::string& file,
                          const ConfigOptions& options = {});

/// For a user who is to change a key: "FILE, then: swarmtalk-cli reload", of this daemon.
std::string how_to_change(const ParsedConfig& parsed);

/// What is wrong with a path for a Unix socket, with the remedy. Empty: nothing.
std::string socket_path_problem(const std::string& path);

/// @throws ConfigError  also when the file cannot be read, or is larger than 1 MiB
ParsedConfig load_config(const std::string& file, const ConfigOptions& options = {});

}  // namespace swarmtalk::daemon
