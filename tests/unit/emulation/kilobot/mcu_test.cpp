#include "emulation/kilobot/mcu.hpp"

#include <gtest/gtest.h>

#include "emulation/kilobot/atmega328p.hpp"

namespace swarmtalk::emulator {
namespace {

constexpr std::uint64_t kMsCycles = 8000;

/// An image of hand-made instructions.
Image image_of(std::uint32_t address, std::initializer_list<std::uint16_t> words,
               Image image = {}) {
  for (const std::uint16_t word : words) {
    image.flash[address++] = static_cast<std::uint8_t>(word);
    image.flash[address++] = static_cast<std::uint8_t>(word >> 8);
  }
  return image;
}

const std::initializer_list<std::uint16_t> kLightPc3AndStay{0x9A3B /* sbi DDRC, 3 */,
                                                            0xCFFF /* rjmp . */};

class ImageFileTest : public testing::Test {
 protected:
  void load(const char* name) {
#ifdef SWARMTALK_TEST_IMAGES
    image_ = load_image(std::string(SWARMTALK_TEST_IMAGES) + name + ".elf");
    mcu_ = std::make_unique<Mcu>(image_, make_eeprom({}), McuSettings{});
#else
    static_cast<void>(name);
    GTEST_SKIP() << "avr-g++ is missing (Debian: gcc-avr, avr-libc)";
#endif
  }
  unsigned variable(const std::string& name) const {
    return mcu_->data(image_.symbols.at(name).address);
  }
  void send(const std::string& text) {
    for (const char c : text) {
      mcu_->push_serial_byte(static_cast<std::uint8_t>(c));
      mcu_->run_until(mcu_->cycle() + 2083);
    }
  }

