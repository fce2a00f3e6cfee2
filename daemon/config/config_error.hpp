// ConfigError: why the daemon cannot start with a configuration, as one line for a person. Thrown
// before the event loop runs and caught in main. KeyLines remembers where each key stands, so that
// what is found out later (no such interface) still names file and line.
#pragma once

#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

namespace swarmtalk::daemon {

class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// File and line of each key of one configuration.
class KeyLines {
 public:
  KeyLines() = default;
  explicit KeyLines(std::string file) : file_(std::move(file)) {}

  /// @param value  as TOML; sections have none
  void set(const std::string& key, unsigned line, const std::string& value = "") {
    places_[key] = file_ + ":" + std::to_string(line) + ": key '" + key + "'";
    if (!value.empty()) values_[key] = value;
  }

  /// The value of `key` came from this command line option instead.
  void set_option(const std::string& key, const std::string& option) {
    places_[key] = option;
    options_.insert(key);
  }
  bool is_option(const std::string& key) const { return options_.contains(key); }

  /// `key` counts as it stands in `other`.
  void keep_value(const std::string& key, const KeyLines& other) {
    const auto found = other.values_.find(key);
    if (found == other.values_.end())
      values_.erase(key);
    else
      values_[key] = found->second;
  }

  /// Each key of the file that is not a section, with its value as TOML.
  const std::map<std::string, std::string>& values() const { return values_; }

  /// "FILE:LINE: key 'links.wifi.interface': WHAT"; without LINE for a key that the file leaves
  /// to its default. @param what  what is wrong and the remedy, joined by a semicolon
  ConfigError error(const std::string& key, const std::string& what) const {
    const auto found = places_.find(key);
    const std::string place =
        found == places_.end() ? file_ + ": key '" + key + "'" : found->second;
    return ConfigError(place + ": " + what);
  }

  const std::string& file() const { return file_; }

 private:
  std::string file_;
  std::map<std::string, std::string> values_;
  std::set<std::string> options_;
  std::map<std::string, std::string> places_;  // key to "FILE:LINE: key 'KEY'"
};

}  // namespace swarmtalk::daemon
