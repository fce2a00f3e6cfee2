// The firmware's own images in the emulator: what the host writes to the overhead controller's
// terminal goes in, what the robots have made of it is looked up in their memory and flash.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <sstream>

#include "emulation/kilobot/emulation.hpp"
#include "kilobot_wire/ohc_frame.hpp"

namespace swarmtalk::emulator {
namespace {

using ohc_double::FrameType;
using ohc_double::make_frame;
using ohc_double::make_message_frame;

class FirmwareTest : public testing::Test {
 protected:
  void SetUp() override {
#ifdef SWARMTALK_FIRMWARE_IMAGES
    images_ = SWARMTALK_FIRMWARE_IMAGES;
#else
    GTEST_SKIP() << "the Kilobot images are not built (avr-g++ is missing?)";
#endif
  }
  ~FirmwareTest() override {
    if (host_ >= 0) ::close(host_);
  }

  NodeSpec robot(const std::string& image) const {
    NodeSpec spec;
    spec.image = images_ + image + ".elf";
    return spec;
  }
  void add_ohc() {
    scenario_.ohc = OhcSpec{};
    scenario_.ohc->image = images_ + "overhead.elf";
    scenario_.ohc->infrared_led = {'D', 3};
    scenario_.ohc->has_pty = true;
  }
  void start() {
    log_.str("");
    emulation_ = std::make_unique<Emulation>(scenario_, &log_);
    if (scenario_.ohc)
      host_ = ::open(emulation_->node("ohc").terminal()->device().c_str(),
                     O_WRONLY | O_NOCTTY | O_NONBLOCK);
  }

  void wait(double seconds) {
    emulation_->run_until(emulation_->emulated_seconds() + seconds);
  }
  /// Writes a frame to the terminal and lets the line take it, then keeps silent.
  void send(const ohc_double::Frame& frame, double hold_s) {
    ASSERT_EQ(::write(host_, frame.data(), frame.size()), static_cast<ssize_t>(frame.size()));
    wait(0.0344 + hold_s);
  }
  void command(std::uint8_t ir_type, double hold_s) {
    send(make_message_frame(FrameType::kForward, ir_type), hold_s);
    send(make_frame(FrameType::kStop), 0.02);
  }

  unsigned byte(const Node& node, const std::string& symbol, int offset) const {
    const Symbol found = node.symbol(symbol);
    const int at = found.address + (offset < 0 ? found.size_bytes + offset : offset);
    return node.mcu().data(static_cast<std::uint16_t>(at));
  }
  unsigned word(const Node& node, const std::string& symbol) const {
    return byte(node, symbol, 0) + 256 * byte(node, symbol, 1);
  }

