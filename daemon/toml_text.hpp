// Looks at TOML before the parser does. TOML allows characters beyond ASCII in strings and comments
// only; the parser of Debian 12 (toml++ 3.3) has undefined behaviour on some of them elsewhere.
#pragma once

#include <string_view>

namespace swarmtalk::daemon {

/// Line, from 1, of the first byte beyond ASCII that is neither in a string nor in a comment. 0:
/// none.
unsigned first_line_with_stray_unicode(std::string_view text);

}  // namespace swarmtalk::daemon