  Image image_;
  std::unique_ptr<Mcu> mcu_;
};

TEST(Mcu, RunsToACycleAndNotMuchFurther) {
  const Image image = image_of(0, kLightPc3AndStay);
  Mcu mcu(image, make_eeprom({}), {});
  for (std::uint64_t cycle = 100; cycle < 10'000; cycle += 137) {
    mcu.run_until(cycle);
    EXPECT_GE(mcu.cycle(), cycle);
    EXPECT_LE(mcu.cycle(), cycle + 4);
  }
  EXPECT_EQ(mcu.data(atmega328p::kDdrC), 1 << 3);
}

TEST(Mcu, WrapsTheProgramCounterIntoTheBootloader) {
  // ldi r30, 0; ldi r31, 0x70; icall: to word 0x7000, which is word 0x3000 on this processor, and
  // through erased flash to the bootloader at byte 0x7000.
  const Image program = image_of(0, {0xE0E0, 0xE7F0, 0x9509});
  const Image image = image_of(kBootloaderStart, kLightPc3AndStay, program);
  Mcu mcu(image, make_eeprom({}), {});
  mcu.run_until(5 * kMsCycles);
  EXPECT_EQ(mcu.crash(), "");
  EXPECT_EQ(mcu.data(atmega328p::kDdrC), 1 << 3);
  EXPECT_EQ(mcu.program_counter(), kBootloaderStart + 2);
}

TEST(Mcu, StartsAnImageOfTheBootloaderSectionThere) {
  Image image = image_of(kBootloaderStart, kLightPc3AndStay);
  image.entry = kBootloaderStart;
  Mcu mcu(image, make_eeprom({}), {});
  mcu.run_until(100);
  EXPECT_EQ(mcu.data(atmega328p::kDdrC), 1 << 3);
}

TEST(Mcu, StopsWithAReasonWhenAProgramLeavesItsMemory) {
  // ldi r30, 0; ldi r31, 0xF0; st Z, r0
  const Image image = image_of(0, {0xE0E0, 0xEFF0, 0x8200});
  Mcu mcu(image, make_eeprom({}), {});
  mcu.run_until(1000);
  EXPECT_TRUE(mcu.is_dead());
  EXPECT_NE(mcu.crash(), "");
  EXPECT_GE(mcu.cycle(), 1000u) << "the others go on";
}

TEST(Mcu, ReportsItsInfraredPinWithTheCycle) {
  // sbi DDRB, 0; sbi PORTB, 0; cbi PORTB, 0; rjmp .
  const Image image = image_of(0, {0x9A20, 0x9A28, 0x9828, 0xCFFF});
  Mcu mcu(image, make_eeprom({}), {});
  std::vector<std::pair<std::uint64_t, bool>> edges;
  mcu.on_infrared = [&](std::uint64_t cycle, bool is_on) { edges.emplace_back(cycle, is_on); };
  mcu.run_until(100);
  const std::vector<std::pair<std::uint64_t, bool>> expected{{2, true}, {4, false}};
  ASSERT_GE(edges.size(), 2u);
  EXPECT_EQ(std::vector(edges.end() - 2, edges.end()), expected);
}

TEST(Mcu, SkipsOneWordOverAdiwAndSbiw) {
  // clr r0; ldi r24, 250; ldi r25, 0; sbrc r0, 0; adiw r24, 12 (skipped); ldi r26, 1;
  // sbrs r0, 0; adiw r24, 12; sbrs r0, 0; sbiw r24, 7 (no trouble); cpse r0, r26; sbiw r24, 15;
  // ldi r27, 1; rjmp .
  const Image image = image_of(0, {0x2400, 0xEF8A, 0xE090, 0xFC00, 0x960C, 0xE0A1, 0xFE00, 0x960C,
                                   0xFE00, 0x9707, 0x120A, 0x970F, 0xE0B1, 0xCFFF});
  Mcu mcu(image, make_eeprom({}), {});
  mcu.run_until(100);
  EXPECT_EQ(mcu.data(24) + mcu.data(25) * 256, 250 + 12 - 7 - 15);
  EXPECT_EQ(mcu.data(26), 1);
  EXPECT_EQ(mcu.data(27), 1);
  EXPECT_EQ(mcu.flash(), image.flash);
}

TEST(Mcu, SetsTheFlagsOfARepairedInstruction) {
  // ldi r24, 15; ldi r25, 0; cpse r24, r25; sbiw r24, 15; in r16, SREG; cpse r24, r16;
  // sbiw r24, 15; in r17, SREG; rjmp .
  const Image image =
      image_of(0, {0xE08F, 0xE090, 0x1389, 0x970F, 0xB70F, 0x1380, 0x970F, 0xB71F, 0xCFFF});
  Mcu mcu(image, make_eeprom({}), {});
  mcu.run_until(100);
  EXPECT_EQ(mcu.data(16) & 0x1F, 0x02) << "zero";
  EXPECT_EQ(mcu.data(17) & 0x1F, 0x15) << "sign, negative, carry";
}

TEST(Mcu, OverflowsInPhaseCorrectPwmOnceEachPeriod) {
  // ldi r16, 1; sts TCCR2A, r16; ldi r16, 2; sts TCCR2B, r16;
  // again: sbis TIFR2, 0; rjmp again; sbi TIFR2, 0; inc r17; rjmp again
  const Image image = image_of(
      0, {0xE001, 0x9300, 0x00B0, 0xE002, 0x9300, 0x00B1, 0x9BB8, 0xCFFE, 0x9AB8, 0x9513, 0xCFFB});
  Mcu mcu(image, make_eeprom({}), {});
  mcu.run_until(100 * kMsCycles);
  EXPECT_NEAR(mcu.data(17), 100 * 8000 / (8 * 510), 2);
}

TEST(Mcu, ReportsAPortsPinAlsoWhenItIsWrittenTwice) {
  // sbi DDRB, 0; sbi PORTB, 0; sbi PORTB, 0; cbi PORTB, 0; cbi PORTB, 0; rjmp .
  const Image image = image_of(0, {0x9A20, 0x9A28, 0x9A28, 0x9828, 0x9828, 0xCFFF});
  Mcu mcu(image, make_eeprom({}), {});
  std::vector<std::uint64_t> rises, falls;
  mcu.on_infrared = [&](std::uint64_t cycle, bool is_on) {
    (is_on ? rises : falls).push_back(cycle);
  };
  mcu.run_until(100);
  EXPECT_EQ(rises, std::vector<std::uint64_t>{2});
  EXPECT_EQ(falls.back(), 6u);
}

TEST(Mcu, GivesItsEepromBack) {
  const Image image = image_of(0, kLightPc3AndStay);
  Calibration calibration;
  calibration.uid = 77;
  Mcu mcu(image, make_eeprom(calibration), {});
  EXPECT_EQ(mcu.eeprom(), make_eeprom(calibration));
}

TEST_F(ImageFileTest, WakesFromPowerDownOnlyByTheWatchdog) {
  load("sleeper");
  if (IsSkipped()) return;
  mcu_->run_until(1000 * kMsCycles);
  EXPECT_NEAR(variable("watchdog_count"), 15, 2);
  EXPECT_LE(variable("timer_count"), variable("watchdog_count") + 1);
  EXPECT_GT(mcu_->slept_cycles(), 990 * kMsCycles);
}

TEST_F(ImageFileTest, LosesSerialBytesThatTheProgramDoesNotRead) {
  load("reader");
  if (IsSkipped()) return;
  mcu_->run_until(kMsCycles);
  send("abcdefgh");
  mcu_->run_until(50 * kMsCycles);
  EXPECT_EQ(variable("read_count"), 3u);
  EXPECT_EQ(variable("last_byte"), 'c');
  EXPECT_EQ(mcu_->serial_bytes_lost(), 5u);
  send("xyz");
  mcu_->run_until(60 * kMsCycles);
  EXPECT_EQ(variable("read_count"), 6u);
  EXPECT_EQ(variable("last_byte"), 'z');
}

TEST_F(ImageFileTest, IsResetByTheWatchdog) {
  load("reader");
  if (IsSkipped()) return;
  mcu_->run_until(kMsCycles);
  send("R");
  mcu_->run_until(100 * kMsCycles);
  EXPECT_EQ(mcu_->resets(), 1u);
  EXPECT_EQ(variable("read_count"), 0u);
  send("ab");
  mcu_->run_until(200 * kMsCycles);
  EXPECT_EQ(variable("read_count"), 2u);
}

TEST_F(ImageFileTest, KnowsHowMuchStackWasNeverUsed) {
  load("reader");
  if (IsSkipped()) return;
  mcu_->run_until(100);
  ASSERT_TRUE(mcu_->stack_free_bytes());
  EXPECT_GT(*mcu_->stack_free_bytes(), 2000u);
  EXPECT_LT(*mcu_->stack_free_bytes(), 2047u);
}

}  // namespace
}  // namespace swarmtalk::emulator
