#include "daemon/config/config_parser.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/unit/daemon/config/config_error.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr const char* kLink = "[links.w]\ntype = \"udp\"\n";  // lines 1 and 2

std::string error_with(const std::string& text, const ConfigOptions& options) {
  try {
    parse_config(kLink + text, "f.toml", options);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

Config parsed(const std::string& text) {
  return parse_config(kLink + text, "f.toml").config;
}

struct Wrong {
  const char* name;
  std::string text;
  const char* line;
};

TEST(HowToChange, NamesTheFileAndTheSocketThatIsNotTheUsualOne) {
  ConfigOptions options;
  EXPECT_EQ(how_to_change(parse_config(kLink, "/etc/s.toml", options)),
            "/etc/s.toml, then: swarmtalk-cli reload");
  options.socket_path = "/run/my lab/1.sock";
  EXPECT_EQ(how_to_change(parse_config(kLink, "/run/my lab/1.toml", options)),
            "'/run/my lab/1.toml', then: swarmtalk-cli --socket '/run/my lab/1.sock' reload");
}

class WrongConfig : public testing::TestWithParam<Wrong> {};

TEST_P(WrongConfig, GetsExactlyThisLine) {
  EXPECT_EQ(error_of(GetParam().text), GetParam().line);
}

const std::string k200(200, 'x');

std::string many_parts() {
  std::string text;
  for (int i = 0; i < 40'000; ++i) text += "a.";
  return text;
}

const Wrong kWrong[] = {
    {"unknown_key", std::string(kLink) + "[node]\nidd = 3\n",
     "f.toml:4: key 'node.idd': is not known; did you mean 'id'?"},
    {"unknown_key_far_from_all", std::string(kLink) + "[socket]\nzzzzzz = 3\n",
     "f.toml:4: key 'socket.zzzzzz': is not known; known here: path, mode, group"},
    {"unknown_section", std::string(kLink) + "[chanels]\na = 1\n",
     "f.toml:3: key 'chanels': is not known; did you mean 'channels'?"},
    {"first_of_two_unknown_keys", std::string(kLink) + "[node]\nzz = 1\naa = 2\n",
     "f.toml:4: key 'node.zz': is not known; known here: id, id_offset, id_interface, name, pose, "
     "pose_socket, pose_max_age_ms"},
    {"unknown_section_far_from_all", std::string(kLink) + "[loop]\na = 1\n",
     "f.toml:3: key 'loop': is not known; known here: node, socket, links, channels, gateway, "
     "limits, log, metrics, reserved"},
    {"bad_type", std::string(kLink) + "[node]\nid = true\n",
     "f.toml:4: key 'node.id': is true; it must be \"auto\", \"hostname\", \"ip\" or 1 to 65534"},
    {"bad_type_of_text", "[links.w]\ntype = \"raw_l2\"\ninterface = 3\n",
     "f.toml:3: key 'links.w.interface': is 3; it must be text in double quotes"},
    {"text_for_number", std::string(kLink) + "[limits]\nclients = \"many\"\n",
     "f.toml:4: key 'limits.clients': is the text \"many\"; it must be an integer from 1 to 1000"},
    {"id_is_unknown_word", std::string(kLink) + "[node]\nid = \"random\"\n",
     "f.toml:4: key 'node.id': \"random\" is not known; use \"auto\", \"hostname\", \"ip\" or 1 to "
     "65534"},
    {"id_out_of_range", std::string(kLink) + "[node]\nid = 65535\n",
     "f.toml:4: key 'node.id': 65535 is out of range; use 1 to 65534"},
    {"pose_too_short", std::string(kLink) + "[node]\npose = [1, 2]\n",
     "f.toml:4: key 'node.pose': is not an array of 3 numbers; write [x_m, y_m, theta_rad]"},
    {"pose_not_finite", std::string(kLink) + "[node]\npose = [1, 2, inf]\n",
     "f.toml:4: key 'node.pose': inf is not a number; write [x_m, y_m, theta_rad]"},
    {"pose_outside", std::string(kLink) + "[node]\npose = [33, 0, 0]\n",
     "f.toml:4: key 'node.pose': is outside the field; x and y are in metres, -32.767 to 32.767"},
    {"pose_in_degrees", std::string(kLink) + "[node]\npose = [1, 2, 90]\n",
     "f.toml:4: key 'node.pose': has more than a whole turn as theta, which is in radians: 90 "
     "degrees are 1.5708"},
    {"pose_socket_is_the_socket",
     std::string(kLink) + "[socket]\npath = \"/a\"\n[node]\npose_socket = \"/a\"\n",
     "f.toml:6: key 'node.pose_socket': is the path of socket.path too; give each a path of its "
     "own"},
    {"metrics_are_the_sockets_lock",
     std::string(kLink) + "[socket]\npath = \"/a\"\n[metrics]\nfile = \"/a.lock\"\n",
     "f.toml:6: key 'metrics.file': is the path of socket.path too; give each a path of its own"},
    {"metrics_are_the_pose_socket",
     std::string(kLink) + "[node]\npose_socket = \"/a\"\n[metrics]\nfile = \"/a\"\n",
     "f.toml:6: key 'metrics.file': is the path of node.pose_socket too; give each a path of its "
     "own"},
    {"id_offset_beside_a_number", std::string(kLink) + "[node]\nid = 7\nid_offset = -3\n",
     "f.toml:5: key 'node.id_offset': means nothing unless node.id is \"hostname\" or \"ip\"; "
     "leave "
     "it out, or let node.id be one of them"},
    {"id_offset_of_a_random_id", std::string(kLink) + "[node]\nid_offset = 0\n",
     "f.toml:4: key 'node.id_offset': means nothing unless node.id is \"hostname\" or \"ip\"; "
     "leave "
     "it out, or let node.id be one of them"},
    {"id_interface_beside_a_hostname",
     std::string(kLink) + "[node]\nid_interface = \"eth0\"\nid = \"hostname\"\n",
     "f.toml:4: key 'node.id_interface': means nothing unless node.id is \"ip\"; leave it out, or "
     "let node.id be that"},
    {"metrics_interval_without_a_file", std::string(kLink) + "[metrics]\ninterval_s = 5\n",
     "f.toml:4: key 'metrics.interval_s': means nothing without metrics.file; leave it out, or add "
     "that"},
    {"link_without_name", "[links]\ntype = \"udp\"\n",
     "f.toml:2: key 'links.type': is the text \"udp\"; it must be a section: each link has its "
     "own, "
     "such as [links.wifi]"},
    {"text_without_quotes", "[links.w]\ntype = udp\n",
     "f.toml:2: not TOML: Error while parsing value: could not determine value type; if it is "
     "text, put it in double quotes"},
    {"number_of_text_without_quotes", "[links.w]\naddress = 239.255.83.84\n",
     "f.toml:2: not TOML: Error while parsing floating-point: expected decimal digit or exponent, "
     "saw '.'; if it is text, put it in double quotes"},
    {"value_is_missing", "[links.w]\nport =\n",
     "f.toml:2: not TOML: Error while parsing key-value pair: expected value, saw '\\n'; see "
     "https://toml.io for the format"},
    {"unknown_escape", std::string(kLink) + "[metrics]\nfile = \"C:\\kilo\"\n",
     "f.toml:4: not TOML: column 11: a backslash that begins no escape; write two of them for one"},
    {"text_without_its_second_quote", std::string(kLink) + "[log]\nlevel = \"info\n\n",
     "f.toml:4: not TOML: column 9: a text begins here with \" and has no second \" in its line; "
     "add it at its end"},
    {"backslash_before_the_end_of_a_line", std::string(kLink) + "[log]\nlevel = \"info\\\n\"\n",
     "f.toml:4: not TOML: column 9: a text begins here with \" and has no second \" in its line; "
     "add it at its end"},
    {"long_text_without_its_second_quotes", std::string(kLink) + "[log]\nlevel = '''info\n\n\n",
     "f.toml:4: not TOML: column 9: a text begins here with ''' and has no second '''; add it at "
     "its end"},
    {"key_twice", std::string(kLink) + "port = 3\nport = 4\n",
     "f.toml:4: not TOML: the key or section of this line is there twice; keep one of the two"},
    {"section_twice", std::string(kLink) + "[node]\n[log]\n[node]\n",
     "f.toml:5: not TOML: the key or section of this line is there twice; keep one of the two"},
    {"section_of_a_key_at_the_end", "links = 3\n\n[links.w]",
     "f.toml:3: not TOML: the key or section of this line is there twice; keep one of the two"},
    {"section_of_a_key", "links = 3\n[links.w]\n[node]\n",
     "f.toml:2: not TOML: the key or section of this line is there twice; keep one of the two"},
    {"long_node_name", std::string(kLink) + "[node]\nname = \"a name of 21 letters!\"\n",
     "f.toml:4: key 'node.name': has 21 bytes; a robot's name has 1 to 20"},
    {"relative_pose_socket", std::string(kLink) + "[node]\npose_socket = \"pose\"\n",
     "f.toml:4: key 'node.pose_socket': is not absolute; begin it with '/'"},
    {"channel_out_of_range", std::string(kLink) + "[channels]\na = 70000\n",
     "f.toml:4: key 'channels.a': 70000 is out of range; use 0 to 65535"},
    {"duplicate_channel_number", std::string(kLink) + "[channels]\nb = 3\na = 3\n",
     "f.toml:5: key 'channels.a': 3 is already the number of 'b'; give each channel its own"},
    {"channel_without_name", std::string(kLink) + "[channels]\n\"\" = 3\n",
     "f.toml:4: key 'channels.': is not a name for a channel; use 1 to 64 printable characters"},
    {"channel_named_by_a_number", std::string(kLink) + "[channels]\n\"7\" = 100\n",
     "f.toml:4: key 'channels.7': is a number, and a number means itself; give the channel a name"},
    {"address_of_nobody", std::string(kLink) + "address = \"0.0.0.0\"\n",
     "f.toml:3: key 'links.w.address': \"0.0.0.0\" is not an address to send to; use a multicast "
     "group "
     "such as 239.255.83.84, or a broadcast address such as 192.168.1.255"},
    {"address_cut_short", std::string(kLink) + "address = \"1.2.3\"\n",
     "f.toml:3: key 'links.w.address': \"1.2.3\" is not an address to send to; use a multicast "
     "group "
     "such as 239.255.83.84, or a broadcast address such as 192.168.1.255"},
    {"relative_socket", std::string(kLink) + "[socket]\npath = \"d.sock\"\n",
     "f.toml:4: key 'socket.path': is not absolute; begin it with '/'"},
    {"empty_socket", std::string(kLink) + "[socket]\npath = \"\"\n",
     "f.toml:4: key 'socket.path': is empty; give an absolute path"},
    {"long_socket", std::string(kLink) + "[socket]\npath = \"/" + k200 + "\"\n",
     "f.toml:4: key 'socket.path': has 201 bytes, a Unix socket's path at most 107; choose a "
     "shorter one"},
    {"bad_mode", std::string(kLink) + "[socket]\nmode = \"rw\"\n",
     "f.toml:4: key 'socket.mode': is not a file mode; write it as \"0660\""},
    {"no_links", "[node]\nid = 1\n",
     "f.toml: no [links.NAME] section, so there is nothing to send on; add one, such as "
     "[links.wifi] with type = \"raw_l2\" and interface = \"wlan0\""},
    {"link_without_type", "[links.w]\ninterface = \"wlan0\"\n",
     "f.toml:1: key 'links.w': has no 'type'; add type = \"raw_l2\", \"udp\", \"replay\" or "
     "\"kilobot\""},
    {"link_with_misspelt_type", "[links.w]\ntipe = \"udp\"\n",
     "f.toml:2: key 'links.w.tipe': is not known; did you mean 'type'?"},
    {"unknown_link_type", "[links.w]\ntype = \"wifi\"\n",
     "f.toml:2: key 'links.w.type': \"wifi\" is not known; use one of \"raw_l2\", \"udp\", "
     "\"replay\", \"kilobot\""},
    {"key_of_another_link_type", std::string(kLink) + "ethertype = 0x88B5\n",
     "f.toml:3: key 'links.w.ethertype': is not known; known here: type, profile, node_id, "
     "interface, "
     "address, port, key_file, also_key_file, virtual_range_m, virtual_range_unknown, ghosts, "
     "forward, "
     "max_forward_ttl, max_forward_wait_ms, check_freshness, rate_hz, burst_frames, "
     "jitter_us, forward_jitter_us, beacon_ms, air_rate_mbps, receive_buffer_bytes"},
    {"raw_without_interface", "[links.w]\ntype = \"raw_l2\"\n",
     "f.toml:1: key 'links.w': has no 'interface'; add interface = \"wlan0\" (`ip link` lists "
     "them)"},
    {"interface_too_long", "[links.w]\ntype = \"raw_l2\"\ninterface = \"abcdefghijklmnop\"\n",
     "f.toml:3: key 'links.w.interface': is longer than an interface's name can be (15 bytes)"},
    {"ethertype_is_a_length", "[links.w]\ntype = \"raw_l2\"\ninterface = \"w\"\nethertype = 1500\n",
     "f.toml:4: key 'links.w.ethertype': 1500 is out of range; use 1536 to 65535"},
    {"ethertype_of_arp", "[links.w]\ntype = \"raw_l2\"\ninterface = \"w\"\nethertype = 0x0806\n",
     "f.toml:4: key 'links.w.ethertype': is that of the network itself (IP, ARP, VLAN or EAPOL); "
     "use "
     "one for experiments, 0x88B5 or 0x88B6"},
    {"negative_rate", std::string(kLink) + "rate_hz = -1\n",
     "f.toml:3: key 'links.w.rate_hz': -1 is out of range; use 0 to 1e+06"},
    {"range_beyond_any_arena", std::string(kLink) + "virtual_range_m = 1001\n",
     "f.toml:3: key 'links.w.virtual_range_m': 1001 is out of range; use 0 to 1000"},
    {"second_key_without_the_first", std::string(kLink) + "also_key_file = \"/k\"\n",
     "f.toml:3: key 'links.w.also_key_file': means nothing without a key_file; add that"},
    {"forward_ttl_of_nothing", std::string(kLink) + "max_forward_ttl = 0\n",
     "f.toml:3: key 'links.w.max_forward_ttl': 0 is out of range; use 1 to 255"},
    {"limits_of_no_forwarding", std::string(kLink) + "forward = false\nmax_forward_ttl = 3\n",
     "f.toml:4: key 'links.w.max_forward_ttl': means nothing with forward = false; leave one of "
     "them "
     "out"},
    {"unknown_range_without_range", std::string(kLink) + "virtual_range_unknown = \"drop\"\n",
     "f.toml:3: key 'links.w.virtual_range_unknown': means nothing without a virtual_range_m; add "
     "that"},
    {"beacons_that_fill_the_air", std::string(kLink) + "beacon_ms = 5\n",
     "f.toml:3: key 'links.w.beacon_ms': 5 would fill the air; use 20 or more, or 0 for none"},
    {"reserved_is_no_switch", std::string(kLink) + "[reserved]\ndebug = 1\n",
     "f.toml:4: key 'reserved.debug': is 1; it must be true or false"},
    {"replay_without_file", "[links.w]\ntype = \"replay\"\n",
     "f.toml:1: key 'links.w': has no 'file'; add file = \"capture.pcap\""},
    {"links_is_no_table", "links = 3\n",
     "f.toml:1: key 'links': is 3; it must be a section [links]"},
    {"default_queue_over_maximum",
     std::string(kLink) + "[limits]\nqueue_messages = 50\nqueue_messages_max = 40\n",
     "f.toml:4: key 'limits.queue_messages': 50 is out of range; use 1 to 40"},
    {"curly_quotes", std::string(kLink) + "[log]\nlevel = \u201Cinfo\u201D\n",
     "f.toml:4: not TOML: column 9: the character U+201C stands outside quotes; type a plain quote "
     "(\") instead"},
    {"no_break_space", std::string(kLink) + "[log]\n\u00A0level = \"info\"\n",
     "f.toml:4: not TOML: column 1: the character U+00A0 stands outside quotes; type a plain blank "
     "instead"},
    {"letter_outside_quotes", "\uFEFF[links.\u00E9\u00E9]\n",
     "f.toml:1: not TOML: column 8: the character U+00E9 stands outside quotes; remove it, or put "
     "the whole name or text in double quotes"},
    {"not_utf8", std::string(kLink) + "# caf\xe9\n",
     "f.toml:3: not TOML: column 6: bytes that are not UTF-8; save the file as UTF-8"},
    {"backslash_before_what_is_not_ascii", std::string(kLink) + "[log]\nlevel = \"\\\u00e9\"\n",
     "f.toml:4: not TOML: column 10: a backslash that begins no escape; write two of them for one"},
    {"control_character", std::string(kLink) + "[a\x01]\n",
     "f.toml:3: not TOML: column 3: a control character; remove it (in double quotes write \\u and "
     "its four "
     "hexadecimal digits)"},
    {"old_mac_line_ends", std::string(kLink) + "a = 1 # comment\rb = 2\r",
     "f.toml:3: not TOML: column 16: a carriage return without a line feed; save the file with "
     "line ends of "
     "Unix or Windows"},
    {"utf_16", std::string("\xFF\xFE[\0l\0", 6), "f.toml: is UTF-16; save it as UTF-8"},
    {"latin_1_key", std::string(kLink) + "caf\xe9 = 1\n",
     "f.toml:3: not TOML: column 4: bytes that are not UTF-8; save the file as UTF-8"},
    {"key_of_many_parts", std::string(kLink) + many_parts() + "a = 1\n",
     "f.toml:3: not TOML: column 512: a key of more than 256 parts; use fewer dots"},
    {"unknown_log_level", std::string(kLink) + "[log]\nlevel = \"loud\"\n",
     "f.toml:4: key 'log.level': \"loud\" is not known; use one of \"trace\", \"debug\", \"info\", "
     "\"warning\", \"error\""},
};

INSTANTIATE_TEST_SUITE_P(Table, WrongConfig, testing::ValuesIn(kWrong),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(Config, SyntaxErrorNamesItsLine) {
  const std::string error = error_of(std::string(kLink) + "[node\n");
  EXPECT_EQ(error.rfind("f.toml:3: not TOML: ", 0), 0u) << error;
  EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 0);
}

TEST(Config, ControlCharactersInAKeyStayOutOfTheErrorLine) {
  const std::string error = error_of(std::string(kLink) + "[node]\n\"a\\nb\\u001b\" = 1\n");
  EXPECT_EQ(error.rfind("f.toml:4: key 'node.a?b?'", 0), 0u) << error;
}

TEST(Config, UnicodeIsFineInStringsAndComments) {
  const Config config =
      parsed("[channels] # \u00DCberschrift\n\"gr\u00FC\u00DFe\" = 1\n'\u03E8' = 2\n");
  EXPECT_EQ(config.channels.at("gr\u00FC\u00DFe"), 1);
  EXPECT_EQ(config.channels.at("\u03E8"), 2);
}

std::string load_error(const std::string& file) {
  try {
    load_config(file);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(Config, MissingFileIsNamedWithTheReason) {
  EXPECT_EQ(
      load_error("/nonexistent/f.toml"),
      "/nonexistent/f.toml: cannot be read: No such file or directory; put one there, or start "
      "swarmtalkd with --config FILE");
}

TEST(Config, EmptyPathIsNamedAsTheOption) {
  EXPECT_EQ(load_error(""), "--config: is empty; give the path of a file");
}

TEST(Config, PipeThatNobodyWritesToIsNotWaitedFor) {
  std::string folder = std::filesystem::temp_directory_path() / "swarmtalk-config-XXXXXX";
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const std::string pipe = folder + "/f.toml";
  EXPECT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(load_error(pipe), pipe + ": is a pipe, not a file; name a file, or /dev/stdin");
  std::filesystem::remove_all(folder);
}

TEST(Config, PipeOfAShellIsRead) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const std::string text = kLink;
  EXPECT_EQ(write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  close(ends[1]);
  EXPECT_EQ(load_error("/dev/fd/" + std::to_string(ends[0])), "");
  close(ends[0]);
}

TEST(Config, FolderIsNoFile) {
  EXPECT_THROW(load_config("/"), ConfigError);
}

TEST(Config, LinkAloneIsEnough) {
  const Config config = parsed("");
  ASSERT_EQ(config.links.size(), 1u);
  EXPECT_EQ(config.links[0].name, "w");
  EXPECT_EQ(config.links[0].type, LinkType::kUdp);
  EXPECT_EQ(config.socket.path, "/run/swarmtalk/swarmtalkd.sock");
  EXPECT_EQ(config.socket.mode, 0660u);
  EXPECT_FALSE(config.node.id.has_value());
  EXPECT_FALSE(config.node.pose.has_value());
  EXPECT_EQ(config.limits.clients, 64u);
}

TEST(Config, ValuesArriveWhereTheyBelong) {
  const Config config = parsed(
      "port = 4000\nrate_hz = 12.5\njitter_us = 300\nforward_jitter_us = 0\n"
      "virtual_range_m = 1.5\nvirtual_range_unknown = \"drop\"\n"
      "max_forward_ttl = 3\nmax_forward_wait_ms = 700\n"
      "[node]\nid = 17\nname = \"scout\"\npose = [1, -2.5, 0.5]\npose_max_age_ms = 500\n"
      "[socket]\npath = \"/tmp/s\"\nmode = \"666\"\ngroup = \"robots\"\n"
      "[channels]\nhello = 1\n\"two words\" = 0xFFFF\n"
      "[limits]\nclients = 3\nqueue_messages_max = 10\n");
  EXPECT_EQ(config.links[0].port, 4000);
  EXPECT_DOUBLE_EQ(config.links[0].rate_hz, 12.5);
  EXPECT_EQ(config.links[0].jitter_us, 300u);
  EXPECT_EQ(config.links[0].forward_jitter_us, 0u);
  EXPECT_DOUBLE_EQ(config.links[0].virtual_range.limit_m, 1.5);
  EXPECT_TRUE(config.links[0].virtual_range.drops_unknown);
  EXPECT_TRUE(config.links[0].forwarding.is_on);
  EXPECT_EQ(config.links[0].forwarding.max_ttl, 3);
  EXPECT_EQ(config.links[0].forwarding.max_wait_ms, 700u);
  EXPECT_EQ(config.node.id, 17);
  EXPECT_EQ(config.node.name, "scout");
  EXPECT_DOUBLE_EQ(config.node.pose->y_m, -2.5);
  EXPECT_EQ(config.node.pose_max_age_ms, 500u);
  EXPECT_EQ(config.socket.mode, 0666u);
  EXPECT_EQ(config.socket.group, "robots");
  EXPECT_EQ(config.channels.at("two words"), 0xFFFF);
  EXPECT_EQ(config.limits.clients, 3u);
  EXPECT_EQ(config.limits.queue_messages, 10u);  // the default is cut to the maximum
}

TEST(Config, LinksKeepTheOrderOfTheFile) {
  const auto parsed_config =
      parse_config("[links.z]\ntype = \"udp\"\n[links.a]\ntype = \"udp\"\n", "f.toml");
  EXPECT_EQ(parsed_config.config.links[0].name, "z");
  EXPECT_EQ(parsed_config.config.links[1].name, "a");
}

TEST(Config, KeyLinesNameLineDefaultOrOption) {
  auto lines = parse_config(kLink, "f.toml").lines;
  EXPECT_STREQ(lines.error("links.w.type", "x").what(), "f.toml:2: key 'links.w.type': x");
  EXPECT_STREQ(lines.error("socket.path", "x").what(), "f.toml: key 'socket.path': x");
  lines.set_option("socket.path", "--socket");
  EXPECT_STREQ(lines.error("socket.path", "x").what(), "--socket: x");
}

TEST(ConfigOptions, ASocketElsewhereIsNoOtherPathsPlace) {
  ConfigOptions options;
  options.socket_path = "/s";
  EXPECT_EQ(
      error_with("[node]\npose_socket = \"/s\"\n", options),
      "f.toml:4: key 'node.pose_socket': is the path of --socket too; give each a path of its "
      "own");
  EXPECT_EQ(
      error_with("[metrics]\nfile = \"/s.lock\"\n", options),
      "f.toml:4: key 'metrics.file': is the path of --socket too; give each a path of its own");
  EXPECT_EQ(error_with("[socket]\npath = \"/t\"\n[metrics]\nfile = \"/t\"\n", options), "")
      << "the socket is elsewhere";
}

TEST(ConfigOptions, AKeyThatGoesWithTheNodeIdOfFileOrOptionIsRight) {
  ConfigOptions options;
  options.node_id = "7";
  EXPECT_EQ(error_with("[node]\nid = \"ip\"\nid_offset = -3\nid_interface = \"eth0\"\n", options),
            "");
  EXPECT_THAT(error_with("[node]\nid_offset = -3\n", options),
              testing::StartsWith("f.toml:4: key 'node.id_offset': means nothing"));
  options.node_id = "ip";
  EXPECT_EQ(error_with("[node]\nid_offset = -3\nid_interface = \"eth0\"\n", options), "");
}

TEST(ConfigOptions, AnOptionCountsInPlaceOfItsKeyAndIsNamed) {
  ConfigOptions options;
  options.socket_path = "/s";
  options.node_id = "7";
  options.log_level = "debug";
  const Config config =
      parse_config(kLink + std::string("[node]\nid = 5\n"), "f.toml", options).config;
  EXPECT_EQ(config.socket.path, "/s");
  EXPECT_EQ(config.node.id, 7);
  EXPECT_EQ(config.log_level, "debug");
  options.node_id = "70000";
  EXPECT_THAT(error_with("", options), testing::StartsWith("--node-id: \"70000\" is not known"));
  options.node_id.reset();
  options.socket_path = "";
  EXPECT_EQ(error_with("", options), "--socket: is empty; give an absolute path");
}

}  // namespace
}  // namespace swarmtalk::daemon
