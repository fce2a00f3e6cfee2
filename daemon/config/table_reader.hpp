// TableReader: reads typed, bounded values out of one TOML table and says precisely what is wrong
// with them. Used by what reads a section of the configuration. Keys are recorded in the KeyLines
// with their full path.
#pragma once

#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/common/printable.hpp"
#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"
#include "text/toml.hpp"

namespace swarmtalk::daemon {

class TableReader {
 public:
  /// @param path  of the table, "links.wifi"; "" for the whole file. Both references are kept.
  TableReader(const toml::table& table, std::string path, KeyLines& lines);

  /// Refuses the first key that is not one of `known`, with the nearest one that is.
  void expect_keys(const std::vector<std::string>& known) const;

  bool has(std::string_view key) const { return table_.contains(key); }

  /// @pre has(key)
  const toml::node& node(const std::string& key) const { return *table_.get(key); }

  // Each leaves `value` alone when the key is absent.
  template <typename T>
  void read_integer(const std::string& key, IntegerLimits limits, T& value) const {
    std::int64_t wide = 0;
    if (integer(key, limits, wide)) value = static_cast<T>(wide);
  }
  void read_number(const std::string& key, double least, double most, double& value) const;
  void read_text(const std::string& key, std::string& value) const;
  void read_bool(const std::string& key, bool& value) const;
  /// The array `key`, which must hold `count` finite numbers. @pre has(key)
  /// @param form  how it must look, for the message
  std::vector<double> read_numbers(const std::string& key, std::size_t count,
                                   const std::string& form) const;
  /// @return index of the text in `choices`; -1 when absent
  int read_choice(const std::string& key, std::span<const char* const> choices) const;
  int read_choice(const std::string& key, std::initializer_list<const char*> choices) const {
    return read_choice(key, std::span(choices.begin(), choices.size()));
  }

  /// The table `key`, empty when absent.
  const toml::table& table(const std::string& key) const;

  /// The tables of [[key]], empty when absent. Errors in them are told as "key", with their line.
  std::vector<const toml::table*> tables(const std::string& key) const;

  /// @throws ConfigError  at a key, at this table's own line
  [[noreturn]] void fail(const std::string& key, const std::string& what) const;
  [[noreturn]] void fail_missing(const std::string& key, const std::string& remedy) const;
  /// "is true; it must be WANTED"
  [[noreturn]] void fail_type(const std::string& key, const std::string& wanted) const;

  const std::string& path() const { return path_; }
  std::string full(const std::string& key) const;

 private:
  bool integer(const std::string& key, IntegerLimits limits, std::int64_t& value) const;

  const toml::table& table_;
  std::string path_;
  KeyLines& lines_;
};

}  // namespace swarmtalk::daemon
