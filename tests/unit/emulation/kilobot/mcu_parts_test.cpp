// Analog inputs, serial line and flash of a processor that executes nothing: the test does what a
// program would.
#include <gtest/gtest.h>
#include <simavr/avr_adc.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>
#include <simavr/sim_cycle_timers.h>

#include <cstdlib>
#include <vector>

#include "emulation/kilobot/analog_inputs.hpp"
#include "emulation/kilobot/atmega328p.hpp"
#include "emulation/kilobot/flash_pages.hpp"
#include "emulation/kilobot/image.hpp"
#include "emulation/kilobot/quiet_ports.hpp"
#include "emulation/kilobot/serial_line.hpp"

namespace swarmtalk::emulator {
namespace {

namespace reg = atmega328p;

class Processor : public testing::Test {
 protected:
  Processor() : avr_(avr_make_mcu_by_name("atmega328p")) {
    avr_init(avr_);
    avr_->frequency = 8'000'000;
    avr_->log = LOG_NONE;
  }
  ~Processor() override {
    avr_terminate(avr_);
    free(avr_);
  }
  void write(std::uint16_t address, std::uint8_t value) {
    avr_->data[address] = value;
    const auto& handler = avr_->io[AVR_DATA_TO_IO(address)].w;
    if (handler.c != nullptr) handler.c(avr_, address, value, handler.param);
  }
  void pass(std::uint64_t cycles) {
    avr_->cycle += cycles;
    avr_cycle_timer_process(avr_);
  }

  avr_t* avr_;
};

TEST_F(Processor, LosesTheFourthByteThatItHasNotRead) {
  constexpr std::uint16_t kControlB = 0xC1;
  constexpr std::uint8_t kReceiverOn = 1 << 4;
  SerialLine line(avr_, [](std::uint8_t) {});
  write(kControlB, kReceiverOn);
  for (std::uint8_t i = 0; i < 3; ++i) line.push(i);
  EXPECT_EQ(line.bytes_lost(), 0u);
  line.push(3);
  EXPECT_EQ(line.bytes_lost(), 1u);
}

TEST_F(Processor, StandsStillWhileItWritesAPageAndOnlyClearsBits) {
  int changes = 0;
  FlashPages pages(avr_, [&] { ++changes; });
  avr_->flash[0] = 0x0F;
  write(reg::kSpmcsr, reg::kSelfprgen | reg::kPgwrt);
  avr_->flash[0] = 0xF3;  // what simavr does at the instruction that follows
  pass(8);
  EXPECT_EQ(changes, 1);
  EXPECT_EQ(pages.written(), 1u);
  EXPECT_EQ(avr_->flash[0], 0x03);
  EXPECT_EQ(pages.busy_until(), avr_->cycle + 36'000) << "4.5 ms";
  pages.reset();
  EXPECT_EQ(pages.busy_until(), 0u);
}

TEST_F(Processor, HandsOnWritesToAPortThatChangeIt) {
  int writes = 0;
  avr_register_io_write(
      avr_, reg::kPortB,
      [](avr_t* avr, avr_io_addr_t address, std::uint8_t value, void* count) {
        avr->data[address] = value;
        ++*static_cast<int*>(count);
      },
      &writes);
  const QuietPorts ports(avr_);
  const auto& handler = avr_->io[AVR_DATA_TO_IO(reg::kPortB)].w;
  handler.c(avr_, reg::kPortB, 0x01, handler.param);
  handler.c(avr_, reg::kPortB, 0x01, handler.param);
  EXPECT_EQ(writes, 1);
  EXPECT_EQ(avr_->data[reg::kPortB], 0x01);
}

TEST_F(Processor, ErasingAPageIsNotAWriteButTakesAsLong) {
  FlashPages pages(avr_, [] {});
  write(reg::kSpmcsr, reg::kSelfprgen | reg::kPgers);
  avr_->flash[0] = 0xFF;
  pass(8);
  EXPECT_EQ(pages.written(), 0u);
  EXPECT_EQ(avr_->flash[0], 0xFF);
  EXPECT_GT(pages.busy_until(), avr_->cycle);
}

class AnalogProcessor : public Processor {
 protected:
  AnalogProcessor() {
    avr_irq_register_notify(
        avr_io_getirq(avr_, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER),
        [](avr_irq_t*, std::uint32_t, void* count) { ++*static_cast<int*>(count); }, &conversions_);
  }
  bool is_comparator_high() const { return (avr_->data[reg::kAcsr] & reg::kAco) != 0; }

  int conversions_ = 0;
  std::vector<std::uint64_t> rises_;
  AnalogInputs inputs_{avr_, {}, [this](std::uint64_t cycle) { rises_.push_back(cycle); }};
};

TEST_F(AnalogProcessor, SeesLightFromItsCycleOn) {
  inputs_.push({100, {500, 200}, true});
  inputs_.push({200, {500, 200}, false});
  pass(99);
  EXPECT_TRUE(rises_.empty());
  pass(1);
  EXPECT_EQ(rises_, std::vector<std::uint64_t>{100});
  pass(10);
  EXPECT_TRUE(is_comparator_high());
  pass(90);
  pass(10);
  EXPECT_FALSE(is_comparator_high());
  EXPECT_EQ(rises_.size(), 1u);
  EXPECT_EQ(inputs_.late_edges(), 0u);
}

TEST_F(AnalogProcessor, CannotWriteWhatItsComparatorShows) {
  write(reg::kAcsr, reg::kAco);
  EXPECT_FALSE(is_comparator_high());
  inputs_.push({100, {500, 200}, true});
  pass(100);
  pass(10);
  write(reg::kAcsr, 0);
  EXPECT_TRUE(is_comparator_high());
}

TEST_F(AnalogProcessor, MeasuresALightThatItsComparatorSeesIfThatIsTheTrigger) {
  inputs_.push({100, {500, 200}, true});
  inputs_.push({200, {500, 200}, false});
  inputs_.push({300, {500, 200}, true});
  pass(100);
  pass(10);
  EXPECT_EQ(conversions_, 0);
  pass(90);
  pass(10);
  write(reg::kAdcsrb, reg::kAdtsComparator);
  write(reg::kAdcsra, reg::kAden | reg::kAdate);
  pass(90);
  pass(10);
  EXPECT_EQ(conversions_, 1);
}

TEST_F(AnalogProcessor, CountsLightThatComesTooLate) {
  pass(1000);
  inputs_.push({900, {500, 200}, true});
  pass(1);
  EXPECT_EQ(inputs_.late_edges(), 1u);
  EXPECT_EQ(rises_, std::vector<std::uint64_t>{1001});
}

TEST_F(AnalogProcessor, SeesWhatIsOnItsWayAfterAResetAsWell) {
  inputs_.push({100, {500, 200}, true});
  avr_reset(avr_);
  inputs_.arm();
  pass(100);
  EXPECT_EQ(rises_.size(), 1u);
}

}  // namespace
}  // namespace swarmtalk::emulator
