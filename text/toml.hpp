// The one way to include toml++. Debian's shared library is built with its assertions turned into
// promises to the compiler, and version 3.3 breaks some of them on malformed input (found by
// fuzzing). So the parser is compiled here, in toml.cpp, and an assertion that fails throws. What
// it calls unreachable is reached by characters beyond ASCII alone: toml_text.hpp.
#pragma once

#include <cassert>

namespace swarmtalk::text {

/// @throws std::logic_error
[[noreturn]] void fail_toml_assertion(const char* expression);

}  // namespace swarmtalk::text

#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_HEADER_ONLY 0
#define TOML_ASSERT(expression) \
  ((expression) ? static_cast<void>(0) : ::swarmtalk::text::fail_toml_assertion(#expression))
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")
#include <cassert>  // again: assert() as NDEBUG wants it
