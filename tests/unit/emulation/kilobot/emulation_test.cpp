#include "emulation/kilobot/emulation.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <sstream>

namespace swarmtalk::emulator {
namespace {

/// Whole emulations with the two small images of these tests.
class EmulationTest : public testing::Test {
 protected:
  void SetUp() override {
#ifdef SWARMTALK_TEST_IMAGES
    talker_.image = std::string(SWARMTALK_TEST_IMAGES) + "talker.elf";
    listener_.image = std::string(SWARMTALK_TEST_IMAGES) + "listener.elf";
#else
    GTEST_SKIP() << "avr-g++ is missing (Debian: gcc-avr, avr-libc)";
#endif
  }

  NodeSpec& add(NodeSpec spec, double x_mm) {
    spec.x_mm = x_mm;
    scenario_.robots.push_back(spec);
    return scenario_.robots.back();
  }

  Emulation& run(double seconds) {
    log_.str("");
    scenario_.seconds = seconds;
    emulation_ = std::make_unique<Emulation>(scenario_, &log_);
    emulation_->run();
    return *emulation_;
  }

  unsigned variable(const std::string& node, const std::string& name) const {
    const Node& found = emulation_->node(node);
    const Symbol symbol = found.symbol(name);
    unsigned value = found.mcu().data(symbol.address);
    if (symbol.size_bytes == 2)
      value += found.mcu().data(static_cast<std::uint16_t>(symbol.address + 1)) * 256u;
    return value;
  }
  std::size_t count_in_log(const std::string& text) const {
    const std::string log = log_.str();
    std::size_t count = 0;
    for (std::size_t at = log.find(text); at != std::string::npos; at = log.find(text, at + 1))
      ++count;
    return count;
  }

