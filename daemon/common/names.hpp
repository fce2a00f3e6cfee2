// What may name a channel or a link, and the number that a channel's name alone gives.
#pragma once

#include <cstddef>
#include <string_view>

#include "text/channel_name.hpp"

namespace swarmtalk::daemon {

inline constexpr std::size_t kMaxNameBytes = 64;  // of a channel or a link

/// 1 to kMaxNameBytes bytes of plain text (text/plain.hpp): what may name a channel or a link.
/// Names that come from the air are held to it as well: they go on into the local protocol, which
/// takes UTF-8 only, and onto terminals.
bool is_legal_name(std::string_view name);

using text::hashed_channel;

}  // namespace swarmtalk::daemon
