// Other programs that have a device open: child processes with a pseudo terminal.
#include "serial/holders.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "emulation/kilobot/pty.hpp"
#include "tests/support/other_program.hpp"

namespace swarmtalk::serial {
namespace {

using emulator::Pty;
using test::OtherProgram;

TEST(Holders, AreOtherProgramsThatHaveTheDeviceOpen) {
  const std::string path = testing::TempDir() + "holders-" + std::to_string(::getpid());
  Pty pty(path);  // this process has it open, and does not count
  EXPECT_TRUE(other_holders(path).seen.empty());
  OtherProgram first(pty.device(), "first");
  OtherProgram second(pty.device(), "se\x1b[cond");
  const auto seen = other_holders(path).seen;
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0].pid, first.pid());
  EXPECT_EQ(seen[0].program, "first");
  EXPECT_EQ(seen[1].program.find('\x1b'), std::string::npos) << "it is shown on terminals";
  EXPECT_EQ(text_of({seen[0]}), "pid " + std::to_string(first.pid()) + " (first)");
  EXPECT_TRUE(still_holds(seen[0], path));
  EXPECT_FALSE(still_holds({first.pid(), "first"}, "/dev/full"));
  first.end();
  EXPECT_FALSE(still_holds(seen[0], path));
  EXPECT_EQ(other_holders(path).seen.size(), 1u);
}

TEST(Holders, AreNotThoseThatMadeAPseudoTerminal) {
  Pty pty("");
  const int master = ::open("/dev/ptmx", O_RDWR | O_NOCTTY | O_CLOEXEC);
  ASSERT_GE(master, 0);
  const OtherProgram maker(pty.device(), "maker", master);
  EXPECT_TRUE(other_holders(pty.device()).seen.empty());
  ::close(master);
}

TEST(Holders, AreNoneOfWhatIsNoDevice) {
  EXPECT_TRUE(other_holders("/no/such/device").seen.empty());
  EXPECT_TRUE(other_holders("/tmp").seen.empty());
  EXPECT_EQ(text_of({}), "");
}

}  // namespace
}  // namespace swarmtalk::serial
