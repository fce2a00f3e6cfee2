#define TOML_IMPLEMENTATION
#include "text/toml.hpp"

#include <stdexcept>
#include <string>

namespace swarmtalk::text {

void fail_toml_assertion(const char* expression) {
  throw std::logic_error(std::string("toml++: ") + expression);
}

}  // namespace swarmtalk::text
