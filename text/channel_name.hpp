// The number that a channel's name alone gives: the daemon's, and of whoever has only a name to
// look for. A name in the configuration's [channels] has the number given there instead.
#pragma once

#include <cstdint>
#include <string_view>

namespace swarmtalk::text {

/// 0x8000 | 15 bits of the name's 32-bit FNV-1a hash, upper half folded onto the lower
/// (docs/configuration.md).
std::uint16_t hashed_channel(std::string_view name);

}  // namespace swarmtalk::text
