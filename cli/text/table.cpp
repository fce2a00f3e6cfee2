#include "cli/text/table.hpp"

#include <unistd.h>

#include <algorithm>
#include <numeric>

#include "cli/text/columns.hpp"
#include "text/plain.hpp"
#include "usage/terminal.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::size_t kGap = 2;
constexpr std::string_view kBold = "\033[1m";
constexpr std::string_view kYellow = "\033[33m";
constexpr std::string_view kUsual = "\033[0m";

std::vector<std::size_t> widths_of(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths(rows.front().size());
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
  }
  return widths;
}

std::string line_of(const Row& row, const std::vector<std::size_t>& widths) {
  std::string line;
  for (std::size_t i = 0; i < row.size(); ++i) {
    line += row[i] + std::string(widths[i] - width_of(row[i]) + kGap, ' ');
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

std::string blocks(const std::vector<Row>& rows, const Look& look) {
  const Row& headings = rows.front();
  std::string text;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (i > 1) text += "\n";
    for (std::size_t cell = 0; cell < headings.size(); ++cell) {
      if (rows[i][cell].empty()) continue;
      const std::string gap = headings[cell].empty() ? "" : "  ";
      const std::string lines = folded(headings[cell] + gap + rows[i][cell] + "\n", look);
      text += look.bold(headings[cell]) + lines.substr(headings[cell].size());
    }
  }
  return text;
}

}  // namespace

std::string Look::bold(const std::string& text) const {
  return has_colour && !text.empty() ? std::string(kBold) + text + std::string(kUsual) : text;
}

std::string Look::warning(const std::string& text) const {
  return has_colour && !text.empty() ? std::string(kYellow) + text + std::string(kUsual) : text;
}

std::string plain_lines(std::string_view text, const Look& look) {
  if (!look.has_colour) return text::plain_lines(text);
  std::string lines;
  std::size_t begin = 0;
  for (std::size_t at = text.find('\033'); at != std::string_view::npos;
       at = text.find('\033', at + 1)) {
    for (const std::string_view ours : {kBold, kYellow, kUsual}) {
      if (!text.substr(at).starts_with(ours)) continue;
      lines += text::plain_lines(text.substr(begin, at - begin));
      lines += ours;
      begin = at + ours.size();
    }
  }
  return lines + text::plain_lines(text.substr(begin));
}

std::string folded(const std::string& text, const Look& look) {
  return look.columns == 0 ? text : usage::wrapped(text, look.columns);
}

Look look_of_output() {
  return {usage::columns(STDOUT_FILENO), usage::has_colour(STDOUT_FILENO)};
}

std::string table(const std::vector<Row>& rows, const Look& look) {
  const auto widths = widths_of(rows);
  const std::size_t width =
      std::accumulate(widths.begin(), widths.end(), kGap * (widths.size() - 1));
  if (look.columns != 0 && width > look.columns) {
    return rows.size() > 1 ? blocks(rows, look) : folded(line_of(rows.front(), widths), look);
  }
  std::string text;
  for (const Row& row : rows) {
    const std::string line = line_of(row, widths);
    text += (&row == &rows.front() ? look.bold(line) : line) + "\n";
  }
  return text;
}

}  // namespace swarmtalk::cli
