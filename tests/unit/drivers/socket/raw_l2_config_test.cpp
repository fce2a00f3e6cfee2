// What RawL2Link refuses to start with, and what it says.
#include <cap-ng.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <sstream>

#include "drivers/socket/raw_l2.hpp"
#include "tests/unit/drivers/test_network.hpp"

namespace swarmtalk::drivers {
namespace {

std::string refusal(const RawL2Config& config) {
  boost::asio::io_context io;
  try {
    RawL2Link link(io, config);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "accepted";
}

RawL2Config config_of(const std::string& interface) {
  RawL2Config config;
  config.interface = interface;
  return config;
}

TEST(RawL2Config, WaitsForAnInterfaceThatIsNotThereAndNamesThoseThatAre) {
  SWARMTALK_SKIP_WITHOUT_ROOT();
  for (const char* const name : {"absent0", "an_interface_name_beyond_15_bytes"}) {
    boost::asio::io_context io;
    RawL2Link link(io, config_of(name));
    const std::string who = "raw_l2 '" + std::string(name) + "': ";
    EXPECT_EQ(link.missing().find(who + "no such interface; this machine has "), 0u)
        << link.missing();
    TestLinkUser user(1);
    link.start(user);
    EXPECT_FALSE(link.is_up());
    EXPECT_EQ(link.state().find("down: waiting for interface '" + std::string(name) + "'; "), 0u);
    for (const std::string& text : {link.missing(), link.state()}) {
      EXPECT_NE(text.find("lo"), std::string::npos) << text;
    }
  }
}

TEST(RawL2Config, RefusesTheLoopbackInterface) {
  const std::string text = refusal(config_of("lo"));
  EXPECT_NE(text.find("use a udp link"), std::string::npos) << text;
}

TEST(RawL2Config, RefusesAnEthertypeThatIsALength) {
  RawL2Config config = config_of("lo");
  config.ethertype = 0x05FF;
  const std::string text = refusal(config);
  EXPECT_NE(text.find("ethertype 0x05ff is a length"), std::string::npos) << text;
}

/// Keeps of its capabilities this one at most, of the thread that asks.
void keep_capability(bool keeps_raw) {
  capng_clear(CAPNG_SELECT_BOTH);
  if (keeps_raw) {
    capng_update(CAPNG_ADD, static_cast<capng_type_t>(CAPNG_EFFECTIVE | CAPNG_PERMITTED),
                 CAP_NET_RAW);
  }
  ASSERT_EQ(capng_apply(CAPNG_SELECT_CAPS), 0);
}

/// What is logged when a link is opened as a daemon without privileges does.
std::string log_of(const TestNetwork& network, std::size_t receive_buffer_bytes) {
  std::ostringstream logged;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(logged)));
  network.inside('a', [&] {  // in a thread of its own
    keep_capability(true);
    boost::asio::io_context io;
    RawL2Config config = config_of("air0");
    config.receive_buffer_bytes = receive_buffer_bytes;
    RawL2Link link(io, config);
  });
  spdlog::set_default_logger(before);
  return logged.str();
}

TEST(RawL2Config, OnAWireItSaysWhatIsNotEthernetWhichCapabilityIsMissingAndWhatTheKernelCuts) {
  SWARMTALK_SKIP_WITHOUT_ROOT();
  const TestNetwork network;
  network.ip('a', "tuntap add dev tun0 mode tun");
  std::string text;
  network.inside('a', [&] { text = refusal(config_of("tun0")); });
  EXPECT_NE(text.find("not an Ethernet or Wi-Fi interface"), std::string::npos) << text;
  network.inside('a', [&] {
    keep_capability(false);
    text = refusal(config_of("air0"));
  });
  EXPECT_NE(text.find("needs CAP_NET_RAW, which this root lacks (a container?); use a udp link"),
            std::string::npos)
      << text;
  EXPECT_EQ(log_of(network, 65536), "") << "it is within the limit";
  text = log_of(network, std::size_t{1} << 30);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
  for (const char* const words :
       {"raw_l2 air0: the kernel gives ", "not the 1073741824 of receive_buffer_bytes",
        "sysctl -w net.core.rmem_max=1073741824"}) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace swarmtalk::drivers
