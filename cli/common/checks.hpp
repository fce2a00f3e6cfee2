// What words of the command line may be: CLI11's checks, with messages that say what to write.
#pragma once

#include <CLI/CLI.hpp>
#include <string_view>

namespace swarmtalk::cli {

bool is_digits(std::string_view word);

/// Above 0; CLI11's own check prints the largest double there is.
CLI::Validator above_zero();
/// Digits only: CLI11 itself takes -1 for the largest number there is.
CLI::Validator whole_number();
/// A word that looks like a number must be a channel's number.
CLI::Validator channel();

}  // namespace swarmtalk::cli
