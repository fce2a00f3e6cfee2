#include "emulation/kilobot/scenario.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace swarmtalk::emulator {
namespace {

class ScenarioFileTest : public testing::Test {
 protected:
  ~ScenarioFileTest() override { std::filesystem::remove(path_); }
  Scenario load(const std::string& text) {
    std::ofstream(path_) << text;
    return load_scenario(path_);
  }
  std::string error_of(const std::string& text) {
    try {
      load(text);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
  std::string path_ = testing::TempDir() + "swarmtalk-scenario-" + std::to_string(::getpid());
};

TEST_F(ScenarioFileTest, ReadsEverything) {
  const Scenario scenario = load(R"(
seconds = 30
seed = 7
drift_ppm = 5000
watch = ["joined-6:1", "ticks"]
lamp = ["run@1x10"]

[medium]
range_mm = 60
loss = 0.01

[[robot]]
grid = "2x3"
spacing_mm = 40
image = "hop.elf"

[[robot]]
name = "gateway"
image = "/gateway.hex"
x_mm = 10
y_mm = -5.5
uid = 99
power_on_ms = 12
drift_ppm = 0
pty = "/tmp/gateway"

[ohc]
image = "ohc.elf"
infrared_pin = "B1"
send = ["run@2.5", "stop@3.5"]
)");
  EXPECT_EQ(scenario.seconds, 30);
  EXPECT_EQ(scenario.seed, 7u);
  ASSERT_EQ(scenario.robots.size(), 7u);
  EXPECT_EQ(scenario.robots[4].x_mm, 40);
  EXPECT_EQ(scenario.robots[4].y_mm, 40);
  EXPECT_EQ(std::filesystem::path(scenario.robots[0].image).parent_path(),
            std::filesystem::path(path_).parent_path());
  const NodeSpec& gateway = scenario.robots[6];
  EXPECT_EQ(gateway.name, "gateway");
  EXPECT_EQ(gateway.image, "/gateway.hex");
  EXPECT_EQ(gateway.uid, 99);
  EXPECT_EQ(gateway.y_mm, -5.5);
  EXPECT_TRUE(gateway.has_pty);
  EXPECT_EQ(scenario.medium.loss, 0.01);
  ASSERT_TRUE(scenario.ohc);
  EXPECT_EQ(scenario.ohc->infrared_led.port, 'B');
  ASSERT_EQ(scenario.ohc_serial.size(), 2u);
  EXPECT_EQ(scenario.ohc_serial[1].at_s, 3.5);
  EXPECT_EQ(scenario.watch.size(), 2u);
  ASSERT_EQ(scenario.lamp.size(), 1u);
  EXPECT_EQ(scenario.lamp[0].copies, 10u);
}

TEST_F(ScenarioFileTest, NamesFileAndLineOfAMistake) {
  EXPECT_NE(error_of("seconds = 1\nsecond = 2\n").find(":2: unknown key \"second\""),
            std::string::npos);
  EXPECT_NE(error_of("seconds = \"long\"\n").find(":1: seconds must be a number"),
            std::string::npos);
  EXPECT_NE(error_of("[[robot]]\nuid = 70000\n").find("in range"), std::string::npos);
  EXPECT_NE(error_of("[medium]\nrange = 1\n").find("unknown key"), std::string::npos);
  EXPECT_NE(error_of("seconds = \n"), "");
  EXPECT_NE(error_of("[ohc]\ninfrared_pin = \"E1\"\n").find("not a pin"), std::string::npos);
  EXPECT_NE(
      error_of("seconds = 1\n\u00F9 = 2\n").find(":2: not TOML: column 1: the character U+00F9"),
      std::string::npos);
  EXPECT_THROW(load_scenario("/nonexistent.toml"), std::runtime_error);
}

TEST(ScenarioText, ReadsSerialCommands) {
  const SerialSpec run = parse_serial("run@2.5");
  EXPECT_EQ(run.at_s, 2.5);
  ASSERT_EQ(run.bytes.size(), 132u);
  EXPECT_EQ(run.bytes[11], 0x88);
  EXPECT_EQ(run.bytes[131], 0xDF);
  EXPECT_EQ(parse_serial("hex:55 00aF@0").bytes, (std::vector<std::uint8_t>{0x55, 0, 0xAF}));
  for (const char* bad : {"run", "walk@1", "hex:5@1", "run@x", "run@-1", "hex:zz@1"})
    EXPECT_THROW(parse_serial(bad), std::runtime_error) << bad;
}

TEST(ScenarioText, ReadsLampMessages) {
  const LampSpec lamp = parse_lamp("0x02:0102@3x5");
  EXPECT_EQ(lamp.message[1], 2);
  EXPECT_EQ(lamp.message[9], 2);
  EXPECT_EQ(lamp.copies, 5u);
  EXPECT_TRUE(has_good_crc(lamp.message));
  for (const char* bad : {"300@1", "@1", "run", "5:00112233445566778899@1"})
    EXPECT_THROW(parse_lamp(bad), std::runtime_error) << bad;
}

TEST(ScenarioText, ReadsWatchedVariables) {
  EXPECT_EQ(parse_watch("ticks").symbol, "ticks");
  const WatchSpec from_end = parse_watch("joined-6:1");
  EXPECT_TRUE(from_end.is_from_end);
  EXPECT_EQ(from_end.offset, 6);
  EXPECT_EQ(from_end.size_bytes, 1u);
  EXPECT_EQ(parse_watch("table+4").offset, 4);
  EXPECT_THROW(parse_watch("table:9"), std::runtime_error);
  EXPECT_THROW(parse_watch("table+x"), std::runtime_error);
}

TEST(ScenarioText, RefusesGridsThatAreNone) {
  Scenario scenario;
  for (const char* bad : {"3", "0x3", "x", "100x100"})
    EXPECT_THROW(add_grid(scenario, bad, 50, {}), std::runtime_error) << bad;
}

TEST(Scenario, RefusesNumbersOutOfRange) {
  Scenario scenario;
  complete(scenario);
  scenario.medium.loss = 1.5;
  EXPECT_THROW(complete(scenario), std::runtime_error);
  scenario.medium.loss = 0;
  scenario.sample_ms = 0;
  EXPECT_THROW(complete(scenario), std::runtime_error);
  scenario.sample_ms = 1;
  scenario.seconds = -1;  // no end, as 0 has
  EXPECT_THROW(complete(scenario), std::runtime_error);
}

TEST(Scenario, RefusesTwoNodesOfOneName) {
  Scenario scenario;
  add_grid(scenario, "1x2", 50, {});
  scenario.robots[0].name = "gateway";
  complete(scenario);
  scenario.robots[1].name = "gateway";
  EXPECT_THROW(complete(scenario), std::runtime_error);
}

TEST(Scenario, DrawsWhatIsOpenFromTheSeedAlone) {
  Scenario first;
  add_grid(first, "2x2", 50, {});
  Scenario second = first;
  second.robots[1].drift_ppm = 0;  // fixing one changes no other
  complete(first);
  complete(second);
  EXPECT_EQ(first.robots[0].name, "k0");
  EXPECT_EQ(first.robots[3].uid, 4);
  EXPECT_NE(*first.robots[0].drift_ppm, *first.robots[1].drift_ppm);
  EXPECT_LE(std::abs(*first.robots[0].drift_ppm), 10'000);
  EXPECT_EQ(*first.robots[3].drift_ppm, *second.robots[3].drift_ppm);
  EXPECT_EQ(*first.robots[1].power_on_ms, *second.robots[1].power_on_ms);
}

}  // namespace
}  // namespace swarmtalk::emulator
