// Which key of a [links.NAME] section is blamed when its link cannot be opened.
#include "daemon/station/link_factory.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "daemon/station/station_factory.hpp"
#include "tests/unit/daemon/config/config_error.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

class LinkFactoryTest : public testing::Test {
 protected:
  LinkFactoryTest() {
    char name[] = "/tmp/swarmtalk-test-XXXXXX";
    folder_ = mkdtemp(name);
    link_.name = "w";
  }
  ~LinkFactoryTest() override { std::filesystem::remove_all(folder_); }

  /// The key that is blamed, without "links.w"; all of the error if none is.
  std::string blamed() {
    try {
      open_link(io_, link_, KeyLines("f.toml"), link_.profile, 1000);
    } catch (const ConfigError& error) {
      const std::string text = error.what(), begin = "f.toml: key 'links.w";
      if (!text.starts_with(begin)) return text;
      return text.substr(begin.size(), text.find('\'', begin.size()) - begin.size());
    }
    return "opened";
  }

  std::string folder_;
  boost::asio::io_context io_;
  LinkConfig link_;
};

TEST_F(LinkFactoryTest, MissingCaptureIsBlamedAlsoWhenItsNameContainsTheOutputs) {
  link_.type = LinkType::kReplay;
  link_.file = folder_ + "/frames.pcap.old";
  link_.output = folder_ + "/frames.pcap";
  EXPECT_EQ(blamed(), ".file");
}

TEST_F(LinkFactoryTest, OutputThatCannotBeWrittenIsBlamed) {
  link_.type = LinkType::kReplay;
  link_.file = folder_ + "/frames.pcap";
  const char header[] = "\xd4\xc3\xb2\xa1\2\0\4\0\0\0\0\0\0\0\0\0\xff\xff\0\0\1\0\0";
  std::ofstream(link_.file).write(header, sizeof header);
  link_.output = folder_ + "/none/frames.pcap";
  EXPECT_EQ(blamed(), ".output");
}

TEST_F(LinkFactoryTest, AddressIsBlamedAlsoWhenTheComplaintHoldsTheInterfacesName) {
  link_.type = LinkType::kUdp;
  link_.address = "not an address";
  link_.interface = "a";
  EXPECT_EQ(blamed(), ".address");
  link_.address = "192.0.2.1";
  link_.interface = "";
  EXPECT_EQ(blamed(), ".address");
}

TEST_F(LinkFactoryTest, InterfaceThatIsNotThereIsBlamedOnlyIfNoOtherLinkCanStart) {
  link_.interface = "none0";
  link_.type = LinkType::kUdp;
  EXPECT_EQ(blamed(), "opened");
  DeafUser user;
  std::vector<std::unique_ptr<Station>> stations;
  const auto error = [&]() -> std::string {
    try {
      expect_one_to_start(stations, KeyLines("f.toml"));
    } catch (const ConfigError& refusal) {
      return refusal.what();
    }
    return "";
  };
  const auto add = [&](const std::string& name, const std::string& missing) {
    auto made = std::make_unique<FakeStation>(user, name);
    dynamic_cast<FakeLink&>(made->link()).misses = missing;
    stations.push_back(std::move(made));
  };
  add("a", "no wlan1");
  EXPECT_EQ(error(), "f.toml: key 'links.a.interface': no wlan1");
  add("b", "no wlan2");
  EXPECT_EQ(error(), "f.toml: key 'links.a.interface': no wlan1");
  add("c", "");
  EXPECT_EQ(error(), "");
}

TEST_F(LinkFactoryTest, EthertypeThatIsALengthIsBlamed) {
  link_.type = LinkType::kRawL2;
  link_.interface = "lo";
  link_.ethertype = 0x05FF;
  EXPECT_EQ(blamed(), ".ethertype");
}

TEST_F(LinkFactoryTest, PortThatIsTakenIsBlamed) {
  const int taken = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  socklen_t size = sizeof address;
  ASSERT_EQ(bind(taken, reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(getsockname(taken, reinterpret_cast<sockaddr*>(&address), &size), 0);
  link_.type = LinkType::kUdp;
  link_.port = ntohs(address.sin_port);
  EXPECT_EQ(blamed(), ".port");
  close(taken);
}

TEST_F(LinkFactoryTest, SerialDeviceIsBlamedThatIsNone) {
  const std::string file = folder_ + "/file";
  std::ofstream(file) << "x";
  link_.type = LinkType::kKilobot;
  link_.profile = frame::ProfileId::kKilobot;
  link_.kilobot.downlink = file;
  EXPECT_EQ(blamed(), ".downlink");
  link_.kilobot.downlink = "";
  link_.kilobot.uplink = file;
  EXPECT_EQ(blamed(), ".uplink");
}

}  // namespace
}  // namespace swarmtalk::daemon
