#define TOML_IMPLEMENTATION
#include "daemon/config/toml.hpp"

#include <stdexcept>
#include <string>

namespace swarmtalk::daemon {

void fail_toml_assertion(const char* expression) {
  throw std::logic_error(std::string("toml++: ") + expression);
}

}  // namespace swarmtalk::daemon
