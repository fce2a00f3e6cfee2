// Fuzz target: any bytes as a configuration file. It is accepted or refused with one line; nothing
// else is thrown and nothing is read or written out of bounds.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/config/config_parser.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace swarmtalk::daemon;
  try {
    parse_config({reinterpret_cast<const char*>(bytes), size}, "f.toml");
  } catch (const ConfigError& error) {
    if (std::string_view(error.what()).find('\n') != std::string_view::npos) std::abort();
  }
  return 0;
}
