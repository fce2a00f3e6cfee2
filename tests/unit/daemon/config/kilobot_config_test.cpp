// The section of a link to Kilobots.
#include <gtest/gtest.h>

#include "tests/unit/daemon/config/config_error.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr const char* kTable = "[links.k]\ntype = \"kilobot\"\n";  // lines 1 and 2

LinkConfig link_of(const std::string& text) {
  return parse_config(kTable + text, "f.toml").config.links.at(0);
}
std::string error_with(const std::string& text) {
  const std::string line = error_of(kTable + text);
  const std::string begin = "f.toml:";
  return line.starts_with(begin) ? line.substr(begin.size()) : line;
}

TEST(KilobotConfigText, HasWhatDocsSayWhereOnlyADeviceIsNamed) {
  const LinkConfig link = link_of("downlink = \"/dev/a\"\n");
  EXPECT_EQ(link.type, LinkType::kKilobot);
  EXPECT_EQ(link.profile, frame::ProfileId::kKilobot);
  EXPECT_EQ(link.kilobot.downlink, "/dev/a");
  EXPECT_EQ(link.kilobot.uplink, "");
  EXPECT_FALSE(link.kilobot.is_text);
  EXPECT_FALSE(link.kilobot.ohc_single);
  EXPECT_EQ(link.kilobot.copies, 3u);
  EXPECT_EQ(link.kilobot.settle_ms, 3500u);
  EXPECT_EQ(link.kilobot.time_scale, 1.0);
  EXPECT_EQ(link.forwarding.max_wait_ms, 0u);
}

TEST(KilobotConfigText, ReadsEachKey) {
  const LinkConfig link = link_of(
      "profile = \"classic2020\"\ndownlink = \"/dev/a\"\nuplink = \"/dev/b\"\n"
      "uplink_form = \"text\"\ntext_channel = 9\nohc_single = true\nbaud = 57600\ncopies = 2\n"
      "settle_ms = 0\ntime_scale = 0.5\n");
  EXPECT_EQ(link.profile, frame::ProfileId::kClassic2020);
  EXPECT_EQ(link.kilobot.downlink, "/dev/a");
  EXPECT_EQ(link.kilobot.uplink, "/dev/b");
  EXPECT_TRUE(link.kilobot.is_text);
  EXPECT_EQ(link.kilobot.text_channel, 9);
  EXPECT_TRUE(link.kilobot.ohc_single);
  EXPECT_EQ(link.kilobot.baud, 57600u);
  EXPECT_EQ(link.kilobot.copies, 2u);
  EXPECT_EQ(link.kilobot.settle_ms, 0u);
  EXPECT_EQ(link.kilobot.time_scale, 0.5);
}

TEST(KilobotConfigText, TakesAnUplinkAlone) {
  EXPECT_EQ(link_of("uplink = \"/dev/b\"\n").kilobot.downlink, "");
  EXPECT_FALSE(link_of("uplink = \"/dev/b\"\nuplink_form = \"frames\"\n").kilobot.is_text);
}

TEST(KilobotConfigText, RefusesWhatCannotBe) {
  EXPECT_EQ(error_with(""),
            "1: key 'links.k': has no 'downlink'; add downlink = \"/dev/serial/by-id/...\" (the "
            "overhead controller), uplink = ... (a gateway Kilobot), or both");
  for (const char* path : {"", "ttyUSB0"}) {
    EXPECT_EQ(error_with("downlink = \"" + std::string(path) + "\"\n"),
              "3: key 'links.k.downlink': is not the full path of a serial device; write it as "
              "listed by `ls /dev/serial/by-id/*`");
  }
  const std::string longest = "/" + std::string(4094, 'x');
  EXPECT_EQ(error_with("uplink = \"" + longest + "\"\n"), "");
  EXPECT_NE(error_with("uplink = \"" + longest + "x\"\n"), "");
  const std::string device = "downlink = \"/dev/a\"\n";
  EXPECT_EQ(error_with(device + "text_channel = 3\n"),
            "4: key 'links.k.text_channel': means nothing without uplink_form = \"text\"");
  EXPECT_EQ(error_with(device + "uplink_form = \"text\"\ntext_channel = 3\n"),
            "1: key 'links.k': has no 'uplink'; uplink_form = \"text\" needs the device that "
            "prints");
  EXPECT_EQ(error_with("uplink = \"/dev/b\"\nuplink_form = \"text\"\n"),
            "1: key 'links.k': has no 'text_channel'; uplink_form = \"text\" needs the number of "
            "the channel on which its lines are published");
  for (const char* within : {"baud = 1200", "baud = 1000000", "copies = 1", "copies = 100",
                             "settle_ms = 60000", "time_scale = 0.001", "time_scale = 1000"}) {
    EXPECT_EQ(error_with(device + within + "\n"), "") << within;
  }
  for (const char* beyond :
       {"baud = 1199", "baud = 1000001", "copies = 0", "copies = 101", "settle_ms = 60001",
        "settle_ms = -1", "time_scale = 0.0009", "time_scale = 1001", "key_file = \"/k\"",
        "profile = \"wifi\"", "uplink_form = \"bytes\""}) {
    EXPECT_NE(error_with(device + beyond + "\n"), "") << beyond;
  }
}

}  // namespace
}  // namespace swarmtalk::daemon
