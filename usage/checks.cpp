#include "usage/checks.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>

namespace swarmtalk::usage {
namespace {

/// A finite number that fills the word.
std::optional<double> finite(const std::string& word) {
  double value = 0;
  const char* const begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const char* const end = word.data() + word.size();
  const auto result = std::from_chars(begin, end, value);
  const bool is_good = result.ec == std::errc() && result.ptr == end && std::isfinite(value);
  return is_good ? std::optional(value) : std::nullopt;
}

std::string text_of(double value) {
  std::ostringstream text;
  text.precision(9);  // 1000000, not 1e+06
  text << value;
  return text.str();
}

std::string shown(const std::string& word) {
  return word.empty() ? "nothing" : word;
}

}  // namespace

bool is_digits(std::string_view word) {
  return !word.empty() && word.find_first_not_of("0123456789") == std::string_view::npos;
}

CLI::Validator any_number() {
  const auto check = [](const std::string& word) {
    return finite(word) ? std::string() : "must be a number, not " + shown(word);
  };
  return CLI::Validator(check, "");
}

CLI::Validator above_zero() {
  const auto check = [](const std::string& word) {
    const auto value = finite(word);
    return value && *value > 0 ? std::string() : "must be a number above 0, not " + shown(word);
  };
  return CLI::Validator(check, "");
}

CLI::Validator between(double least, double most) {
  const auto check = [least, most](const std::string& word) {
    const auto value = finite(word);
    if (value && *value >= least && *value <= most) return std::string();
    return "must be a number from " + text_of(least) + " to " + text_of(most) + ", not " +
           shown(word);
  };
  return CLI::Validator(check, "");
}

CLI::Validator whole_number(std::uint64_t most, std::uint64_t least) {
  const auto check = [most, least](const std::string& word) {
    std::uint64_t value = 0;
    const char* const end = word.data() + word.size();
    const bool is_number =
        is_digits(word) && std::from_chars(word.data(), end, value).ec == std::errc();
    if (is_number && value <= most && value >= least) return std::string();
    const std::string range = most == UINT64_MAX
                                  ? std::to_string(least) + " or more"
                                  : std::to_string(least) + " to " + std::to_string(most);
    return "must be a whole number, " + range + ", not " + shown(word);
  };
  return CLI::Validator(check, "");
}

CLI::Validator not_empty() {
  const auto check = [](const std::string& word) {
    return word.empty() ? std::string("must not be empty: leave it out, or write what it is")
                        : std::string();
  };
  return CLI::Validator(check, "");
}

CLI::Validator channel() {
  const auto check = [](const std::string& word) {
    if (word.empty()) return std::string("a channel has a name, or a number from 0 to 65535");
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

}  // namespace swarmtalk::usage
