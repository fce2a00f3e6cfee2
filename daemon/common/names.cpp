#include "daemon/common/names.hpp"

#include "text/plain.hpp"

namespace swarmtalk::daemon {

bool is_legal_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxNameBytes && text::is_plain_text(name);
}

}  // namespace swarmtalk::daemon
