#include "daemon/pose/pose_text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace swarmtalk::daemon {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

// The next word of the text, which loses it. Empty: there is none.
std::string_view take_word(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(kBlanks));
  text.remove_prefix(word.size());
  return word;
}

std::optional<double> number(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  if (!std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace

std::optional<PoseText> parse_pose_text(std::string_view text) {
  if (text.size() > kMaxPoseTextBytes) return std::nullopt;
  PoseText pose;
  for (double* each : {&pose.x_m, &pose.y_m, &pose.theta_rad}) {
    const auto value = number(take_word(text));
    if (!value) return std::nullopt;
    *each = *value;
  }
  if (const std::string_view word = take_word(text); !word.empty()) {
    const auto age_s = number(word);
    if (!age_s || *age_s < 0.0) return std::nullopt;
    pose.age_s = *age_s;
  }
  if (!take_word(text).empty()) return std::nullopt;
  return pose;
}

}  // namespace swarmtalk::daemon
