// What a wrong configuration is answered with.
#pragma once

#include <string>

#include "daemon/config/config_parser.hpp"

namespace swarmtalk::daemon {

/// @return the one line about "f.toml" with this text; empty if nothing is wrong with it
inline std::string error_of(const std::string& text) {
  try {
    parse_config(text, "f.toml");
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

}  // namespace swarmtalk::daemon
