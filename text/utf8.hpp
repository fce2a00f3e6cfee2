// UTF-8 as RFC 3629 has it: no surrogates, nothing above U+10FFFF, no overlong form. The local
// protocol carries names as such text only. Pure functions, used by daemon, client library and CLI.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace swarmtalk::text {

/// The code point at `at`, which is moved behind it; nullopt, and `at` unchanged, if it is not
/// well-formed. `at` must be smaller than the size.
std::optional<std::uint32_t> next_code_point(std::string_view bytes, std::size_t& at);

bool is_utf8(std::string_view bytes);

}  // namespace swarmtalk::text
