// A lab's robots are configured as robots are installed; only what a lab must have otherwise is
// other.
#include "lab/robot_config.hpp"

#include <gtest/gtest.h>

#include <string>

#include "lab/medium.hpp"
#include "text/toml_text.hpp"

namespace swarmtalk::lab {
namespace {

toml::table config_on(const std::string& medium) {
  State state;
  state.name = "lab";
  state.medium = medium;
  Robot robot;
  robot.number = 7;
  robot.socket = "/run/robot-7.sock";
  return text::parse_toml(robot_config(state, robot, ""), "robot-7.toml");
}

toml::table installed() {
  return text::parse_toml_file(SWARMTALK_SOURCE_DIR "/systemd/swarmtalkd.toml");
}

TEST(RobotConfigTest, IsWhatIsInstalledButForAWireAndDebug) {
  for (const std::string medium : {"bridge", "udp"}) {
    toml::table made = config_on(medium);
    EXPECT_EQ(made["node"]["id"].value<int>(), 7);
    EXPECT_EQ(made["socket"]["path"].value<std::string>(), "/run/robot-7.sock");
    EXPECT_EQ(made["links"]["wifi"]["rate_hz"].value<int>(), 0);
    EXPECT_EQ(made["reserved"]["debug"].value<bool>(), true);
    toml::table wanted = installed();
    for (const char* key : {"beacon_ms", "jitter_us"}) {
      EXPECT_EQ(made["links"]["wifi"][key].value<int>(), wanted["links"]["wifi"][key].value<int>());
      EXPECT_TRUE(wanted["links"]["wifi"][key].value<int>()) << key;
    }
    made["reserved"].as_table()->erase("debug");
    EXPECT_EQ(*made["reserved"].as_table(), *wanted["reserved"].as_table());
  }
}

TEST(RobotConfigTest, HasTheInstalledRateWhereRobotsShareTheAir) {
  const toml::table wanted = installed();
  for (const std::string medium : {"radio", "radio-udp"}) {
    EXPECT_EQ(config_on(medium)["links"]["wifi"]["rate_hz"].value<int>(),
              wanted["links"]["wifi"]["rate_hz"].value<int>());
  }
}

}  // namespace
}  // namespace swarmtalk::lab
