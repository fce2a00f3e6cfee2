#include "text/channel_name.hpp"

namespace swarmtalk::text {

std::uint16_t hashed_channel(std::string_view name) {
  std::uint32_t hash = 2166136261u;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
  return static_cast<std::uint16_t>(0x8000u | ((hash >> 16 ^ hash) & 0x7FFFu));
}

}  // namespace swarmtalk::text
