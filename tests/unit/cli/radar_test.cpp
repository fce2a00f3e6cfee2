// What `radar` draws of who is heard.
#include "cli/look/radar_view.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

namespace swarmtalk::cli {
namespace {

Neighbour heard(std::uint32_t id, float distance_m, float bearing_rad, int age_ms) {
  Neighbour neighbour;
  neighbour.node_id = id;
  neighbour.distance_m = distance_m;
  neighbour.bearing_rad = bearing_rad;
  neighbour.age = std::chrono::milliseconds(age_ms);
  return neighbour;
}

std::string line_with(const std::vector<std::string>& lines, const std::string& text) {
  const auto found = std::find_if(lines.begin(), lines.end(), [&](const std::string& line) {
    return line.find(text) != std::string::npos;
  });
  return found == lines.end() ? "" : *found;
}

TEST(Radar, ListsWhatHasNoRoomByNumberWhoeverWasHeardLast) {
  // All on one spot: the freshest is drawn, the others are listed.
  const std::vector<Neighbour> neighbours{heard(5, 1, 0, 40), heard(9, 1, 0, 10),
                                          heard(7, 1, 0, 30), heard(12, 1, 0, 20)};
  const std::vector<std::string> lines = radar_lines(neighbours, {60, 24, 0});
  EXPECT_EQ(line_with(lines, "no room to draw"), "no room to draw: 5 7 12");
  EXPECT_NE(line_with(lines, "4 heard"), "");
}

TEST(Radar, DrawsAheadAboveUsAndTheLeftOnTheLeft) {
  const std::vector<Neighbour> neighbours{heard(3, 1, 0, 0), heard(4, 1, 1.57F, 0)};
  const std::vector<std::string> lines = radar_lines(neighbours, {60, 24, 0});
  const auto row_of = [&](char mark) {
    return std::find_if(lines.begin(), lines.end(), [&](const std::string& line) {
      return line.find(mark) != std::string::npos;
    });
  };
  const auto us = row_of('^');
  EXPECT_LT(row_of('3') - lines.begin(), us - lines.begin());
  ASSERT_EQ(row_of('4'), us);
  EXPECT_LT(us->find('4'), us->find('^'));
}

}  // namespace
}  // namespace swarmtalk::cli
