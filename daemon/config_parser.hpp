// Reads a configuration file (TOML) into a Config. Called once at start, before the event loop.
// Looks at the file only: whether an interface or a folder exists is found out when it is opened.
#pragma once

#include <string>
#include <string_view>

#include "daemon/config.hpp"
#include "daemon/config_error.hpp"

namespace swarmtalk::daemon {

struct ParsedConfig {
  Config config;
  KeyLines lines;
};

/// @param file  name for messages
/// @throws ConfigError  "FILE:LINE: key 'x': what is wrong; remedy", for the first thing wrong
ParsedConfig parse_config(std::string_view text, const std::string& file);

/// What is wrong with a path for a Unix socket, with the remedy. Empty: nothing.
std::string socket_path_problem(const std::string& path);

/// @throws ConfigError  also when the file cannot be read, or is larger than 1 MiB
ParsedConfig load_config(const std::string& file);

}  // namespace swarmtalk::daemon
