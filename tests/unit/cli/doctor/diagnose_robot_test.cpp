// Findings of a robot on a cable: daemon, configuration, links, interface; what a daemon answers.
#include <gtest/gtest.h>

#include "cli/doctor/diagnose.hpp"
#include "cli/doctor/fix.hpp"
#include "cli/doctor/look.hpp"
#include "cli/doctor/peer.hpp"
#include "ipc/framing.hpp"

namespace swarmtalk::cli {

int caught_signal() {
  return 0;
}

namespace doctor {
namespace {

/// A robot on a cable, without a fault, that hears robot 2.
class CabledRobot : public testing::Test {
 protected:
  using State = DaemonFacts::State;

  CabledRobot() {
    facts_.cli_version = daemon_.version = "1.2.3";
    daemon_.node_id = 1;
    daemon_.is_id_fixed = daemon_.is_config_compared = true;
    daemon_.config_file = "robot.toml";
    LinkFacts link;
    link.name = "air";
    link.type = "raw_l2";
    link.interface = "a0";
    link.is_up = true;
    link.packet_bytes = link.packet_limit_bytes = 1400;
    daemon_.links.push_back(link);
    daemon_.neighbours.push_back({"air", 2, "02:00:00:00:02:00", 10, 5, false, {}});
    InterfaceFacts interface;
    interface.name = "a0";
    interface.index = 3;
    interface.is_switched_on = interface.has_carrier = true;
    interface.mtu_bytes = 1500;
    facts_.interfaces.push_back(interface);
    facts_.clock = ClockFacts{true};
  }

  Report report() {
    Report made;
    diagnose(facts_, expected_, made);
    return made;
  }
  /// The finding there is; with another id, or none, what there are.
  Finding only(const std::string& id) {
    const Report made = report();
    EXPECT_EQ(ids_in(made), id);
    return made.findings.empty() ? Finding{} : made.findings[0];
  }
  void is_without_daemon(State state) {
    daemon_.state = state;
    daemon_.is_config_compared = false;
    daemon_.links.clear();
    facts_.interfaces.clear();
  }
  std::string of_peer(const PeerFacts& peer) {
    Report made;
    diagnose_peer(peer, facts_, made);
    return ids_in(made);
  }
  static std::string ids_in(const Report& made) {
    std::string all;
    for (const Finding& each : made.findings) all += (all.empty() ? "" : " ") + each.id;
    return all;
  }
  bool is_repaired(const std::function<std::string()>& reload = {}) {
    Report made = report();
    add_fixes(facts_, expected_, reload, nullptr, made);
    return made.findings.at(0).fix && made.findings[0].fix().empty();
  }

