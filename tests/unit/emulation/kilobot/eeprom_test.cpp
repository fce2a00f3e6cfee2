#include "emulation/kilobot/eeprom.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "emulation/kilobot/image.hpp"

namespace swarmtalk::emulator {
namespace {

TEST(Eeprom, HoldsTheCalibrationAtTheStandardAddresses) {
  Calibration calibration;
  calibration.uid = 1234;
  const Eeprom eeprom = make_eeprom(calibration);
  EXPECT_EQ(eeprom.size(), kEepromBytes);
  EXPECT_EQ(eeprom[0xB0], 0xD2);
  EXPECT_EQ(eeprom[0xB1], 0x04);
  EXPECT_EQ(eeprom[0x05], 70);
  EXPECT_EQ(eeprom[0x90], 1);
  EXPECT_EQ(eeprom[0x01], 0xFF) << "no oscillator trim";
  EXPECT_EQ(eeprom[0x50] * 256 + eeprom[0x51], 1023) << "high gain, big-endian";
  EXPECT_EQ(eeprom[0x22] * 256 + eeprom[0x23], 865);
}

TEST(Eeprom, ComesBackFromItsFile) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("swarmtalk-eeprom" + std::to_string(::getpid())))
          .string();
  Eeprom eeprom = make_eeprom({});
  eeprom[7] = 42;
  save_eeprom(path, eeprom);
  EXPECT_EQ(load_eeprom(path), eeprom);
  std::ofstream(path, std::ios::binary) << "abc";
  const Eeprom loaded = load_eeprom(path);
  EXPECT_EQ(loaded[2], 'c');
  EXPECT_EQ(loaded[3], 0xFF);
  std::ofstream(path, std::ios::binary) << std::string(1025, 'x');
  EXPECT_THROW(load_eeprom(path), std::runtime_error);
  std::filesystem::remove(path);
  EXPECT_THROW(load_eeprom(path), std::runtime_error);
}

}  // namespace
}  // namespace swarmtalk::emulator
