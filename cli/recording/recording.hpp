// `swarmtalk-cli record` and `play`: what they understand, and a function each that does it and
// returns the exit code.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/common/commands.hpp"

namespace CLI {
class App;
}

namespace swarmtalk::cli {

struct RecordArguments {
  std::string file;                   // empty: lines on standard output
  std::vector<std::string> channels;  // none: all
  bool is_jsonl = false;
  bool replaces = false;    // a file of that name
  std::uint64_t count = 0;  // messages; 0: no end
  double timeout_s = 0;     // 0: no end
};

struct PlayArguments {
  std::string file;
  std::vector<std::string> channels;  // none: all
  double rate = 1;                    // times the speed of the recording
  bool is_looping = false;
  bool waits = false;  // for somebody who listens
  std::uint32_t ttl = 0;
};

/// Adds both to `app`; `verb` is set to the one that the user has written.
void add_recording(CLI::App& app, const Common& common, Verb& verb);

int record(const Common& common, const RecordArguments& arguments);
int play(const Common& common, const PlayArguments& arguments);

}  // namespace swarmtalk::cli
