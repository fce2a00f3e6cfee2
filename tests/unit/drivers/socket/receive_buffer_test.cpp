// What a link says when the kernel gives it a smaller receive buffer than it asks for; of RawL2Link
// raw_l2_config_test.cpp has it.
#include <cap-ng.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <sstream>
#include <thread>

#include "drivers/socket/udp.hpp"
#include "tests/unit/drivers/test_link_user.hpp"

namespace swarmtalk::drivers {
namespace {

constexpr std::size_t kBeyondAnyLimit = std::size_t{1} << 30;

class ReceiveBuffer : public ::testing::Test {
 protected:
  void SetUp() override {
    spdlog::set_default_logger(std::make_shared<spdlog::logger>(
        "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(logged_)));
    udp_.interface = "lo";
    udp_.port = udp_port();
  }
  void TearDown() override { spdlog::set_default_logger(before_); }

  /// Opens a link as an unprivileged daemon does: it may not go beyond the machine's limit.
  /// @return what was logged
  std::string log_of(const UdpConfig& config) {
    std::thread([&] {  // whose capabilities are its own
      capng_clear(CAPNG_SELECT_BOTH);
      ASSERT_EQ(capng_apply(CAPNG_SELECT_CAPS), 0);
      UdpLink link(io_, config);
    })
        .join();
    return logged_.str();
  }

  /// One line, with both sizes and what to do.
  static void expect_told(const std::string& text, const std::string& who) {
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
    for (const std::string& words :
         {who + ": the kernel gives ", std::string("not the 1073741824 of receive_buffer_bytes"),
          std::string("sysctl -w net.core.rmem_max=1073741824")}) {
      EXPECT_NE(text.find(words), std::string::npos) << text;
    }
  }

  std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
  std::ostringstream logged_;
  boost::asio::io_context io_;
  UdpConfig udp_;
};

TEST_F(ReceiveBuffer, OfUdpThatTheKernelCutsIsTold) {
  udp_.receive_buffer_bytes = kBeyondAnyLimit;
  expect_told(log_of(udp_), "udp 239.255.83.84:" + std::to_string(udp_.port) + " on lo");
}

// As on every fresh Debian: told, but nobody who left the key out has to worry.
TEST_F(ReceiveBuffer, TheUsualOneIsNoWarning) {
  spdlog::default_logger()->set_level(spdlog::level::info);
  const std::string told = log_of(udp_);
  spdlog::default_logger()->set_level(spdlog::level::warn);
  EXPECT_EQ(log_of(udp_), told) << "nothing more at the level of warnings";
}

TEST_F(ReceiveBuffer, WithinTheLimitIsNotTold) {
  udp_.receive_buffer_bytes = 65536;
  EXPECT_EQ(log_of(udp_), "");
}

}  // namespace
}  // namespace swarmtalk::drivers
