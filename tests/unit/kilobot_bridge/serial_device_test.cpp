#include "kilobot_bridge/serial_device.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <termios.h>
#include <unistd.h>

#include <fstream>
#include <optional>

#include "emulation/kilobot/pty.hpp"

namespace swarmtalk::kilobot_bridge {
namespace {

using emulator::Pty;
using Kind = OpenProblem::Kind;

constexpr unsigned kBaud = 38400;

TEST(SerialDevice, CarriesEveryByteBothWaysUnchanged) {
  Pty pty("");
  SerialDevice device;
  ASSERT_EQ(device.open(pty.device(), kBaud).kind, Kind::kNone);
  std::vector<std::uint8_t> all;
  for (unsigned i = 0; i < 256; ++i) all.push_back(static_cast<std::uint8_t>(i));
  EXPECT_EQ(device.write(all), 256);
  std::vector<std::uint8_t> received;
  while (received.size() < all.size() && pty.read_into(received) > 0) {
  }
  EXPECT_EQ(received, all);
  pty.write(all);
  std::vector<std::uint8_t> back(300);
  EXPECT_EQ(device.read(back), 256);
  back.resize(256);
  EXPECT_EQ(back, all);
  EXPECT_EQ(device.read(back), 0) << "nothing waits";
}

TEST(SerialDevice, LeavesNothingOfTheSettingsThatATerminalHas) {
  Pty pty("");
  const int beside = ::open(pty.device().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios settings{};
  ASSERT_EQ(::tcgetattr(beside, &settings), 0);
  settings.c_iflag = ICRNL | IXON;
  settings.c_oflag = OPOST | ONLCR;
  settings.c_lflag = ICANON | ECHO | ISIG;
  ASSERT_EQ(::tcsetattr(beside, TCSANOW, &settings), 0);
  SerialDevice device;
  ASSERT_EQ(device.open(pty.device(), kBaud).kind, Kind::kNone);
  ASSERT_EQ(::tcgetattr(beside, &settings), 0);
  EXPECT_EQ(settings.c_iflag, 0u);
  EXPECT_EQ(settings.c_oflag, 0u);
  EXPECT_EQ(settings.c_lflag, 0u);
  EXPECT_EQ(settings.c_cflag & (CLOCAL | CREAD | CSTOPB | HUPCL), tcflag_t{CLOCAL | CREAD});
  ::close(beside);
}

TEST(SerialDevice, IsForOneProgramAlone) {
  Pty pty("");
  SerialDevice first, second;
  ASSERT_EQ(first.open(pty.device(), kBaud).kind, Kind::kNone);
  const OpenProblem problem = second.open(pty.device(), kBaud);
  EXPECT_EQ(problem.kind, Kind::kBusy);
  EXPECT_NE(problem.text.find("another program has it open"), std::string::npos);
  EXPECT_FALSE(second.is_open());
  first.close();
  EXPECT_EQ(second.open(pty.device(), kBaud).kind, Kind::kNone);
}

TEST(SerialDevice, TellsAbsentFromWrong) {
  SerialDevice device;
  EXPECT_EQ(device.open("/dev/swarmtalk-no-such-device", kBaud).kind, Kind::kAbsent);
  EXPECT_EQ(device.open("/dev/null", kBaud).kind, Kind::kWrong);
  EXPECT_EQ(device.open("/tmp", kBaud).kind, Kind::kWrong);
  const std::string file = testing::TempDir() + "no-device-" + std::to_string(::getpid());
  std::ofstream(file) << "precious";
  EXPECT_NE(device.open(file, kBaud).text.find("not a serial device"), std::string::npos);
  std::ifstream stream(file);
  std::string content;
  stream >> content;
  EXPECT_EQ(content, "precious");
  ::unlink(file.c_str());
}

TEST(SerialDevice, NoticesThatItIsUnplugged) {
  std::optional<Pty> pty("");
  SerialDevice device;
  ASSERT_EQ(device.open(pty->device(), kBaud).kind, Kind::kNone);
  pty.reset();
  std::vector<std::uint8_t> bytes(10);
  EXPECT_EQ(device.read(bytes), -1);
  EXPECT_EQ(device.write(bytes), -1);
}

}  // namespace
}  // namespace swarmtalk::kilobot_bridge
