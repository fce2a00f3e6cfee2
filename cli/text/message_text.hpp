// MessageText: how `sub` prints a message where the user says how: with the time, with the numbers
// of a struct, or in a format of their own. A value; pure but for the clock.
#pragma once

#include <optional>
#include <string>

#include <swarmtalk/client.hpp>

#include "cli/text/struct_format.hpp"

namespace swarmtalk::cli {

struct LookArguments {
  std::string pattern;        // -F; empty: none
  std::string struct_format;  // --fmt; empty: none
  bool has_time = false;      // --time
};

/// "2026-11-22T19:03:04.123456Z", and for %U "1795374184.123456".
std::string iso_time(std::chrono::steady_clock::time_point time);
std::string unix_time(std::chrono::steady_clock::time_point time);

class MessageText {
 public:
  /// @param problem  filled when there is none: one sentence
  static std::optional<MessageText> make(const LookArguments& arguments, std::string& problem);

  /// @return none: the user has said nothing, print it as always. No line end
  std::optional<std::string> line(const std::string& channel, const Message& message,
                                  bool is_json) const;

  /// What -F takes, for the help.
  static const char* help();

 private:
  std::string by_pattern(const std::string& channel, const Message& message) const;
  std::string values(const Message& message) const;

  LookArguments arguments_;
  std::optional<StructFormat> format_;
};

}  // namespace swarmtalk::cli
