#include "text/nearest.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace swarmtalk::text {
namespace {

constexpr std::size_t kShortNameBytes = 6;      // below: one letter
constexpr std::size_t kLongestNameBytes = 256;  // a longer one is not looked at

std::string nearest_within(const std::string& word, const std::vector<std::string>& known,
                           std::size_t most) {
  std::string found;
  std::size_t least = most + 1;
  for (const std::string& each : known) {
    const std::size_t distance = edit_distance(word, each);
    if (distance >= least || distance >= each.size()) continue;
    least = distance;
    found = each;
  }
  return found;
}

/// "robot" of "robot_12" and "robot3".
std::string without_numbers(const std::string& name) {
  constexpr std::string_view kBeforeANumber = "_./-";
  std::string rest;
  bool is_in_number = false;
  for (const char letter : name) {
    const bool is_digit = letter >= '0' && letter <= '9';
    if (is_digit && !is_in_number) {
      while (!rest.empty() && kBeforeANumber.find(rest.back()) != std::string_view::npos) {
        rest.pop_back();
      }
    }
    is_in_number = is_digit;
    if (!is_digit) rest.push_back(letter);
  }
  return rest;
}

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({substituted, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string nearest(const std::string& word, const std::vector<std::string>& known) {
  return nearest_within(word, known, std::max<std::size_t>(2, word.size() / 4));
}

std::string nearest_channel(const std::string& name, const std::vector<std::string>& known) {
  if (name.size() > kLongestNameBytes) return {};
  std::vector<std::string> others;
  const std::string unnumbered = without_numbers(name);
  for (const std::string& each : known) {
    const bool is_other = each.size() <= kLongestNameBytes && without_numbers(each) != unnumbered;
    if (is_other) others.push_back(each);
  }
  return nearest_within(name, others, name.size() < kShortNameBytes ? 1 : 2);
}

}  // namespace swarmtalk::text
