// Text that came from outside, made fit for a log line or an error line.
#pragma once

#include <string>
#include <string_view>

namespace swarmtalk::daemon {

/// Keeps one line one line, and UTF-8, which the local protocol and the journal want: what is not
/// plain (text/plain.hpp) becomes '?'. After at most `most_bytes`, between two characters, it is
/// cut. Quotes stay: around a name of somebody else's text::quoted() escapes them.
std::string printable(std::string_view text, std::size_t most_bytes = 60);

}  // namespace swarmtalk::daemon
