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

TEST(Eeprom, IsReadFromIntelHexWhereverThatHasIt) {
  const std::string path = (std::filesystem::temp_directory_path() /
                            ("swarmtalk-eeprom-hex" + std::to_string(::getpid())))
                               .string();
  const std::string program = ":0400100001020304E2\n", space = ":02000004008179\n",
                    seven = ":0100000007F8\n", end = ":00000001FF\n";
  for (const std::string& text : {seven + end, space + seven + end, program + space + seven + end,
                                  "\xEF\xBB\xBF" + seven + end, "; of me\n" + seven + end}) {
    std::ofstream(path, std::ios::binary) << text;
    const Eeprom eeprom = load_eeprom(path);
    EXPECT_EQ(eeprom.size(), kEepromBytes);
    EXPECT_EQ(eeprom[0], 7) << text;
    EXPECT_EQ(eeprom[0x10], 0xFF) << "no program: " << text;
  }
  for (const std::string& text : {":0104000007F4\n" + end, seven, ":0100000007F9\n" + end}) {
    std::ofstream(path, std::ios::binary) << text;
    EXPECT_THROW(load_eeprom(path), std::runtime_error) << text;
  }
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace swarmtalk::emulator