  NodeSpec talker_, listener_;
  Scenario scenario_;
  std::ostringstream log_;
  std::unique_ptr<Emulation> emulation_;
};

TEST_F(EmulationTest, CarriesMessagesFromOneImageToAnother) {
  add(talker_, 0);
  add(listener_, 50);
  add(listener_, 200);
  run(3);
  const unsigned sent = variable("k0", "sent_count");
  EXPECT_NEAR(sent, 22, 2);
  EXPECT_GE(variable("k1", "heard_count"), sent - 2);
  EXPECT_EQ(variable("k1", "damaged_count"), 0u);
  EXPECT_EQ(variable("k2", "heard_count"), 0u) << "out of range";
  EXPECT_EQ(count_in_log("\"event\":\"sent\",\"type\":5"), sent);
  EXPECT_EQ(emulation_->node("k1").mcu().late_edges(), 0u);
}

TEST_F(EmulationTest, ShowsTheDistanceAtBothGains) {
  add(talker_, 0);
  add(listener_, 70);
  run(1);
  EXPECT_EQ(variable("k1", "high_gain"), signal_at(70).high_gain);
  EXPECT_EQ(variable("k1", "low_gain"), signal_at(70).low_gain);
}

TEST_F(EmulationTest, AddsNoiseToTheConverter) {
  add(talker_, 0);
  add(listener_, 70);
  scenario_.noise_counts = 10;
  scenario_.watch = {"high_gain"};
  run(2);
  EXPECT_GT(count_in_log("\"name\":\"high_gain\""), 5u);
  EXPECT_NEAR(variable("k1", "high_gain"), signal_at(70).high_gain, 60);
}

TEST_F(EmulationTest, ReadsItsUidFromTheEeprom) {
  add(listener_, 0).uid = 4711;
  run(0.5);
  EXPECT_EQ(variable("k0", "uid"), 4711u);
}

TEST_F(EmulationTest, GivesTheSameLogForTheSameSeed) {
  add(talker_, 0);
  add(listener_, 50);
  add(talker_, 100);
  scenario_.medium.loss = 0.1;
  scenario_.medium.stray_pulses_per_s = 20;
  scenario_.noise_counts = 3;
  scenario_.watch = {"heard_count", "high_gain"};
  scenario_.logs_heard = true;
  std::string logs[3];
  for (std::size_t round = 0; round < 3; ++round) {
    scenario_.seed = round < 2 ? 1 : 2;
    run(2);
    logs[round] = log_.str();
  }
  EXPECT_GT(logs[0].size(), 2000u);
  EXPECT_EQ(logs[0], logs[1]);
  EXPECT_NE(logs[0], logs[2]);
}

TEST_F(EmulationTest, ToleratesClocksUpToFivePercentApart) {
  for (const auto& [drift_ppm, expected] :
       {std::pair{50'000.0, true}, std::pair{-50'000.0, true}, std::pair{70'000.0, false}}) {
    scenario_.robots.clear();
    add(talker_, 0).drift_ppm = 0;
    add(listener_, 50).drift_ppm = drift_ppm;
    run(1);
    EXPECT_EQ(variable("k1", "heard_count") >= 4, expected) << drift_ppm;
  }
}

TEST_F(EmulationTest, LetsMessagesThatOverlapDestroyEachOther) {
  for (const double x_mm : {0.0, 100.0}) {
    NodeSpec& talker = add(talker_, x_mm);
    talker.drift_ppm = 0;
    talker.power_on_ms = x_mm / 100;  // 1 ms later, while the other still sends
  }
  add(listener_, 50).drift_ppm = 0;
  run(2);
  EXPECT_EQ(variable("k2", "heard_count"), 0u);
}

TEST_F(EmulationTest, LosesMessagesAsAsked) {
  add(talker_, 0);
  add(listener_, 50);
  scenario_.medium.loss = 0.5;
  run(5);
  const unsigned sent = variable("k0", "sent_count"), heard = variable("k1", "heard_count");
  EXPECT_GT(heard, sent / 5);
  EXPECT_LT(heard, sent * 4 / 5);
}

TEST_F(EmulationTest, PlaysMessagesFromTheLamp) {
  add(listener_, 0);
  scenario_.lamp = {parse_lamp("0x02:2a@0.5x10")};
  run(1);
  EXPECT_EQ(variable("k0", "heard_count"), 10u);
  EXPECT_EQ(variable("k0", "last_data"), 0x2Au);
}

TEST_F(EmulationTest, LogsLedAndSerialOutput) {
  add(listener_, 0);
  scenario_.lamp = {parse_lamp("0x02:41@0.5x1")};
  run(1);
  EXPECT_EQ(count_in_log("\"event\":\"led\",\"red\":1"), 1u);
  EXPECT_EQ(count_in_log("\"event\":\"serial\",\"hex\":\"410a\",\"text\":\"A\""), 1u);
}

TEST_F(EmulationTest, GivesARobotsUartATerminal) {
  add(listener_, 0).has_pty = true;
  scenario_.lamp = {parse_lamp("0x02:41@0.5x3")};
  emulation_ = std::make_unique<Emulation>(scenario_, &log_);
  const int host =
      ::open(emulation_->node("k0").terminal()->device().c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK);
  ASSERT_GE(host, 0);
  emulation_->run_until(1);
  char text[16] = {};
  EXPECT_EQ(::read(host, text, sizeof text), 6);
  EXPECT_STREQ(text, "A\nA\nA\n");
  ::close(host);
}

TEST_F(EmulationTest, SavesTheEepromAtTheEnd) {
  NodeSpec& robot = add(listener_, 0);
  robot.save_eeprom = testing::TempDir() + "swarmtalk-saved-" + std::to_string(::getpid());
  robot.uid = 99;
  run(0.1);
  EXPECT_EQ(load_eeprom(robot.save_eeprom)[0xB0], 99);
  ::unlink(robot.save_eeprom.c_str());
}

TEST_F(EmulationTest, NamesVariablesThatNoImageHas) {
  add(listener_, 0);
  scenario_.watch = {"heard_count", "no_such:1"};
  EXPECT_EQ(run(0.1).unknown_variables(), std::vector<std::string>{"no_such"});
}

TEST_F(EmulationTest, RefusesAScenarioThatCannotBe) {
  EXPECT_THROW(run(1), std::runtime_error) << "no robots";
  add({}, 0);
  EXPECT_THROW(run(1), std::runtime_error) << "no image";
  scenario_.robots.clear();
  add(listener_, 0);
  scenario_.ohc_serial = {parse_serial("run@1")};
  EXPECT_THROW(run(1), std::runtime_error) << "no overhead controller";
}

}  // namespace
}  // namespace swarmtalk::emulator
