// What numbers on a command line may be, the same in all our programs: CLI11's checks, with
// messages that say what to write. CLI11 itself takes inf, nan, 1e400 and, for whole numbers, -1.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <string_view>

namespace swarmtalk::usage {

bool is_digits(std::string_view word);

/// Any finite number.
CLI::Validator any_number();
/// A finite number above 0.
CLI::Validator above_zero();
/// A finite number from `least` to `most`.
CLI::Validator between(double least, double most);
/// Digits only, and a number up to `most`.
CLI::Validator whole_number(std::uint64_t most = UINT64_MAX, std::uint64_t least = 0);
/// Any text with a character in it: an empty one is mostly a shell's variable that is not set.
CLI::Validator not_empty();
/// A channel: a name, or a number from 0 to 65535.
CLI::Validator channel();

}  // namespace swarmtalk::usage
