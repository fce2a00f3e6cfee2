// What `top` shows: rates, from two states of the daemon and of the air, and the lines or the JSON
// that they become. Pure functions.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <swarmtalk/client.hpp>

#include "cli/look/air_watch.hpp"
#include "cli/text/format.hpp"

namespace swarmtalk::cli {

/// Everything at one time.
struct TopState {
  DaemonStatus daemon;
  std::vector<Neighbour> neighbours;
  std::map<std::uint16_t, AirChannel> air;
  std::uint64_t sealed_frames = 0;
  std::uint32_t own_pid = 0;  // of the program that looks, which is left out
};

struct TopLook {
  std::size_t width = 80;
  std::size_t height = 1000;
  std::string sort = "name";  // name, rate, lost
  std::string filter;         // only what has this in its name, or the number of this name
  std::string foot;           // last line; empty: none
  std::size_t down = 0;       // rows that each table which is too long is moved up by
};

/// @param seconds  between the two
Json top_json(const TopState& before, const TopState& now, double seconds);

/// A few lines of head, then channels, programs and neighbours, each as far as there is room.
std::vector<std::string> top_lines(const Json& top, const TopLook& look);

/// How far down there is something to be seen: the greatest `down` that matters.
std::size_t top_most_down(const Json& top, const TopLook& look);

/// Rows that may be passed over at once with none unseen: as many as the smallest table shows of
/// those that are too long; 1 or more.
std::size_t top_page(const Json& top, const TopLook& look);

}  // namespace swarmtalk::cli
