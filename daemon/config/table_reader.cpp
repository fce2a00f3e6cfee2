#include "daemon/config/table_reader.hpp"

#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "daemon/common/names.hpp"
#include "text/nearest.hpp"

namespace swarmtalk::daemon {
namespace {

std::string listed(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, ", "));
}

// The nearest known key, or all of them when none is near.
std::string suggestion(const std::string& key, const std::vector<std::string>& known) {
  const std::string near = text::nearest(key, known);
  return near.empty() ? "known here: " + listed(known) : "did you mean '" + near + "'?";
}

std::string shown(const toml::node& node) {
  if (node.is_table()) return "a table";
  if (node.is_array()) return "an array";
  if (node.is_string()) return "the text \"" + printable(**node.as_string()) + "\"";
  std::ostringstream text;
  node.visit([&](const auto& value) {
    if constexpr (toml::is_value<decltype(value)>) text << value;
  });
  return printable(text.str());
}

std::string inline_toml(const toml::node& node);

/// "a, b" of the texts that `text_of` makes of each in `range`.
template <typename Range, typename TextOf>
std::string joined(const Range& range, const TextOf& text_of) {
  std::string text;
  for (const auto& each : range) text += (text.empty() ? "" : ", ") + text_of(each);
  return text;
}

/// On one line. Arrays and tables by ourselves: toml++ counts columns with the logarithm of a
/// number, which below 1 is none that a size can have.
std::string inline_toml(const toml::node& node) {
  if (const toml::array* array = node.as_array()) return "[" + joined(*array, inline_toml) + "]";
  if (const toml::table* table = node.as_table()) {
    return "{" +
           joined(*table,
                  [](const auto& entry) {
                    return std::string(entry.first.str()) + " = " + inline_toml(entry.second);
                  }) +
           "}";
  }
  std::ostringstream text;
  node.visit([&](const auto& value) {
    if constexpr (toml::is_value<decltype(value)>) text << value;
  });
  return text.str();
}

/// Empty: a section.
std::string as_toml(const toml::node& node) {
  return node.is_table() ? "" : inline_toml(node);
}

std::string shown(double number) {
  std::ostringstream text;
  text << number;
  return text.str();
}

}  // namespace

TableReader::TableReader(const toml::table& table, std::string path, KeyLines& lines)
    : table_(table), path_(std::move(path)), lines_(lines) {
  if (!path_.empty() && table.source().begin) lines_.set(path_, table.source().begin.line);
  for (const auto& [key, node] : table) {
    lines_.set(full(std::string(key.str())), key.source().begin.line, as_toml(node));
  }
}

std::string TableReader::full(const std::string& key) const {
  return path_.empty() ? printable(key) : path_ + "." + printable(key);
}

void TableReader::expect_keys(const std::vector<std::string>& known) const {
  const toml::key* first = nullptr;
  for (const auto& [key, node] : table_) {
    if (std::find(known.begin(), known.end(), key.str()) != known.end()) continue;
    if (first == nullptr || key.source().begin < first->source().begin) first = &key;
  }
  if (first == nullptr) return;
  fail(std::string(first->str()), "is not known; " + suggestion(std::string(first->str()), known));
}

bool TableReader::integer(const std::string& key, IntegerLimits limits, std::int64_t& value) const {
  const toml::node* node = table_.get(key);
  if (node == nullptr) return false;
  const std::string range = std::to_string(limits.least) + " to " + std::to_string(limits.most);
  if (!node->is_integer()) fail_type(key, "an integer from " + range);
  value = **node->as_integer();
  if (value < limits.least || value > limits.most) {
    fail(key, std::to_string(value) + " is out of range; use " + range);
  }
  return true;
}

void TableReader::read_number(const std::string& key, double least, double most,
                              double& value) const {
  const toml::node* node = table_.get(key);
  if (node == nullptr) return;
  const std::string range = shown(least) + " to " + shown(most);
  if (!node->is_number()) fail_type(key, "a number from " + range);
  const double number = *node->value<double>();
  if (!(number >= least && number <= most)) {
    fail(key, shown(*node) + " is out of range; use " + range);
  }
  value = number;
}

void TableReader::read_text(const std::string& key, std::string& value) const {
  const toml::node* node = table_.get(key);
  if (node == nullptr) return;
  if (!node->is_string()) fail_type(key, "text in double quotes");
  value = **node->as_string();
  if (value.find('\0') != std::string::npos) fail(key, "contains a zero byte; remove it");
}

void TableReader::read_bool(const std::string& key, bool& value) const {
  const toml::node* node = table_.get(key);
  if (node == nullptr) return;
  if (!node->is_boolean()) fail_type(key, "true or false");
  value = **node->as_boolean();
}

std::vector<double> TableReader::read_numbers(const std::string& key, std::size_t count,
                                              const std::string& form) const {
  const toml::array* array = node(key).as_array();
  std::vector<double> numbers;
  if (array == nullptr || array->size() != count) {
    fail(key, "is not an array of " + std::to_string(count) + " numbers; write " + form);
  }
  for (const toml::node& element : *array) {
    const double number = element.is_number() ? *element.value<double>() : NAN;
    if (!std::isfinite(number)) fail(key, shown(element) + " is not a number; write " + form);
    numbers.push_back(number);
  }
  return numbers;
}

int TableReader::read_choice(const std::string& key, std::span<const char* const> choices) const {
  if (!has(key)) return -1;
  std::vector<std::string> quoted;
  for (const char* choice : choices) quoted.push_back("\"" + std::string(choice) + "\"");
  if (!table_.get(key)->is_string()) fail_type(key, "one of " + listed(quoted));
  const std::string& value = **table_.get(key)->as_string();
  const auto found = std::find(choices.begin(), choices.end(), value);
  if (found == choices.end()) {
    fail(key, "\"" + printable(value) + "\" is not known; use one of " + listed(quoted));
  }
  return static_cast<int>(found - choices.begin());
}

const toml::table& TableReader::table(const std::string& key) const {
  static const toml::table empty;
  const toml::node* node = table_.get(key);
  if (node == nullptr) return empty;
  if (!node->is_table()) fail_type(key, "a section [" + full(key) + "]");
  return *node->as_table();
}

std::vector<const toml::table*> TableReader::tables(const std::string& key) const {
  std::vector<const toml::table*> found;
  const toml::node* node = table_.get(key);
  if (node == nullptr) return found;
  const toml::array* array = node->as_array();
  if (array == nullptr) fail_type(key, "one or more sections [[" + full(key) + "]]");
  for (const toml::node& element : *array) {
    if (!element.is_table()) fail(key, "is not a section; write [[" + full(key) + "]]");
    found.push_back(element.as_table());
  }
  return found;
}

void TableReader::fail(const std::string& key, const std::string& what) const {
  throw lines_.error(full(key), what);
}

void TableReader::fail_missing(const std::string& key, const std::string& remedy) const {
  throw lines_.error(path_, "has no '" + key + "'; " + remedy);
}

void TableReader::fail_type(const std::string& key, const std::string& wanted) const {
  fail(key, "is " + shown(*table_.get(key)) + "; it must be " + wanted);
}

}  // namespace swarmtalk::daemon
