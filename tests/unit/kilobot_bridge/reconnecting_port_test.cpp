// A serial device that goes and comes back: a pseudo-terminal whose path leads to another one.
#include "kilobot_bridge/reconnecting_port.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <optional>

#include "emulation/kilobot/pty.hpp"
#include "tests/support/other_program.hpp"
#include "tests/support/patience.hpp"

namespace swarmtalk::kilobot_bridge {
namespace {

using emulator::Pty;
using Bytes = std::vector<std::uint8_t>;

class ReconnectingPortTest : public testing::Test, public PortUser {
 protected:
  void on_port_open(ReconnectingPort&) override { told.emplace_back("open"); }
  void on_port_lost(ReconnectingPort&) override { told.emplace_back("lost"); }
  void on_port_bytes(ReconnectingPort&, std::span<const std::uint8_t> bytes) override {
    came.insert(came.end(), bytes.begin(), bytes.end());
  }

  void plug_in() { pty.emplace(path_); }
  void unplug() { pty.reset(); }
  /// Runs the port until `is_so`.
  template <class Condition>
  bool comes(Condition is_so) {
    const auto end = std::chrono::steady_clock::now() + test::kPatience;
    while (!is_so() && std::chrono::steady_clock::now() < end) {
      io.run_one_for(std::chrono::milliseconds(100));
    }
    return is_so();
  }
  bool is_told(const std::vector<std::string>& all) {
    return comes([&] { return told.size() >= all.size(); }) && told == all;
  }
  /// What the device's other end gets of `bytes`.
  Bytes arrive(const Bytes& bytes) {
    EXPECT_EQ(port.write(bytes), bytes.size());
    Bytes arrived;
    while (arrived.size() < bytes.size() && pty->read_into(arrived) > 0) {
    }
    return arrived;
  }

  const std::string path_ = testing::TempDir() + "port-" + std::to_string(::getpid());
  boost::asio::io_context io;
  std::optional<Pty> pty{path_};
  std::vector<std::string> told;
  Bytes came;
  ReconnectingPort port{
      io, {path_, 38400, {std::chrono::milliseconds(1), std::chrono::milliseconds(2)}}, *this};
};

TEST_F(ReconnectingPortTest, CarriesBytesBothWays) {
  port.start();
  EXPECT_EQ(told, std::vector<std::string>{"open"});
  EXPECT_EQ(port.problem(), "");
  EXPECT_EQ(arrive({1, 2, 0, 255}), (Bytes{1, 2, 0, 255}));
  pty->write(Bytes{3, 0, 4});
  EXPECT_TRUE(comes([&] { return came.size() == 3; }));
  EXPECT_EQ(came, (Bytes{3, 0, 4}));
}

TEST_F(ReconnectingPortTest, WritesAgainAfterAWriteThatFailed) {
  port.start();
  std::vector<std::string> wanted{"open"};
  for (const std::uint64_t losses : {1, 2}) {  // the second time as the first
    unplug();
    EXPECT_EQ(port.write(Bytes{1}), 0u);
    EXPECT_EQ(port.write(Bytes{2}), 0u);
    EXPECT_EQ(told, wanted) << "not in the middle of a write";
    wanted.emplace_back("lost");
    EXPECT_TRUE(is_told(wanted));
    EXPECT_EQ(port.losses(), losses);
    EXPECT_FALSE(port.is_open());
    EXPECT_EQ(port.problem(), "Input/output error");
    EXPECT_EQ(port.write(Bytes{3}), 0u);
    plug_in();
    wanted.emplace_back("open");
    EXPECT_TRUE(is_told(wanted));
    EXPECT_EQ(port.problem(), "");
    EXPECT_EQ(arrive({4, 5}), (Bytes{4, 5}));
  }
}

TEST_F(ReconnectingPortTest, NoticesWithoutAWriteThatItIsUnplugged) {
  port.start();
  unplug();
  EXPECT_TRUE(is_told({"open", "lost"}));
  EXPECT_TRUE(comes([&] { return port.problem().find("plugged in?") != std::string::npos; }))
      << port.problem();
  plug_in();
  EXPECT_TRUE(is_told({"open", "lost", "open"}));
  EXPECT_EQ(arrive({6}), (Bytes{6}));
}

TEST_F(ReconnectingPortTest, IsOpenedAgainWhenItsUserGivesItUp) {
  port.start();
  port.fail("no answer");
  EXPECT_EQ(told, (std::vector<std::string>{"open", "lost"}));
  EXPECT_EQ(port.problem(), "no answer");
  port.fail("once more");
  EXPECT_EQ(port.losses(), 1u) << "it is given up already";
  EXPECT_TRUE(is_told({"open", "lost", "open"}));
  EXPECT_EQ(arrive({7}), (Bytes{7}));
}

TEST_F(ReconnectingPortTest, NamesAProgramThatHadTheDeviceOpenBefore) {
  port.start();
  EXPECT_EQ(port.others(), "");
  unplug();
  ASSERT_TRUE(is_told({"open", "lost"}));
  plug_in();
  test::OtherProgram thief(pty->device(), "thief");
  ASSERT_TRUE(is_told({"open", "lost", "open"}));
  EXPECT_EQ(port.others(), "pid " + std::to_string(thief.pid()) + " (thief)");
  thief.end();
  EXPECT_EQ(port.others(), "");
}

TEST_F(ReconnectingPortTest, WaitsForADeviceThatIsNotThereYet) {
  unplug();
  ReconnectingPort late(io, {path_, 38400, {std::chrono::milliseconds(1)}}, *this);
  EXPECT_FALSE(late.is_open());
  EXPECT_NE(late.problem(), "");
  late.start();
  EXPECT_TRUE(told.empty());
  plug_in();
  EXPECT_TRUE(is_told({"open"}));
  EXPECT_TRUE(late.is_open());
  EXPECT_EQ(late.losses(), 0u);
}

TEST_F(ReconnectingPortTest, RefusesWhatIsNoSerialDevice) {
  EXPECT_THROW(ReconnectingPort(io, {"/dev/null", 38400, {}}, *this), std::runtime_error);
  EXPECT_THROW(ReconnectingPort(io, {path_, 38400, {}}, *this), std::runtime_error) << "in use";
}

}  // namespace
}  // namespace swarmtalk::kilobot_bridge
