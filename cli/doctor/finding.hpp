// Finding: one thing that is wrong with a robot or between two, in words for a person and with a
// name for programs (docs/doctor.md lists them all). And what was looked at, so that nothing passes
// silently. Plain values.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace swarmtalk::cli::doctor {

enum class Severity {
  kError,    // robots do not hear each other, or programs do not reach the daemon
  kWarning,  // it works, and worse than it could
  kNote      // good to know; not counted as a finding
};

const char* name_of(Severity severity);

struct Finding {
  std::string id;  // "power-save": stable
  Severity severity = Severity::kError;
  std::string subject;  // "wlan0", "robot 7", "clock"
  std::string what;     // one line
  std::string remedy;   // one line: what to do
  // What --fix does about it; empty: nothing that could be done here. @return empty, or why not
  std::function<std::string()> fix = {};
  std::string fix_text = {};  // "power save is off now"
};

struct NotLooked {
  std::string what;  // "power save of wlan0"
  std::string why;
};

struct Report {
  std::vector<Finding> findings;
  std::vector<std::string> looked_at;
  std::vector<NotLooked> not_looked_at;

  /// Errors and warnings; notes are none.
  bool has_findings() const;
  void add(Finding finding) { findings.push_back(std::move(finding)); }
};

}  // namespace swarmtalk::cli::doctor