  std::string images_;
  Scenario scenario_;
  std::ostringstream log_;
  std::unique_ptr<Emulation> emulation_;
  int host_ = -1;
};

// The room of robot and program in a hop-count image (platforms/kilobot/join.hpp).
constexpr char kRobotAndProgram[] =
    "_ZN9swarmtalk7kilobot6JoinedINS_5suite8HopCountENS0_17BasicKilobotRobotINS_4core7KilobotEEEE5"
    "room_E";

class HopCountTest : public FirmwareTest, public testing::WithParamInterface<int> {};

/// A grid in which only the four nearest robots hear each other: hops are rows plus columns.
TEST_P(HopCountTest, SpreadsOverNineRobotsAfterRunFromTheHost) {
  constexpr int kColumns = 3;
  add_grid(scenario_, "3x3", 50, robot("hop_count"));  // uids 1 and 2 are the seeds
  add_ohc();
  scenario_.medium.range_mm = 60;
  scenario_.seed = static_cast<std::uint64_t>(GetParam());
  start();
  const std::clock_t before = std::clock();
  wait(2.2);
  command(ohc_double::kIrRun, 0.5);
  wait(6);
  const double cpu_s = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  for (int i = 0; i < 9; ++i) {
    const Node& node = *emulation_->nodes()[static_cast<std::size_t>(i)];
    const auto hops = [&](int seed) {
      return std::abs(i % kColumns - seed % kColumns) + std::abs(i / kColumns - seed / kColumns);
    };
    // The program's last bytes: for each seed its publisher, the hops and whether it is one.
    EXPECT_EQ(byte(node, kRobotAndProgram, -7), hops(0)) << node.name() << " to seed 1";
    EXPECT_EQ(byte(node, kRobotAndProgram, -2), hops(1)) << node.name() << " to seed 2";
    EXPECT_EQ(node.mcu().late_edges(), 0u);
  }
  const double speed = emulation_->emulated_seconds() * 10 / cpu_s;
  RecordProperty("node_seconds_per_cpu_second", std::to_string(speed));
  std::printf("%.1f node-seconds per CPU-second\n", speed);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && defined(__OPTIMIZE__)
  EXPECT_GE(speed, 5);
#endif
}

INSTANTIATE_TEST_SUITE_P(Seeds, HopCountTest, testing::Values(1, 2, 3));

TEST_F(FirmwareTest, IsLoadedIntoTwoRobotsWithOnePercentLoss) {
  NodeSpec blank = robot("blank");
  blank.bootloader = images_ + "bootloader.elf";
  add_grid(scenario_, "1x2", 50, blank);
  add_ohc();
  scenario_.medium.loss = 0.01;
  start();
  const Image program = load_image(images_ + "beacon.elf");
  const unsigned pages = std::max(2u, (program.used_bytes + 127) / 128);
  wait(2.2);
  command(ohc_double::kIrBoot, 1);
  // Not by pages written: a page is filled up over the passes, with several writes.
  const auto is_done = [&] {
    return std::all_of(emulation_->nodes().begin(), emulation_->nodes().begin() + 2,
                       [&](const auto& node) {
                         const std::vector<std::uint8_t> flash = node->mcu().flash();
                         return std::equal(flash.begin(), flash.begin() + program.used_bytes,
                                           program.flash.begin());
                       });
  };
  constexpr int kMostPasses = 10;
  int passes = 0;
  for (; passes < kMostPasses && !is_done(); ++passes) {
    const std::array<std::uint8_t, 1> size{static_cast<std::uint8_t>(pages)};
    send(make_message_frame(FrameType::kForward, ohc_double::kIrBootSize, size), 0.131);
    for (unsigned page = 0; page < pages && !is_done(); ++page) {
      std::array<std::uint8_t, 129> payload{static_cast<std::uint8_t>(page)};
      std::copy_n(program.flash.begin() + page * 128, 128, payload.begin() + 1);
      send(make_frame(FrameType::kBootPage, payload), 0.131);
    }
  }
  send(make_frame(FrameType::kStop), 0.2);
  std::printf("%u pages in %d passes, %.1f s\n", pages, passes, emulation_->emulated_seconds());
  for (std::size_t i = 0; i < 2; ++i) {
    const std::vector<std::uint8_t> flash = emulation_->nodes()[i]->mcu().flash();
    EXPECT_TRUE(
        std::equal(flash.begin(), flash.begin() + program.used_bytes, program.flash.begin()))
        << "robot " << i;
  }
  log_.str("");
  command(ohc_double::kIrRun, 0.5);
  wait(2);
  for (const char* name : {"k0", "k1"})
    EXPECT_NE(
        log_.str().find(std::string("\"node\":\"") + name + "\",\"event\":\"sent\",\"type\":16"),
        std::string::npos)
        << name << " does not run the new program";
}

class SaturationTest : public FirmwareTest, public testing::WithParamInterface<double> {};

TEST_P(SaturationTest, StarvesNobody) {
  add_grid(scenario_, "3x3", 50, robot("beacon"));
  scenario_.lamp = {parse_lamp("run@0.6x20")};
  scenario_.drift_ppm = GetParam();
  scenario_.seconds = 12;
  start();
  emulation_->run();
  std::vector<unsigned> sent;
  for (const auto& node : emulation_->nodes()) {
    const std::string name = "\"node\":\"" + node->name() + "\",\"event\":\"sent\"";
    unsigned count = 0;
    const std::string log = log_.str();
    for (std::size_t at = log.find(name); at != std::string::npos; at = log.find(name, at + 1))
      ++count;
    sent.push_back(count);
  }
  const auto [least, most] = std::minmax_element(sent.begin(), sent.end());
  std::printf("frames sent: %u to %u\n", *least, *most);
  EXPECT_GE(*least * 2, *most);
  EXPECT_GT(*least, 50u);
}

INSTANTIATE_TEST_SUITE_P(Drifts, SaturationTest, testing::Values(0.0, 10'000.0));

TEST_F(FirmwareTest, MeasuresDistances) {
  for (const double distance_mm : {36.0, 45.0, 50.0, 60.0, 75.0, 90.0}) {
    scenario_.robots.clear();
    for (const double x_mm : {0.0, distance_mm}) {
      scenario_.robots.push_back(robot("beacon"));
      scenario_.robots.back().x_mm = x_mm;
    }
    scenario_.lamp = {parse_lamp("run@0.6x20")};
    start();
    wait(2.5);
    for (const auto& node : emulation_->nodes()) {
      EXPECT_GT(word(*node, "beacon_heard"), 3u) << distance_mm;
      EXPECT_NEAR(word(*node, "beacon_distance_mm"), distance_mm, 2);
    }
  }
}

TEST_F(FirmwareTest, ReportsWhatTheGatewayHearsAndNeverSends) {
  scenario_.robots = {robot("gateway"), robot("beacon")};
  scenario_.robots[1].x_mm = 50;
  scenario_.logs_heard = true;
  scenario_.lamp = {parse_lamp("run@0.6x20")};
  scenario_.seconds = 4;
  start();
  emulation_->run();
  const std::string log = log_.str();
  const auto count = [&](const std::string& text) {
    unsigned found = 0;
    for (std::size_t at = log.find(text); at != std::string::npos; at = log.find(text, at + 1))
      ++found;
    return found;
  };
  // What has reached it undamaged; the lamp, which listens to nobody, has destroyed some.
  const unsigned heard = count("\"node\":\"k0\",\"event\":\"heard\",\"type\":16,");
  EXPECT_GT(heard, 20u);
  EXPECT_EQ(count("\"node\":\"k0\",\"event\":\"sent\""), 0u);
  // A report is 23 bytes on the line, the last one zero; hellos are shorter.
  unsigned reports = 0;
  const std::string start_text = "\"node\":\"k0\",\"event\":\"serial\",\"hex\":\"";
  for (std::size_t at = log.find(start_text); at != std::string::npos;
       at = log.find(start_text, at + 1)) {
    const std::size_t hex = at + start_text.size();
    reports += log.find('"', hex) - hex == 46 ? 1 : 0;
  }
  EXPECT_LE(reports, heard);
  EXPECT_GE(reports + 1, heard) << "the last one may still be on the line";
}

}  // namespace
}  // namespace swarmtalk::emulator
