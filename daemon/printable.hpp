// Text that came from outside, made fit for a log line or an error line; and what may be a name.
#pragma once

#include <string>
#include <string_view>

namespace swarmtalk::daemon {

/// Keeps one line one line, and UTF-8, which the local protocol and the journal want: control
/// characters and bytes that are none become '?'. After at most `most_bytes`, between two
/// characters, it is cut.
std::string printable(std::string_view text, std::size_t most_bytes = 60);

/// 1 to kMaxNameBytes bytes without control characters: what may name a channel or a link.
bool is_legal_name(std::string_view name);

}  // namespace swarmtalk::daemon
