#include "cli/text/columns.hpp"

#include <algorithm>

namespace swarmtalk::cli {
namespace {

constexpr std::size_t kColumnGap = 2;
constexpr std::size_t kLeftOutWidth = 4;  // " +12", after the head

bool begins_character(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0) != 0x80;
}

}  // namespace

std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), begins_character));
}

std::string clip(std::string_view text, std::size_t width) {
  if (width_of(text) <= width) return std::string(text);
  if (width == 0) return {};
  std::size_t at = 0;
  for (std::size_t seen = 0; at < text.size(); ++at) {
    if (begins_character(text[at]) && seen++ == width - 1) break;
  }
  return std::string(text.substr(0, at)) + "~";
}

std::vector<std::string> columns(const std::vector<std::vector<std::string>>& rows,
                                 std::string_view alignment, std::size_t width) {
  std::vector<std::size_t> widths(alignment.size());
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < widths.size(); ++i) {
      widths[i] = std::max(widths[i], width_of(row[i]));
    }
  }
  // The first keeps at least a third, the others go from the right until they fit.
  const std::size_t first_least = std::min(widths[0], width / 3);
  std::size_t shown = widths.size();
  const auto sum = [&](std::size_t count) {
    std::size_t total = first_least;
    for (std::size_t i = 1; i < count; ++i) total += kColumnGap + widths[i];
    return total;
  };
  const auto is_too_wide = [&] {
    return sum(shown) + (shown < widths.size() ? kLeftOutWidth : 0) > width;
  };
  while (shown > 1 && is_too_wide()) --shown;
  const std::size_t used = sum(shown) + (shown < widths.size() ? kLeftOutWidth : 0);
  widths[0] = std::min(widths[0], first_least + (width - std::min(width, used)));
  std::vector<std::string> lines;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < shown; ++i) {
      const std::string cell = clip(row[i], widths[i]);
      const std::string space(widths[i] - width_of(cell), ' ');
      line += (i == 0 ? "" : std::string(kColumnGap, ' ')) +
              (alignment[i] == 'r' ? space + cell : cell + space);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    if (lines.empty() && shown < widths.size()) {
      const std::size_t room = width - std::min(width, width_of(line));
      line += clip(" +" + std::to_string(widths.size() - shown), room);
    }
    lines.push_back(line);
  }
  return lines;
}

}  // namespace swarmtalk::cli
