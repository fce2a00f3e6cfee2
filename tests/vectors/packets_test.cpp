// The packets of every profile of nine bytes or fewer, from files, against the core, both ways.
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <map>

#include "swarmtalk/profiles/classic2020.hpp"
#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "tests/vectors/packet_player.hpp"

namespace swarmtalk::core::testing {
namespace {

using Play = std::function<bool(const std::string& word, std::istringstream& line)>;

/// Gives each line of a file to the player of its format.
void play_file(const char* path, const std::map<std::string, Play>& players) {
  std::ifstream file(path);
  ASSERT_TRUE(file.good()) << path;
  std::string format;
  for (std::string text; std::getline(file, text);) {
    std::istringstream line(text);
    std::string word;
    if (!(line >> word) || word[0] == '#') continue;
    if (word == "format") {
      line >> format;
      ASSERT_EQ(players.count(format), 1u) << text;
    } else {
      ASSERT_TRUE(players.at(format)(word, line)) << text;
    }
  }
}
template <class P>
Play play_with(Player<P>& player) {
  return [&player](const std::string& word, std::istringstream& line) {
    return player.play(word, line);
  };
}

TEST(Packets2020, AreSentAndUnderstoodBitForBit) {
  Player<Classic2020Format<2>> template8;
  Player<Classic2020> shipped8;
  Player<Classic2020Paper> paper9;
  play_file(SWARMTALK_VECTORS "/packets_2020.txt", {{"template8", play_with(template8)},
                                                    {"shipped8", play_with(shipped8)},
                                                    {"paper9", play_with(paper9)}});
  EXPECT_GT(template8.checked, 25);
  EXPECT_GT(shipped8.checked, 25);
  EXPECT_GT(paper9.checked, 25);
}

TEST(PacketsOfProfiles, AreSentAndUnderstoodBitForBit) {
  Player<Kilobot> kilobot;
  Player<Footbot> footbot;
  play_file(SWARMTALK_VECTORS "/packets_profiles.txt",
            {{"kilobot", play_with(kilobot)}, {"footbot", play_with(footbot)}});
  EXPECT_EQ(kilobot.checked, 32);
  EXPECT_EQ(footbot.checked, 34);
}

}  // namespace
}  // namespace swarmtalk::core::testing
