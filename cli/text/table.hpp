// Tables for people, as wide as their terminal.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace swarmtalk::cli {

/// How output is shown where it goes.
struct Look {
  std::size_t columns = 0;  // 0: any number
  bool has_colour = false;

  std::string bold(const std::string& text) const;
  std::string warning(const std::string& text) const;
};

/// Of our standard output.
Look look_of_output();

/// Lines as wide as the terminal; what is indented stays so. Without colours in it.
std::string folded(const std::string& text, const Look& look);

/// Lines of which what is not plain (text/plain.hpp) is escaped, whoever wrote it; of a Look with
/// colours its bold and warning stay.
std::string plain_lines(std::string_view text, const Look& look);

using Row = std::vector<std::string>;

/// Columns as wide as their widest cell, two spaces apart. The first row has the headings. One that
/// is wider than the terminal has a block of lines for each row instead, a heading and a cell each.
std::string table(const std::vector<Row>& rows, const Look& look = {});

}  // namespace swarmtalk::cli
