// What links of several profiles and gateway rules ask of the configuration.
#include "daemon/config/config_gateways.hpp"

#include <gtest/gtest.h>

#include "daemon/config/config_parser.hpp"
#include "tests/unit/daemon/config/config_error.hpp"

namespace swarmtalk::daemon {
namespace {

// Lines 1 to 6.
const std::string kTwoLinks =
    "[links.w]\ntype = \"udp\"\n[links.k]\ntype = \"udp\"\nport = 2\nprofile = \"kilobot\"\n";

TEST(GatewayConfig, BothWaysMakesTwoRules) {
  const Config config =
      parse_config(kTwoLinks +
                       "[channels]\nalarm = 1000\n[[gateway]]\nfrom = \"w/alarm\"\n"
                       "to = \"k/3\"\nboth_ways = true\nqueue_messages = 4\n",
                   "f.toml")
          .config;
  ASSERT_EQ(config.gateways.size(), 2u);
  EXPECT_EQ(config.gateways[0].from_link, 0u);
  EXPECT_EQ(config.gateways[0].from_channel, 1000);
  EXPECT_EQ(config.gateways[0].to_link, 1u);
  EXPECT_EQ(config.gateways[0].to_channel, 3);
  EXPECT_EQ(config.gateways[0].queue_messages, 4u);
  EXPECT_EQ(config.gateways[1].from_link, 1u);
  EXPECT_EQ(config.gateways[1].to_channel, 1000);
  EXPECT_TRUE(config.links[1].is_gateway_target);
}

TEST(GatewayConfig, SmallLinkSpeaksUnderTheDaemonsIdWhenItFits) {
  const Config config = parse_config(kTwoLinks + "[node]\nid = 200\n", "f.toml").config;
  EXPECT_FALSE(own_ids(config, config.links[0]));
  EXPECT_FALSE(own_ids(config, config.links[1]));
}

TEST(GatewayConfig, SmallLinkDrawsItsOwnIdAndAGatewayOneThatSaysSo) {
  const Config plain = parse_config(kTwoLinks, "f.toml").config;
  EXPECT_FALSE(own_ids(plain, plain.links[0]));
  EXPECT_EQ(own_ids(plain, plain.links[1])->most, 247);
  const Config gateway =
      parse_config(kTwoLinks + "[[gateway]]\nfrom = \"w/1\"\nto = \"k/1\"\n", "f.toml").config;
  EXPECT_EQ(own_ids(gateway, gateway.links[1])->least, 248);
  EXPECT_EQ(own_ids(gateway, gateway.links[1])->most, 254);
}

struct WrongRule {
  const char* name;
  std::string text;  // after kTwoLinks, from line 7
  const char* line;
};
class WrongGateway : public testing::TestWithParam<WrongRule> {};

TEST_P(WrongGateway, GetsExactlyThisLine) {
  EXPECT_EQ(error_of(kTwoLinks + GetParam().text), GetParam().line);
}

const WrongRule kWrongRules[] = {
    {"no_to", "[[gateway]]\nfrom = \"w/1\"\n",
     "f.toml:7: key 'gateway': has no 'to'; add to = \"LINK/CHANNEL\""},
    {"no_such_link", "[[gateway]]\nfrom = \"x/1\"\nto = \"k/1\"\n",
     "f.toml:8: key 'gateway.from': \"x/1\" does not begin with a link's name and a slash; write "
     "\"LINK/CHANNEL\" with one of the links w, k"},
    {"number_beyond_the_profile", "[[gateway]]\nfrom = \"w/1\"\nto = \"k/16\"\n",
     "f.toml:9: key 'gateway.to': channel '16' does not exist on link 'k' (profile kilobot); it "
     "has 0 to 15"},
    {"hashed_name_beyond_the_profile", "[[gateway]]\nfrom = \"w/a\"\nto = \"k/a\"\n",
     "f.toml:9: key 'gateway.to': channel 'a' (number 52512) does not exist on link 'k' (profile "
     "kilobot); it has 0 to 15"},
    {"no_channel", "[[gateway]]\nfrom = \"w/\"\nto = \"k/1\"\n",
     "f.toml:8: key 'gateway.from': \"w/\" names no channel; write \"LINK/CHANNEL\""},
    {"one_link", "[[gateway]]\nfrom = \"w/1\"\nto = \"w/2\"\n",
     "f.toml:9: key 'gateway.to': is on the same link as 'from'; a gateway joins two links"},
    {"second_rule_is_wrong",
     "[[gateway]]\nfrom = \"w/1\"\nto = \"k/1\"\n[[gateway]]\nfrom = \"w/1\"\nto = \"k/99\"\n",
     "f.toml:12: key 'gateway.to': channel '99' does not exist on link 'k' (profile kilobot); it "
     "has 0 to 15"},
    {"repeated",
     "[[gateway]]\nfrom = \"w/1\"\nto = \"k/1\"\nboth_ways = true\n[[gateway]]\nfrom = \"k/1\"\n"
     "to = \"w/1\"\n",
     "f.toml:13: key 'gateway.to': repeats another [[gateway]] rule between the same channels; "
     "remove one"},
    {"ttl", "[[gateway]]\nfrom = \"w/1\"\nto = \"k/1\"\nttl = 16\n",
     "f.toml:10: key 'gateway.ttl': 16 is too large for link 'k' (profile kilobot); use 0 to 15"},
    {"single_brackets", "[gateway]\nfrom = \"w/1\"\n",
     "f.toml:7: key 'gateway': is a table; it must be one or more sections [[gateway]]"},
    {"both_ways_is_text", "[[gateway]]\nfrom = \"w/1\"\nto = \"k/1\"\nboth_ways = \"yes\"\n",
     "f.toml:10: key 'gateway.both_ways': is the text \"yes\"; it must be true or false"},
    {"id_too_large", "[node]\nid = 300\n",
     "f.toml:3: key 'links.k': has no 'node_id', and node.id 300 does not fit the packets of link "
     "'k' (profile kilobot); add node_id = 1 to 247"},
    {"gateway_id", "[node]\nid = 30\n[[gateway]]\nfrom = \"w/1\"\nto = \"k/1\"\n",
     "f.toml:3: key 'links.k': has no 'node_id', and node.id 30 does not say that this robot is a "
     "gateway to link 'k' (profile kilobot); add node_id = 248 to 254"},
};

INSTANTIATE_TEST_SUITE_P(, WrongGateway, testing::ValuesIn(kWrongRules),
                         [](const auto& parameters) { return parameters.param.name; });

TEST(GatewayConfig, NodeIdOfALinkIsCheckedAgainstItsProfile) {
  EXPECT_EQ(error_of("[links.k]\ntype = \"udp\"\nprofile = \"kilobot\"\nnode_id = 255\n"),
            "f.toml:4: key 'links.k.node_id': 255 is out of range; use 1 to 254");
  EXPECT_EQ(error_of("[links.k]\ntype = \"udp\"\nprofile = \"kilobot\"\nnode_id = 250\n"),
            "f.toml:4: key 'links.k.node_id': 250 says that this robot is a gateway to the link, "
            "and no [[gateway]] rule copies to it; use 1 to 247");
}

TEST(GatewayConfig, ChannelOfNoLinkIsRefused) {
  const std::string small = "[links.k]\ntype = \"udp\"\nprofile = \"kilobot\"\n";
  EXPECT_EQ(error_of(small + "[channels]\na = 16\n"),
            "f.toml:5: key 'channels.a': 16 exists on no link: their profiles have the channels 0 "
            "to 15");
  EXPECT_EQ(error_of(small + "[channels]\na = 15\n"), "");
  EXPECT_EQ(error_of(kTwoLinks + "[channels]\na = 16\n"), "");
}

}  // namespace
}  // namespace swarmtalk::daemon
