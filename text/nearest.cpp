#include "text/nearest.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <string_view>

namespace swarmtalk::text {
namespace {

constexpr std::size_t kShortWordBytes = 6;      // below: one letter
constexpr std::size_t kLongestWordBytes = 256;  // a longer one is not looked at

/// How many letters are to be changed, left out, added or swapped with the next to make one of the
/// other.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1);  // the row before the last
  std::vector<std::size_t> last(b.size() + 1);
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    before.swap(last);
    last.swap(row);
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      row[j + 1] = std::min({last[j] + (a[i] == b[j] ? 0 : 1), row[j] + 1, last[j + 1] + 1});
      const bool is_swapped = i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j];
      if (is_swapped) row[j + 1] = std::min(row[j + 1], before[j - 1] + 1);
    }
  }
  return row.back();
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

std::string nearest(const std::string& word, const std::vector<std::string>& known) {
  if (word.size() > kLongestWordBytes) return {};
  const std::size_t letters = word.size() - std::min(word.find_first_not_of('-'), word.size());
  std::size_t least = 1 + std::min<std::size_t>(letters < kShortWordBytes ? 1 : 2,
                                                letters < 3 ? 0 : (letters - 1) / 2);
  std::string found;
  for (const std::string& each : known) {
    if (each.size() >= word.size() + least || word.size() >= each.size() + least) continue;
    const std::size_t distance = edit_distance(word, each);
    if (distance >= least) continue;
    least = distance;
    found = each;
  }
  return found;
}

std::string nearest_channel(const std::string& name, const std::vector<std::string>& known) {
  std::vector<std::string> others;
  const std::string unnumbered = without_numbers(name);
  for (const std::string& each : known) {
    if (without_numbers(each) != unnumbered) others.push_back(each);
  }
  return nearest(name, others);
}

}  // namespace swarmtalk::text
