#include "daemon/config/node_id_rule.hpp"

#include <gmock/gmock.h>

namespace swarmtalk::daemon {
namespace {

TEST(NumberInHostname, IsTheLastRunOfDigits) {
  EXPECT_EQ(number_in_hostname("robot7"), 7);
  EXPECT_EQ(number_in_hostname("robot-042"), 42);
  EXPECT_EQ(number_in_hostname("lab2-robot13-pi"), 13);
  EXPECT_EQ(number_in_hostname("9"), 9);
  EXPECT_EQ(number_in_hostname("robot"), std::nullopt);
  EXPECT_EQ(number_in_hostname(""), std::nullopt);
  EXPECT_EQ(number_in_hostname("robot99999999999999999999"), std::nullopt);
}

TEST(NodeIdRule, ReadsWordsAndNumbers) {
  NodeConfig node;
  EXPECT_EQ(read_node_id_rule("65534", node), "");
  EXPECT_EQ(node.id_rule, NodeIdRule::kNumber);
  EXPECT_EQ(resolve_node_id(node, KeyLines("f")), 65534);
  EXPECT_EQ(read_node_id_rule("hostname", node), "");
  EXPECT_EQ(node.id_rule, NodeIdRule::kHostname);
  EXPECT_EQ(read_node_id_rule("ip", node), "");
  EXPECT_EQ(node.id_rule, NodeIdRule::kAddress);
  EXPECT_EQ(read_node_id_rule("auto", node), "");
  EXPECT_EQ(resolve_node_id(node, KeyLines("f")), std::nullopt);
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
    EXPECT_THAT(error.what(),
                testing::HasSubstr("key 'node.id_interface': \"nosuch0\" has no IPv4"));
  }
}

}  // namespace
}  // namespace swarmtalk::daemon
