#include "emulation/kilobot/image.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace swarmtalk::emulator {
namespace {

class ImageTest : public testing::Test {
 protected:
  ImageTest() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = (std::filesystem::temp_directory_path() /
             ("swarmtalk-" + std::string(test->name()) + std::to_string(::getpid())))
                .string();
  }
  ~ImageTest() override { std::filesystem::remove(path_); }

  Image load(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    return load_image(path_);
  }
  std::string error_of(const std::string& text) {
    try {
      load(text);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  std::string path_;
};

TEST_F(ImageTest, ReadsIntelHex) {
  const Image image = load(":0400100001020304E2\r\n:00000001FF\r\n");
  EXPECT_EQ(image.flash[0x10], 1);
  EXPECT_EQ(image.flash[0x13], 4);
  EXPECT_EQ(image.flash[0x14], 0xFF);
  EXPECT_EQ(image.used_bytes, 4u);
  EXPECT_EQ(image.entry, 0u);
}

TEST_F(ImageTest, StartsABootloaderAtItsFirstByte) {
  EXPECT_EQ(load(":027000000C94EE\n:00000001FF\n").entry, 0x7000u);
}

TEST_F(ImageTest, NamesTheLineOfABadRecord) {
  EXPECT_NE(error_of(":0400100001020304E2\n:0400100001020304E3\n")
                .find(": line 2: the checksum is wrong"),
            std::string::npos);
  EXPECT_NE(error_of(":04001000010203E2\n:00000001FF\n"), "");
  EXPECT_NE(error_of(":0400100001020304E2\n").find("no end record"), std::string::npos);
  EXPECT_NE(error_of(":02000004000 1F9\n"), "");
}

TEST_F(ImageTest, RefusesCodeBeyondTheFlash) {
  EXPECT_NE(error_of(":0480000001020304F2\n:00000001FF\n"), "");
  EXPECT_NE(error_of(":020000040001F9\n:0400100001020304E2\n:00000001FF\n"), "");
}

TEST_F(ImageTest, ReadsIntelHexThatAnEditorHasSaved) {
  EXPECT_EQ(
      load("\xEF\xBB\xBF; mine\r\r\n :0400100001020304E2\r\r\n:00000001FF\r\r\n\x1A").flash[0x10],
      1);
}

TEST_F(ImageTest, RefusesWhatIsNotForTheFlashWithTheCommandThatLeavesItOut) {
  const std::string error =
      error_of(":0400100001020304E2\n:02000004008179\n:0100000007F8\n:00000001FF\n");
  EXPECT_NE(error.find(": line 3: "), std::string::npos) << error;
  EXPECT_NE(error.find("EEPROM"), std::string::npos) << error;
  EXPECT_NE(error.find("-R .eeprom -R .fuse -R .lock"), std::string::npos) << error;
}

TEST_F(ImageTest, RefusesEepromDataAlone) {
  EXPECT_NE(error_of(":0100000007F8\n:00000001FF\n").find("EEPROM"), std::string::npos);
  EXPECT_EQ(error_of(":020000000C945E\n:00000001FF\n"), "");  // jmp
  EXPECT_EQ(error_of(":0200000033C00B\n:00000001FF\n"), "");  // rjmp
}

TEST_F(ImageTest, RefusesOtherFiles) {
  EXPECT_NE(error_of("hello").find("not an Intel HEX file"), std::string::npos);
  EXPECT_NE(error_of(std::string("\x7F"
                                 "ELF",
                                 4))
                .find("cut short"),
            std::string::npos);
  EXPECT_THROW(load_image(path_ + ".none"), std::runtime_error);
}

TEST_F(ImageTest, LaysABootloaderOverAProgram) {
  Image program = load(":0400100001020304E2\n:00000001FF\n");
  program.add_bootloader(load(":027000000C94EE\n:00000001FF\n"));
  EXPECT_EQ(program.flash[0x10], 1);
  EXPECT_EQ(program.flash[0x7000], 0x0C);
  EXPECT_EQ(program.entry, 0u);
  const Image other_program = load(":0400100001020304E2\n:00000001FF\n");
  EXPECT_THROW(program.add_bootloader(other_program), std::runtime_error);
}

}  // namespace
}  // namespace swarmtalk::emulator
