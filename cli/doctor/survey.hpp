// `swarmtalk-cli survey`: asks one robot again and again while one of the two moves, and writes a
// line of CSV a period: distance, losses on both ways, delay, signal.
#pragma once

#include <cstdint>
#include <string>

#include "cli/common/commands.hpp"

namespace CLI {
class App;
}

namespace swarmtalk::cli::doctor {

struct SurveyArguments {
  std::uint32_t robot = 0;
  std::string file;         // where to; empty: standard output
  double rate_hz = 20;      // questions a second
  double period_s = 1;      // that a line covers
  std::uint64_t count = 0;  // lines; 0: until a signal
};

/// Adds `survey` to `app`; `verb` is set when the user has written it.
void add_survey(CLI::App& app, Common& common, Verb& verb);

int survey(const Common& common, const SurveyArguments& arguments);

}  // namespace swarmtalk::cli::doctor
