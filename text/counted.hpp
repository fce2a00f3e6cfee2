// A number and what is counted, for a sentence: "1 message", "2 messages".
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace swarmtalk::text {

/// @param thing  one of them; the plural has an s behind it, unless `things` says another
inline std::string counted(std::uint64_t number, std::string_view thing,
                           std::string_view things = {}) {
  std::string text = std::to_string(number) + " ";
  if (number == 1) return text.append(thing);
  return things.empty() ? text.append(thing).append("s") : text.append(things);
}

}  // namespace swarmtalk::text
