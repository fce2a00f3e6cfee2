#include "cli/common/checks.hpp"

#include <algorithm>

namespace swarmtalk::cli {

/// Above 0; CLI11's own check prints the largest double there is.
CLI::Validator above_zero() {
  const auto check = [](const std::string& word) {
    double value = 0;
    const bool is_good = CLI::detail::lexical_cast(word, value) && value > 0;
    return is_good ? std::string() : "must be a number above 0, not " + word;
  };
  return CLI::Validator(check, "");
}

bool is_digits(std::string_view word) {
  return !word.empty() && word.find_first_not_of("0123456789") == std::string_view::npos;
}

/// Digits only: CLI11 itself takes -1 for the largest number there is.
CLI::Validator whole_number() {
  const auto check = [](const std::string& word) {
    return is_digits(word) ? std::string() : "must be a whole number, 0 or more, not " + word;
  };
  return CLI::Validator(check, "");
}

/// A word that looks like a number must be a channel's number.
CLI::Validator channel() {
  const auto check = [](const std::string& word) {
    const bool is_negative = word.starts_with('-');
    const std::string digits = word.substr(is_negative ? 1 : 0);
    if (!is_digits(digits)) return std::string();
    const auto first = std::min(digits.find_first_not_of('0'), digits.size() - 1);
    const std::string number = digits.substr(first);
    const bool is_good = !is_negative && number.size() <= 5 && std::stoi(number) <= 65535;
    return is_good ? std::string() : "channel numbers go from 0 to 65535, not " + word;
  };
  return CLI::Validator(check, "");
}

}  // namespace swarmtalk::cli
