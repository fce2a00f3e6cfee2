// Subcommands that look at the air and at frames: what they understand, and a function each that
// does it and returns the exit code.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/common/commands.hpp"

namespace CLI {
class App;
}

namespace swarmtalk::cli {

struct ChannelsArguments {
  double seconds = 2;
};

struct HzArguments {
  std::vector<std::string> channels;
  std::uint64_t count = 0;  // reports; 0: until a signal
  double seconds = 1;       // that a report covers
};

struct DecodeArguments {
  std::vector<std::string> frames;  // hexadecimal; "-": a frame a line on standard input
  std::string profile;              // empty: air frames; else bare packets of this one
};

struct PoseWatchArguments {
  double period_s = 0.5;
  std::uint64_t count = 0;  // lines; 0: until a signal
};

struct PingArguments {
  std::uint32_t robot = 0;  // node id
  bool answers = false;     // instead of asking
  std::uint64_t count = 0;  // 0: until a signal
  double period_s = 1;      // between questions; the answer must come within
  std::uint32_t ttl = 4;    // hops after the first, there and back
  bool is_by_hop = false;   // ask the robots on the way as well
};

struct ScreenArguments {
  double period_s = 1;
  bool is_once = false;
  std::uint64_t count = 0;  // with JSON: lines; 0: until a signal
  std::string filter;       // top: only what has this in its name
  std::string sort;         // top: name, rate, lost
  double range_m = 0;       // radar; 0: as far as the farthest
};

/// Adds them to `app`, which has `pose` already; `verb` is set to the one that the user has
/// written.
void add_looking(CLI::App& app, Common& common, Verb& verb);
void add_screens(CLI::App& app, Common& common, Verb& verb);

int channels(const Common& common, const ChannelsArguments& arguments);
int hz(const Common& common, const HzArguments& arguments);
int decode(const Common& common, const DecodeArguments& arguments);
int watch_pose(const Common& common, const PoseWatchArguments& arguments);
int ping(const Common& common, const PingArguments& arguments);
int top(const Common& common, const ScreenArguments& arguments);
int radar(const Common& common, const ScreenArguments& arguments);

}  // namespace swarmtalk::cli