  Facts facts_;
  DaemonFacts& daemon_ = facts_.daemon;
  Expected expected_;
};

TEST_F(CabledRobot, IsHealthyAndSaysWhatWasLookedAt) {
  const Report made = report();
  EXPECT_TRUE(made.findings.empty());
  EXPECT_TRUE(made.not_looked_at.empty());
  EXPECT_EQ(made.looked_at, (std::vector<std::string>{"daemon", "configuration", "interface a0",
                                                      "link air", "clock"}));
}

TEST_F(CabledRobot, IsHealthyAlone) {
  daemon_.neighbours.clear();
  EXPECT_EQ(only("nobody-heard").severity, Severity::kNote);
  EXPECT_FALSE(report().has_findings());
}

TEST_F(CabledRobot, HearsARobotFromItsOwnAddress) {
  facts_.interfaces[0].mac = {2, 0, 0, 0, 2, 0};
  const Finding found = only("address-twice");
  EXPECT_EQ(found.subject, "a0");
  EXPECT_NE(found.remedy.find("sudo ip link set a0 address 02:00:00:00:00:NN"), std::string::npos);
  daemon_.neighbours[0].is_ghost = true;
  EXPECT_TRUE(report().findings.empty());
  daemon_.neighbours[0].is_ghost = false;
  daemon_.neighbours[0].link = daemon_.links[0].name = "other";
  only("address-twice");
  daemon_.neighbours[0].link = "air";
  only("nobody-heard");
}

TEST_F(CabledRobot, DoesNotBlameAntennasForAnAddressThatBothHave) {
  PeerFacts peer;
  peer.robot = 2;
  peer.asked = 75;
  peer.frames = 30;
  EXPECT_EQ(of_peer(peer), "peer-silent");
  facts_.interfaces[0].mac = {2, 0, 0, 0, 2, 0};
  EXPECT_EQ(of_peer(peer), "");
  peer.answered = peer.heard_there = 10;
  EXPECT_EQ(of_peer(peer), "");
  peer.robot = 3;
  EXPECT_EQ(of_peer(peer), "one-way");
}

TEST_F(CabledRobot, HasAnInterfaceThatIsOffUnpluggedOrElsewhere) {
  LinkFacts& link = daemon_.links[0];
  link.is_up = facts_.interfaces[0].has_carrier = false;
  EXPECT_EQ(only("no-carrier").subject, "a0");
  facts_.interfaces[0].is_switched_on = false;
  EXPECT_EQ(only("interface-down").remedy, "sudo ip link set a0 up");
  facts_.interfaces[0].index = 0;
  link.state = "down: interface 'a0' is gone";
  EXPECT_EQ(only("interface-missing").subject, "a0");
  link.state = "down: waiting for interface 'a0'";
  EXPECT_EQ(only("interface-missing").subject, "a0");
  link.state = "down: interface 'a0' is switched off";  // so it is where the daemon runs
  EXPECT_EQ(only("link-down").what, link.state);
  link.is_up = true;
  link.state = "up, MTU 1500 bytes";
  EXPECT_TRUE(report().findings.empty());
  EXPECT_EQ(report().not_looked_at.at(0).what, "interface a0");
  link.state = "up (renamed to 'b0'), MTU 1500 bytes";
  EXPECT_EQ(only("interface-renamed").severity, Severity::kWarning);
  EXPECT_EQ(report().not_looked_at.at(0).why, "it has another name now");
}

TEST_F(CabledRobot, HasABridgeOverItsInterface) {
  facts_.interfaces[0].bridge = "br0";
  const Finding port = only("bridge-port");
  EXPECT_EQ(port.severity, Severity::kError);
  EXPECT_NE(port.remedy.find("set interface = \"br0\" in [links.air]"), std::string::npos);
  daemon_.links[0].is_up = false;
  EXPECT_EQ(only("bridge-port").subject, "a0");
}

TEST_F(CabledRobot, HasNoAddressForItsDatagrams) {
  facts_.interfaces[0].has_ipv4_address = false;
  EXPECT_FALSE(report().has_findings()) << "raw frames need none";
  daemon_.links[0].type = "udp";
  EXPECT_EQ(only("no-address").severity, Severity::kWarning);
  daemon_.links[0].is_up = false;
  const Finding lost = only("no-address");
  EXPECT_EQ(lost.severity, Severity::kError);
  EXPECT_NE(lost.remedy.find("dev a0"), std::string::npos);
  daemon_.links[0].is_up = facts_.interfaces[0].is_loopback = true;
  EXPECT_FALSE(report().has_findings());
}

TEST_F(CabledRobot, HasAnInterfaceThatNobodyHasAuthorised) {
  facts_.interfaces[0].is_dormant = true;
  const Finding dormant = only("not-authorised");
  EXPECT_EQ(dormant.severity, Severity::kWarning) << "frames pass as far as the switch lets them";
  EXPECT_NE(dormant.remedy.find("ip link set a0 mode default state up"), std::string::npos);
  facts_.interfaces[0].is_radio = true;
  daemon_.links[0].is_up = false;
  EXPECT_EQ(only("not-authorised").severity, Severity::kError);
}

TEST_F(CabledRobot, HasARadioThatIsBlocked) {
  daemon_.links[0].is_up = facts_.interfaces[0].is_switched_on = false;
  facts_.interfaces[0].is_radio = true;
  facts_.interfaces[0].block = RadioBlock::kSoft;
  const Finding soft = only("radio-blocked");
  EXPECT_EQ(soft.severity, Severity::kError);
  EXPECT_NE(soft.remedy.find("rfkill unblock wifi"), std::string::npos);
  EXPECT_NE(soft.remedy.find("raspi-config nonint do_wifi_country"), std::string::npos);
  facts_.interfaces[0].block = RadioBlock::kHard;
  EXPECT_EQ(only("radio-blocked").remedy.find("rfkill unblock"), std::string::npos);
}

TEST_F(CabledRobot, HasASmallMtu) {
  facts_.interfaces[0].mtu_bytes = 600;
  daemon_.links[0].packet_limit_bytes = 500;
  const std::string small = only("mtu-small").what;
  EXPECT_NE(small.find("600 bytes"), std::string::npos);
  EXPECT_NE(small.find("500 of 1400"), std::string::npos);
}

TEST_F(CabledRobot, IsToldOfAnMtuThatOthersMayExceed) {
  facts_.interfaces[0].mtu_bytes = 1468;
  const Finding small = only("mtu-small");
  EXPECT_EQ(small.severity, Severity::kNote);
  EXPECT_NE(small.remedy.find("sudo ip link set a0 mtu 1500"), std::string::npos);
  Report made = report();
  add_fixes(facts_, expected_, {}, nullptr, made);
  EXPECT_FALSE(made.findings[0].fix) << "all robots may have this MTU";
  facts_.interfaces[0].mtu_bytes = 9000;
  EXPECT_TRUE(report().findings.empty());
  facts_.interfaces[0].mtu_bytes = 1468;
  daemon_.links[0].type = "udp";
  EXPECT_TRUE(report().findings.empty()) << "frames of UDP follow the path";
}

TEST_F(CabledRobot, HearsTooLittleOfAnother) {
  const auto hears = [this](double loss, std::uint32_t frames) {
    daemon_.neighbours[0].loss = loss;
    daemon_.neighbours[0].loss_frames = frames;
    return report().has_findings();
  };
  EXPECT_FALSE(hears(0.4, 1000)) << "usual on a full Wi-Fi";
  EXPECT_FALSE(hears(0.5, 10)) << "may be chance";
  EXPECT_FALSE(hears(0.6, 20));
  EXPECT_TRUE(hears(0.75, 10));
  EXPECT_TRUE(hears(0.68, 150));
  daemon_.neighbours.push_back(daemon_.neighbours[0]);
  daemon_.neighbours[1].node_id = 7;
  daemon_.neighbours[1].loss = 0.9;
  const Finding found = only("neighbour-lossy");
  EXPECT_EQ(found.severity, Severity::kWarning);
  EXPECT_EQ(found.subject, "link air");
  EXPECT_NE(found.what.find("robot 2 68 %, robot 7 90 %"), std::string::npos);
  EXPECT_NE(found.remedy.find("swarmtalk-cli doctor --peer 2`"), std::string::npos);
  EXPECT_NE(found.remedy.find("1500 here"), std::string::npos);
  daemon_.links[0].rises["kernel_drops"] = 3;
  only("kernel-drops");
}

TEST_F(CabledRobot, HasAnotherMtuThanThePeerByItsReport) {
  const auto ids = [&](std::size_t ours, std::uint32_t theirs) {
    PeerFacts peer;
    peer.robot = 2;
    peer.asked = peer.heard_there = peer.answered = 75;
    facts_.interfaces[0].mtu_bytes = ours;
    peer.report.emplace().mtu_bytes = theirs;
    return of_peer(peer);
  };
  EXPECT_EQ(ids(1500, 1468), "mtu-differs");
  EXPECT_EQ(ids(600, 1500), "mtu-differs");
  EXPECT_EQ(ids(1468, 1468), "");
  EXPECT_EQ(ids(1500, 9000), "") << "longer frames are never sent";
  EXPECT_EQ(ids(600, 0), "") << "it does not tell";
}

TEST_F(CabledRobot, SharesASerialDevice) {
  facts_.serial_devices.push_back({"/dev/ttyUSB7", "", true});
  EXPECT_TRUE(report().findings.empty());
  EXPECT_TRUE(report().not_looked_at.empty());
  facts_.serial_devices[0].are_all = false;
  ASSERT_EQ(report().not_looked_at.size(), 1u);
  EXPECT_NE(report().not_looked_at[0].why.find("sudo swarmtalk-cli doctor"), std::string::npos);
  facts_.serial_devices[0].others = "pid 7 (cat)";
  const Finding shared = only("device-shared");
  EXPECT_EQ(shared.subject, "/dev/ttyUSB7");
  EXPECT_NE(shared.what.find("pid 7 (cat)"), std::string::npos);
}

TEST_F(CabledRobot, HasADaemonThatDoesNotServe) {
  daemon_.trouble = "what connecting said";
  for (const auto& [state, id] :
       std::map<State, std::string>{{State::kAbsent, "daemon-absent"},
                                    {State::kDead, "daemon-dead"},
                                    {State::kOther, "daemon-silent"},
                                    {State::kNoPermission, "socket-permission"}}) {
    is_without_daemon(state);
    const Finding found = only(id);
    EXPECT_EQ(found.what, "what connecting said");
    EXPECT_EQ(found.severity, Severity::kError);
  }
}

TEST_F(CabledRobot, HasADaemonThatIsNoServiceAndHasEnded) {
  daemon_.words = words_for("/run/my lab/1.sock");
  is_without_daemon(State::kDead);
  daemon_.trouble = "nobody listens; start swarmtalkd for that socket";
  const Finding found = only("daemon-dead");
  EXPECT_EQ(found.what, "nobody listens") << "there is one remedy";
  EXPECT_EQ(found.remedy.find("systemctl"), std::string::npos) << found.remedy;
  EXPECT_EQ(daemon_.words.cli, "swarmtalk-cli --socket '/run/my lab/1.sock'");
  EXPECT_EQ(words_for(ipc::kDefaultSocketPath).cli, "swarmtalk-cli");
}

TEST_F(CabledRobot, GetsTheOneRemedyThatConnectingNamed) {
  for (const std::string words : {"it is for ada alone: be ada", "a lab is up, and so on"}) {
    is_without_daemon(words[0] == 'i' ? State::kNoPermission : State::kAbsent);
    daemon_.trouble = "no way to /run/s; " + words;
    const Finding found = report().findings.at(0);
    EXPECT_EQ(found.what + "; " + found.remedy, daemon_.trouble);
  }
}

TEST_F(CabledRobot, HasAWrongConfigurationWhetherTheDaemonRunsOrNot) {
  daemon_.config_error = "robot.toml:7: unknown key 'links.air.beacon'";
  EXPECT_EQ(only("configuration-wrong").what, *daemon_.config_error);
  daemon_.state = State::kAbsent;
  daemon_.links.clear();
  const Report made = report();
  ASSERT_EQ(made.findings.size(), 2u);
  EXPECT_EQ(made.findings[0].id, "daemon-absent");
  EXPECT_EQ(made.findings[1].id, "configuration-wrong");
}

TEST_F(CabledRobot, HasAConfigurationThatItsDaemonMayNotRead) {
  daemon_.config_error = "robot.toml: cannot be read by user pi: Permission denied; run: chmod it";
  const std::string remedy = only("configuration-wrong").remedy;
  EXPECT_EQ(remedy.find("--check"), std::string::npos) << remedy;
  EXPECT_NE(remedy.find("swarmtalk-cli reload"), std::string::npos) << remedy;
}

TEST_F(CabledRobot, HasAConfigurationThatIsNotInForce) {
  daemon_.config_reload = {"links.air.beacon_ms", "node.pose"};
  EXPECT_NE(only("configuration-changed").what.find("links.air.beacon_ms, node.pose"),
            std::string::npos);
  EXPECT_TRUE(is_repaired([] { return std::string(); }));
  EXPECT_FALSE(is_repaired([] { return std::string("refused"); }));
  daemon_.config_reload.clear();
  daemon_.config_restart = {"links.air.ethertype"};
  EXPECT_NE(only("configuration-needs-restart").what.find("ethertype"), std::string::npos);
}

TEST_F(CabledRobot, HasADaemonOfAnotherVersion) {
  daemon_.version = "9.2.3";
  const Finding found = only("version-differs");
  EXPECT_NE(found.what.find("9.2.3"), std::string::npos);
  EXPECT_NE(found.what.find("1.2.3"), std::string::npos);
}

TEST_F(CabledRobot, HasAReceiveBufferThatTheKernelCuts) {
  daemon_.links[0].asked_buffer_bytes = 67108864;
  daemon_.links[0].given_buffer_bytes = 67108864;
  EXPECT_TRUE(report().findings.empty());
  daemon_.links[0].given_buffer_bytes = 212992;
  const Finding found = only("receive-buffer");
  EXPECT_NE(found.what.find("212992"), std::string::npos);
  EXPECT_NE(found.remedy.find("rmem_max=67108864"), std::string::npos);
}

TEST_F(CabledRobot, SharesItsIdWithAnother) {
  daemon_.id_collisions = 1;
  daemon_.node_id_source = "from the host's name 'robot-01'";
  const Finding found = only("node-id-collision");
  EXPECT_EQ(found.subject, "robot 1");
  EXPECT_NE(found.what.find("'robot-01'"), std::string::npos);
  EXPECT_NE(found.remedy.find("`swarmtalk-cli reload`"), std::string::npos);
  daemon_.id_collisions = 0;  // it says little, and was heard before doctor looked
  daemon_.neighbours.push_back({"air", 1, "02:00:00:00:01:02", 10, 5, true, {}});
  EXPECT_NE(only("node-id-collision").what.find("02:00:00:00:01:02"), std::string::npos);
  daemon_.is_id_fixed = false;  // it draws another one
  EXPECT_TRUE(report().findings.empty());
}

TEST_F(CabledRobot, WouldNotFindItsIdAtItsNextStart) {
  daemon_.id_trouble = "robot.toml:2: key 'node.id': is \"ip\", but";
  daemon_.config_file = "robot.toml";
  const Finding found = only("node-id-missing");
  EXPECT_EQ(found.severity, Severity::kWarning);
  EXPECT_NE(found.what.find("robot.toml:2: key"), std::string::npos);
  EXPECT_NE(found.remedy.find("`swarmtalkd --check --config robot.toml`"), std::string::npos);
}

TEST_F(CabledRobot, HearsTwoRobotsOfOneIdAndNamesBothOnce) {
  daemon_.neighbours.push_back({"air", 7, "02:00:00:00:07:01", 10, 5, true, {}});
  daemon_.neighbours.push_back({"air", 7, "02:00:00:00:07:02", 10, 5, true, {}});
  const Finding found = only("node-id-collision");
  EXPECT_EQ(found.subject, "robot 7");
  EXPECT_NE(found.what.find("02:00:00:00:07:01 and 02:00:00:00:07:02"), std::string::npos);
}

TEST_F(CabledRobot, HasADaemonWithoutALink) {
  daemon_.links.clear();
  facts_.interfaces.clear();
  EXPECT_EQ(only("link-down").subject, "swarmtalkd");
}

TEST_F(CabledRobot, HearsNothingOfAPeerForOneOfSeveralReasons) {
  PeerFacts peer;
  peer.robot = 2;
  peer.asked = 75;
  peer.is_captured = true;
  peer.link = "air";
  const auto found = [&] {
    Report made;
    diagnose_peer(peer, facts_, made);
    return made.findings.at(0).id;
  };
  EXPECT_EQ(found(), "peer-silent");
  peer.is_reached = true;
  EXPECT_EQ(found(), "ethertype-filtered");
  daemon_.links[0].type = "udp";
  EXPECT_EQ(found(), "multicast-filtered");
  peer.is_reached = false;
  EXPECT_EQ(found(), "client-isolation");
}

void count(ipc::LinkStatus& link, const std::string& name, std::uint64_t value) {
  ipc::Counter& counter = *link.add_counters();
  counter.set_name(name);
  counter.set_value(value);
}

TEST(DaemonAnswers, AreReadAsFactsAndCountersAsTheirRise) {
  ipc::Status first;
  first.set_version("1.2.3");
  first.set_node_id(5);
  first.set_node_id_fixed(true);
  first.set_node_id_source("from node.id");
  first.set_config_file("robot.toml");
  ipc::LinkStatus& link = *first.add_links();
  link.set_name("air");
  link.set_type("raw_l2");
  link.set_interface("a0");
  link.set_up(true);
  link.set_mtu_bytes(1400);
  link.set_packet_limit_bytes(500);
  link.set_ethertype(0x88b5);
  link.set_asked_buffer_bytes(100);
  link.set_given_buffer_bytes(50);
  ipc::Status second = first;
  count(*first.mutable_links(0), "kernel_drops", 7);
  count(*second.mutable_links(0), "kernel_drops", 9);
  count(*first.mutable_links(0), "send_errors", 3);  // the link was opened anew meanwhile
  count(*second.mutable_links(0), "send_errors", 1);
  ipc::Counter& collisions = *second.add_counters();
  collisions.set_name("duplicate_node_ids");
  collisions.set_value(2);
  DaemonFacts facts;
  take_status(first, second, facts);
  EXPECT_EQ(facts.version, "1.2.3");
  EXPECT_EQ(facts.node_id, 5u);
  EXPECT_TRUE(facts.is_id_fixed);
  EXPECT_EQ(facts.node_id_source, "from node.id");
  EXPECT_EQ(facts.config_file, "robot.toml");
  EXPECT_EQ(facts.id_collisions, 2u);
  ASSERT_EQ(facts.links.size(), 1u);
  const LinkFacts& read = facts.links[0];
  EXPECT_EQ(read.interface, "a0");
  EXPECT_TRUE(read.is_up);
  EXPECT_EQ(read.packet_bytes, 1400u);
  EXPECT_EQ(read.packet_limit_bytes, 500u);
  EXPECT_EQ(read.ethertype, 0x88b5u);
  EXPECT_EQ(read.asked_buffer_bytes, 100u);
  EXPECT_EQ(read.given_buffer_bytes, 50u);
  EXPECT_EQ(read.rises.at("kernel_drops"), 2u);
  EXPECT_EQ(read.rises.at("send_errors"), 0u);
}

TEST(DaemonAnswers, NameRobotsThatShareAnId) {
  ipc::Neighbours neighbours;
  for (const char* address : {"02:00:00:00:07:01", "02:00:00:00:07:02"}) {
    ipc::Neighbour& each = *neighbours.add_neighbours();
    each.set_link("air");
    each.set_node_id(7);
    each.set_address(address);
    each.set_duplicate_id(true);
    each.set_loss(0.75F);
    each.set_loss_frames(40);
  }
  DaemonFacts facts;
  take_neighbours(neighbours, facts);
  ASSERT_EQ(facts.neighbours.size(), 2u);
  EXPECT_EQ(facts.neighbours[1].address, "02:00:00:00:07:02");
  EXPECT_TRUE(facts.neighbours[1].is_duplicate);
  EXPECT_FALSE(facts.neighbours[1].signal_dbm);
  EXPECT_EQ(facts.neighbours[1].loss, 0.75);
  EXPECT_EQ(facts.neighbours[1].loss_frames, 40u);
}

TEST(DaemonAnswers, AreMissedWhereNoDaemonIs) {
  const std::string path = testing::TempDir() + "no-daemon-" + std::to_string(::getpid());
  Common common;
  common.socket_path = path;
  const DaemonFacts facts = look_at_daemon(common, 0, "/nonexistent.toml");
  EXPECT_EQ(facts.state, DaemonFacts::State::kAbsent);
  EXPECT_NE(facts.trouble.find(path), std::string::npos);
  EXPECT_EQ(facts.config_file, "/nonexistent.toml");
  EXPECT_FALSE(facts.config_error);
}

TEST(Interfaces, AreThoseOfTheKernel) {
  const InterfaceFacts loopback = look_at_interface("lo", nullptr);
  EXPECT_EQ(loopback.name, "lo");
  EXPECT_NE(loopback.index, 0u);
  EXPECT_GE(loopback.mtu_bytes, 1500u);
  EXPECT_FALSE(loopback.is_radio);
  EXPECT_EQ(look_at_interface("wlan7", nullptr).index, 0u);
}

}  // namespace
}  // namespace doctor
}  // namespace swarmtalk::cli
