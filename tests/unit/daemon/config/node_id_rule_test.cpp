#include "daemon/config/node_id_rule.hpp"

#include <gmock/gmock.h>

#include <algorithm>

namespace swarmtalk::daemon {
namespace {

using testing::HasSubstr;

/// What the rule makes of a host: "7 (from ...)", or what is wrong.
std::string id_on(const Host& host, NodeConfig node) {
  KeyLines lines("f.toml");
  try {
    resolve_node_id(node, lines, [&] { return host; });
  } catch (const ConfigError& error) {
    EXPECT_EQ(node.id, std::nullopt);
    return error.what();
  }
  return std::to_string(*node.id) + " (" + node.id_source + ")";
}

std::string id_of_name(const std::string& name, std::int32_t offset = 0) {
  NodeConfig node;
  node.id_rule = NodeIdRule::kHostname;
  node.id_offset = offset;
  return id_on({name, {}}, node);
}

/// Whatever the order that the kernel has them in.
std::string id_of_addresses(std::vector<HostAddress> addresses, const std::string& interface = "",
                            std::int32_t offset = 0) {
  NodeConfig node;
  node.id_rule = NodeIdRule::kAddress;
  node.id_interface = interface;
  node.id_offset = offset;
  const std::string there = id_on({"", addresses}, node);
  std::reverse(addresses.begin(), addresses.end());
  EXPECT_EQ(id_on({"", addresses}, node), there);
  return there;
}

constexpr std::uint32_t address(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                                std::uint32_t d) {
  return a << 24 | b << 16 | c << 8 | d;
}

const HostAddress kHome{"wlan0", address(192, 168, 1, 32)};
const HostAddress kLinkLocal{"wlan0", address(169, 254, 112, 250)};

TEST(NumberInHostname, IsTheOneOfTheFirstLabel) {
  EXPECT_EQ(id_of_name("robot7"), "7 (from the host's name 'robot7')");
  EXPECT_EQ(id_of_name("robot-042"), "42 (from the host's name 'robot-042')");
  EXPECT_EQ(id_of_name("9"), "9 (from the host's name '9')");
  EXPECT_EQ(id_of_name("robot-07.lab2.example.org"),
            "7 (from the host's name 'robot-07.lab2.example.org')");
  EXPECT_EQ(id_of_name("robot-07", 100), "107 (from the host's name 'robot-07', id_offset 100)");
  EXPECT_EQ(id_of_name("r000000000000000000007"),
            "7 (from the host's name 'r000000000000000000007')");
}

TEST(NumberInHostname, IsTheLastOfSeveralAndTheyAreNamed) {
  EXPECT_EQ(id_of_name("rpi4-robot12"),
            "12 (from the last of the numbers 4 and 12 in the host's name 'rpi4-robot12')");
  EXPECT_EQ(id_of_name("lab2-robot13-pi4b.local"),
            "4 (from the last of the numbers 2, 13 and 4 in the host's name "
            "'lab2-robot13-pi4b.local')");
}

TEST(NumberInHostname, ThatCannotBeAnIdIsRefusedWithTheReason) {
  EXPECT_THAT(id_of_name("robot"), HasSubstr("'robot' has no number in it; rename the host"));
  EXPECT_THAT(id_of_name(""), HasSubstr("has no number in it; rename the host"));
  EXPECT_THAT(id_of_name("robot.lab2"), HasSubstr("no number in it before its first dot; rename"));
  EXPECT_THAT(id_of_name("robot-00"), HasSubstr("'robot-00' gives 0; a node id is 1 to 65534; re"));
  EXPECT_THAT(id_of_name("robot-70000"), HasSubstr("gives 70000; a node id is 1 to 65534; rename"));
  EXPECT_THAT(id_of_name("robot-1234567890"), HasSubstr("gives 1234567890; a node id is 1 to 655"));
  EXPECT_THAT(id_of_name("robot-99999999999999999999"), HasSubstr("gives 99999999999999999999; a"));
  EXPECT_THAT(id_of_name("robot-2", -3), HasSubstr("'robot-2' and id_offset -3 give -1; a node"));
}

TEST(NumberOfAddress, IsTheLastByteOfTheOnlyOne) {
  EXPECT_EQ(id_of_addresses({kHome}), "32 (192.168.1.32 of wlan0)");
  EXPECT_EQ(id_of_addresses({kHome}, "wlan0", -3), "29 (192.168.1.32 of wlan0, id_offset -3)");
  EXPECT_EQ(id_of_addresses({{"wlan0", address(10, 0, 1, 255)}}), "255 (10.0.1.255 of wlan0)");
  EXPECT_THAT(id_of_addresses({{"wlan0", address(10, 0, 1, 0)}}), HasSubstr("gives 0; a node id"));
}

TEST(NumberOfAddress, IsNotOfALinkLocalOneNorOfAnInterfaceThatIsDown) {
  const HostAddress down{"eth0", address(10, 0, 0, 3), false};
  EXPECT_EQ(id_of_addresses({kLinkLocal, kHome, down}), "32 (192.168.1.32 of wlan0)");
  EXPECT_EQ(id_of_addresses({kLinkLocal, kHome}, "wlan0"), "32 (192.168.1.32 of wlan0)");
  EXPECT_THAT(id_of_addresses({kLinkLocal, down}),
              HasSubstr("no IPv4 address (yet?): 10.0.0.3 of eth0 is of an interface that is down, "
                        "169.254.112.250 of wlan0 is link-local"));
  EXPECT_THAT(id_of_addresses({kLinkLocal, down}, "wlan0"), HasSubstr("\"wlan0\" has no IPv4"));
  EXPECT_THAT(id_of_addresses({down}, "eth0"), HasSubstr("\"eth0\" has no IPv4 address (yet?)"));
  EXPECT_THAT(id_of_addresses({}), HasSubstr("this machine has no IPv4 address (yet?)"));
}

TEST(NumberOfAddress, OfSeveralInterfacesNeedsTheOneThatCounts) {
  const HostAddress vpn{"wg0", address(10, 8, 0, 5)};
  EXPECT_THAT(id_of_addresses({kHome, vpn}),
              HasSubstr("wg0, wlan0 have IPv4 addresses; say which counts with id_interface"));
  EXPECT_EQ(id_of_addresses({kHome, vpn}, "wg0"), "5 (10.8.0.5 of wg0)");
}

TEST(NumberOfAddress, OfOneInterfaceMustNotDependOnTheirOrder) {
  const HostAddress other{"wlan0", address(10, 8, 0, 5)};
  EXPECT_THAT(id_of_addresses({kHome, other}, "wlan0"),
              HasSubstr("the addresses of wlan0 end in different numbers: 10.8.0.5, 192.168.1.32"));
  const HostAddress same{"wlan0", address(10, 8, 0, 32)};
  EXPECT_EQ(id_of_addresses({kHome, same}), "32 (10.8.0.32 of wlan0)");
}

TEST(NodeIdRule, ReadsWordsAndNumbers) {
  NodeConfig node;
  EXPECT_EQ(read_node_id_rule("65534", node), "");
  EXPECT_EQ(node.id_rule, NodeIdRule::kNumber);
  KeyLines lines("f");
  resolve_node_id(node, lines);
  EXPECT_EQ(node.id, 65534);
  EXPECT_EQ(node.id_source, "from node.id");
  lines.set_option("node.id", "--node-id");
  resolve_node_id(node, lines);
  EXPECT_EQ(node.id_source, "from --node-id");
  EXPECT_EQ(read_node_id_rule("hostname", node), "");
  EXPECT_EQ(node.id_rule, NodeIdRule::kHostname);
  EXPECT_EQ(read_node_id_rule("ip", node), "");
  EXPECT_EQ(node.id_rule, NodeIdRule::kAddress);
  EXPECT_EQ(read_node_id_rule("auto", node), "");
  resolve_node_id(node, lines);
  EXPECT_EQ(node.id, std::nullopt);
  EXPECT_EQ(node.id_source, kIdByChance);
  for (const char* wrong : {"", "0", "65535", "-1", "7x", "x", "123456"}) {
    EXPECT_NE(read_node_id_rule(wrong, node), "") << wrong;
  }
}

TEST(NodeIdRule, NamesTheInterfaceThatHasNoAddress) {
  NodeConfig node;
  node.id_rule = NodeIdRule::kAddress;
  node.id_interface = "nosuch0";
  try {
    resolve_node_id(node, KeyLines("f.toml"));
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("key 'node.id_interface': \"nosuch0\" has no IPv4"));
  }
}

}  // namespace
}  // namespace swarmtalk::daemon
