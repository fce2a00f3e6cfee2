#include "daemon/common/names.hpp"

#include "text/plain.hpp"

namespace swarmtalk::daemon {

bool is_legal_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxNameBytes && text::is_plain_text(name);
}

std::uint16_t hashed_channel(std::string_view name) {
  std::uint32_t hash = 2166136261u;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
  return static_cast<std::uint16_t>(0x8000u | ((hash >> 16 ^ hash) & 0x7FFFu));
}

}  // namespace swarmtalk::daemon
