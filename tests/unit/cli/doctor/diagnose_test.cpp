// Each finding, from facts that have just this fault. Radios answer from recordings of a guest's
// simulated ones; signals and countries are built from the attributes of linux/nl80211.h.
#include "cli/doctor/diagnose.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "cli/doctor/fix.hpp"
#include "cli/doctor/look.hpp"
#include "cli/doctor/peer.hpp"
#include "tests/support/recorded_nl80211.hpp"

namespace swarmtalk::cli::doctor {
namespace {

using nl80211::built_message;
using nl80211::RecordedAsker;

const std::string kFolder = SWARMTALK_VECTORS "/nl80211/";

std::string names(const Report& report) {
  std::string text;
  for (const Finding& each : report.findings) {
    if (each.severity == Severity::kNote) continue;
    text += (text.empty() ? "" : " ") + each.id;
  }
  return text;
}

/// A robot without a fault, with its radio as it was recorded.
class Robot : public testing::Test {
 protected:
  void use(const std::string& recording) { asker_ = RecordedAsker(kFolder + recording + ".txt"); }

  Facts facts() {
    Facts facts;
    facts.cli_version = facts.daemon.version = "1.2.3";
    facts.daemon.node_id = 1;
    facts.daemon.is_id_fixed = true;
    facts.daemon.is_config_compared = true;
    facts.daemon.config_file = "robot.toml";
    LinkFacts link;
    link.name = "wifi";
    link.type = "raw_l2";
    link.interface = "wlan0";
    link.is_up = true;
    link.packet_bytes = link.packet_limit_bytes = 1400;
    link.ethertype = 0x88b5;
    link.air_rate_mbps = air_rate_mbps_;
    facts.daemon.links.push_back(link);
    facts.daemon.neighbours.push_back({"wifi", 2, "02:00:00:00:02:00", 10, 5, false, {}});
    InterfaceFacts interface;
    interface.name = "wlan0";
    interface.index = 3;
    interface.is_switched_on = interface.has_carrier = interface.is_radio = true;
    interface.mtu_bytes = 1500;
    interface.radio = look_at_radio(asker_, 3);
    facts.interfaces.push_back(interface);
    facts.clock = ClockFacts{true};
    return facts;
  }

  Report report(const Facts& of) {
    Report made;
    diagnose(of, expected_, made);
    return made;
  }
  std::string found() { return names(report(facts())); }
  std::string found(const Facts& of) { return names(report(of)); }

  /// A whole answer of one message instead of the recorded one.
  void answer(int command, const std::function<void(nl_msg*)>& fill) {
    asker_.answers[command] = {0, {built_message(command, fill)}};
  }
  void station_with_signal(int dbm) {
    answer(NL80211_CMD_GET_STATION, [dbm](nl_msg* message) {
      const std::uint8_t address[] = {2, 0, 0, 0, 2, 0};
      nla_put(message, NL80211_ATTR_MAC, sizeof address, address);
      nlattr* facts = nla_nest_start(message, NL80211_ATTR_STA_INFO);
      nla_put_u8(message, NL80211_STA_INFO_SIGNAL, static_cast<std::uint8_t>(dbm));
      nla_nest_end(message, facts);
    });
  }
  /// As recorded of another client, whose power save was on.
  void sleep() {
    use("managed");
    asker_.answers[NL80211_CMD_GET_POWER_SAVE] =
        RecordedAsker(kFolder + "managed-slow.txt").answers[NL80211_CMD_GET_POWER_SAVE];
  }
  void country(const char* letters) {
    answer(NL80211_CMD_GET_REG, [letters](nl_msg* message) {
      nla_put_string(message, NL80211_ATTR_REG_ALPHA2, letters);
    });
  }

  RecordedAsker asker_;
  Expected expected_;
  double air_rate_mbps_ = 6;
};

TEST_F(Robot, IsHealthyInEachMode) {
  for (const char* mode : {"managed", "ibss", "mesh", "ap"}) {
    use(mode);
    const Report made = report(facts());
    EXPECT_EQ(names(made), "") << mode;
    EXPECT_TRUE(made.not_looked_at.empty()) << mode << ": " << made.not_looked_at[0].what;
  }
}

TEST_F(Robot, SaysWhatItCouldNotLookAt) {
  use("managed");
  asker_.answers.erase(NL80211_CMD_GET_POWER_SAVE);
  asker_.answers.erase(NL80211_CMD_GET_REG);
  const Report made = report(facts());
  EXPECT_EQ(names(made), "");
  ASSERT_EQ(made.not_looked_at.size(), 2u);
  EXPECT_EQ(made.not_looked_at[0].what, "power save of wlan0");
  EXPECT_EQ(made.not_looked_at[1].what, "regulatory domain of wlan0");
  Facts deaf = facts();
  deaf.interfaces[0].radio.reset();
  EXPECT_EQ(report(deaf).not_looked_at[0].what, "radio of wlan0");
}

TEST_F(Robot, SleepsBetweenBeacons) {
  sleep();
  EXPECT_EQ(found(), "power-save");
}

TEST_F(Robot, IsSwitchedOutOfPowerSaveWhereThatIsAllowed) {
  sleep();
  const Facts seen = facts();
  Report made = report(seen);
  add_fixes(seen, expected_, {}, &asker_, made);
  ASSERT_TRUE(made.findings[0].fix);
  asker_.answers[NL80211_CMD_SET_POWER_SAVE] = {EPERM, {}};
  EXPECT_NE(made.findings[0].fix().find("sudo"), std::string::npos);
  asker_.answers[NL80211_CMD_SET_POWER_SAVE] = {0, {}};
  EXPECT_EQ(made.findings[0].fix(), "");
  EXPECT_EQ(asker_.questions.back().command, NL80211_CMD_SET_POWER_SAVE);
}

TEST_F(Robot, IsHeardTooWeakly) {
  use("managed");
  station_with_signal(-82);
  EXPECT_EQ(found(), "signal-low");
  station_with_signal(-60);
  EXPECT_EQ(found(), "");
  use("ibss");
  station_with_signal(-82);
  EXPECT_EQ(found(), "signal-low");
}

TEST_F(Robot, HearsSlowBroadcastsOfItsAccessPoint) {
  use("managed-slow");
  asker_.answers[NL80211_CMD_GET_POWER_SAVE] =
      RecordedAsker(kFolder + "managed.txt").answers[NL80211_CMD_GET_POWER_SAVE];
  EXPECT_EQ(found(), "multicast-rate");
}

TEST_F(Robot, SendsSlowBroadcasts) {
  use("ibss-slow");
  air_rate_mbps_ = 0;
  EXPECT_EQ(found(), "multicast-rate");
  air_rate_mbps_ = 1;
  EXPECT_EQ(found(), "multicast-rate");
  use("mesh");
  air_rate_mbps_ = 0;  // the kernel does not tell a mesh's rate
  EXPECT_EQ(found(), "multicast-rate");
  const Facts seen = facts();
  Report made = report(seen);
  add_fixes(seen, expected_, {}, &asker_, made);
  asker_.answers[NL80211_CMD_SET_MCAST_RATE] = {0, {}};
  EXPECT_EQ(made.findings[0].fix(), "");
  EXPECT_EQ(asker_.questions.back().command, NL80211_CMD_SET_MCAST_RATE);
}

TEST_F(Robot, SendsOnWhatItHearsInTheSameInstantAsAllOthers) {
  use("ibss");
  Facts seen = facts();
  ASSERT_FALSE(seen.daemon.links.empty());
  seen.daemon.links[0].forward_jitter_us = 0;
  EXPECT_EQ(found(seen), "") << "nothing was sent on";
  seen.daemon.links[0].packets_forwarded = 1;
  EXPECT_EQ(found(seen), "forwards-collide");
  seen.daemon.links[0].forward_jitter_us = 5000;
  EXPECT_EQ(found(seen), "");
}

TEST_F(Robot, HasNoCountryOrAnother) {
  use("managed");
  country("00");
  EXPECT_EQ(found(), "regulatory-domain");
  country("DE");
  EXPECT_EQ(found(), "");
  expected_.country = "US";
  EXPECT_EQ(found(), "regulatory-domain");
  expected_.country = "";
  country("US");
  Facts seen = facts();
  EXPECT_EQ(found(seen), "");
  seen.interfaces[0].radio->network->country = "DE";
  EXPECT_EQ(found(seen), "regulatory-domain");
}

TEST_F(Robot, IsInTheWrongModeNetworkOrChannel) {
  use("monitor");
  EXPECT_EQ(found(), "wrong-mode");
  use("unconnected");
  EXPECT_EQ(found(), "not-joined");
  use("managed");
  expected_.mode = "ibss";
  EXPECT_EQ(found(), "wrong-mode");
  expected_.mode = "managed";
  expected_.network = "swarm";
  expected_.channel = 1;
  EXPECT_EQ(found(), "");
  expected_.network = "guests";
  EXPECT_EQ(found(), "wrong-network");
  expected_.network = "";
  expected_.channel = 6;
  EXPECT_EQ(found(), "wrong-channel");
}

TEST_F(Robot, ALinkThatIsDownForItsRadioIsToldOnce) {
  use("unconnected");
  Facts seen = facts();
  seen.daemon.links[0].is_up = false;
  EXPECT_EQ(found(seen), "not-joined");
  use("managed");
  seen = facts();
  seen.daemon.links[0].is_up = false;
  seen.daemon.links[0].state = "down: cannot bind";
  EXPECT_EQ(found(seen), "link-down");
}

TEST_F(Robot, CountersThatRiseAreNamed) {
  use("managed");
  const std::map<std::string, std::string> expected{{"frames_other_key", "other-key"},
                                                    {"frames_without_key", "other-key"},
                                                    {"frames_sealed", "other-key"},
                                                    {"frames_not_authentic", "not-authentic"},
                                                    {"frames_not_fresh", "not-fresh"},
                                                    {"frames_replayed", "not-fresh"},
                                                    {"frames_too_old", "not-fresh"},
                                                    {"frames_other_profile", "other-profile"},
                                                    {"frames_other_version", "other-version"},
                                                    {"frames_unknown_flags", "other-version"},
                                                    {"frames_not_ours", "ethertype-shared"},
                                                    {"frames_tagged", "vlan-differs"},
                                                    {"kernel_drops", "kernel-drops"},
                                                    {"send_errors", "send-errors"},
                                                    {"frames_received", ""}};
  for (const auto& [counter, name] : expected) {
    Facts seen = facts();
    seen.daemon.links[0].rises[counter] = 1;
    EXPECT_EQ(found(seen), name) << counter;
  }
}

TEST_F(Robot, AFindingNamesTheCommandOfThisRobotsDaemon) {
  use("managed");
  for (const char* counter : {"frames_sealed", "frames_not_authentic", "frames_replayed"}) {
    Facts seen = facts();
    seen.daemon.words = words_for("/tmp/lab/1.sock");
    seen.daemon.links[0].rises[counter] = 1;
    EXPECT_NE(report(seen).findings.at(0).remedy.find("`swarmtalk-cli --socket /tmp/lab/1.sock "),
              std::string::npos)
        << counter;
  }
}

TEST_F(Robot, AClockThatNobodyKeepsIsANote) {
  use("managed");
  Facts seen = facts();
  seen.clock->is_synchronised = false;
  const Report made = report(seen);
  EXPECT_FALSE(made.has_findings());
  ASSERT_EQ(made.findings.size(), 1u);
  EXPECT_EQ(made.findings[0].id, "clock-not-synchronised");
  seen.clock.reset();
  EXPECT_EQ(report(seen).not_looked_at[0].what, "clock");
}

TEST_F(Robot, EveryFindingIsOneLineWithARemedy) {
  use("unconnected");
  Facts seen = facts();
  seen.daemon.version = "0.9";
  seen.daemon.config_restart = {"a", "b"};
  for (const auto& finding : report(seen).findings) {
    EXPECT_FALSE(finding.remedy.empty());
    EXPECT_EQ((finding.what + finding.remedy).find('\n'), std::string::npos);
  }
}

/// What came of a hundred questions at a healthy robot, through an access point.
class Peer : public Robot {
 protected:
  Peer() {
    use("managed");
    peer_.robot = 2;
    peer_.asked = peer_.heard_there = peer_.answered = 75;
    peer_.frames = peer_.broadcast_frames = 80;
    peer_.is_captured = true;
    peer_.link = "wifi";
    for (int i = 0; i < 75; ++i) {
      peer_.arrivals_ms.push_back(1000 + 40 * i + (i % 3));
      peer_.round_trips_ms.push_back(3 + i % 3);
    }
  }

  std::string found_between(Report made = {}) {
    diagnose_peer(peer_, facts(), made);
    return names(made);
  }
  void say_nothing() {
    peer_.answered = peer_.heard_there = peer_.frames = 0;
    peer_.arrivals_ms.clear();
  }

  PeerFacts peer_;
};

TEST_F(Peer, IsHealthy) {
  EXPECT_EQ(found_between(), "");
}

TEST_F(Peer, IsSomebodyHeard) {
  Report alone;
  alone.add({"nobody-heard", Severity::kWarning, "link wifi", "", ""});
  EXPECT_EQ(found_between(alone), "");
  say_nothing();
  EXPECT_EQ(found_between(alone).find("nobody-heard"), 0u);
}

TEST_F(Peer, IsHealthyThoughItsAnswersArePaced) {
  for (const double period_ms : {20.0, 50.0, 100.0, 200.0}) {  // rate_hz 50, 20, 10, 5
    peer_.arrivals_ms.clear();
    for (int i = 0; i < 75; ++i) {
      peer_.arrivals_ms.push_back(std::ceil(40 * i / period_ms) * period_ms + (i % 4));
    }
    EXPECT_EQ(found_between(), "") << period_ms;
  }
}

TEST_F(Peer, IsHeldUntilBeacons) {
  for (const int dtim : {1, 2, 3}) {
    const double interval_ms = 102.4 * dtim;
    peer_.arrivals_ms.clear();
    for (int i = 0; i < 75; ++i) {
      peer_.arrivals_ms.push_back(std::ceil(40 * i / interval_ms) * interval_ms + (i % 4));
    }
    EXPECT_EQ(found_between(), "multicast-delayed") << dtim;
  }
}

TEST_F(Peer, IsSentEachFrameByItself) {
  std::swap(peer_.broadcast_frames, peer_.unicast_frames);
  EXPECT_EQ(found_between(), "unicast-conversion");
}

TEST_F(Peer, LosesTooMuch) {
  peer_.heard_there = 40;
  peer_.answered = 20;
  EXPECT_EQ(found_between(), "lossy");
  peer_.heard_there = peer_.answered = 20;
  EXPECT_EQ(found_between(), "one-way");
  peer_.signal_dbm = -84;
  EXPECT_EQ(found_between(), "signal-low");
}

TEST_F(Peer, IsSilentForOneOfSeveralReasons) {
  say_nothing();
  EXPECT_EQ(found_between(), "peer-silent");
  peer_.is_reached = true;
  EXPECT_EQ(found_between(), "ethertype-filtered");
  peer_.is_reached = false;
  EXPECT_EQ(found_between(), "client-isolation");
  peer_.frames = 30;
  EXPECT_EQ(found_between(), "peer-silent") << "it may answer nobody";
  peer_.report = PeerReport{};
  EXPECT_EQ(found_between(), "one-way");
}

TEST_F(Peer, IsElsewhereByItsOwnReport) {
  say_nothing();
  peer_.report = PeerReport{};
  PeerReport& other = *peer_.report;
  other.version = "1.2.3";
  other.mode = "managed";
  other.network = "swarm";
  other.ethertype = 0x88b5;
  EXPECT_EQ(found_between(), "peer-silent");
  other.network = "guests";
  EXPECT_EQ(found_between(), "wrong-network");
  other.network = "swarm";
  other.ethertype = 0x88b6;
  EXPECT_EQ(found_between(), "ethertype-differs");
  other.ethertype = 0x88b5;
  other.hears_us = true;
  EXPECT_EQ(found_between(), "one-way");
  other.hears_us = false;
  use("ibss");
  EXPECT_EQ(found_between(), "wrong-mode");
  other.mode = "ibss";
  other.frequency_mhz = 2437;
  EXPECT_EQ(found_between(), "wrong-channel");
  other.frequency_mhz = 2412;
  other.bssid = "02:99:99:99:99:99";
  EXPECT_EQ(found_between(), "cells-split");
  other.bssid = "02:11:22:33:44:55";
  EXPECT_EQ(found_between(), "peer-silent");
  other.version = "1.0.0";
  EXPECT_EQ(found_between(), "version-differs peer-silent");
}

TEST(PeerReport, IsReadFromWhatDoctorPrintsAndNothingElse) {
  const auto json = nlohmann::ordered_json::parse(R"({"robot": {"node_id": 2, "version": "1.2.3"},
      "links": [{"type": "udp", "interface_mtu_bytes": 1400},
      {"type": "raw_l2", "interface_mtu_bytes": 1468, "ethertype": 34997, "hears": [1, 3], "radio": {"mode": "ibss", "network": "swarm",
      "bssid": "02:11:22:33:44:55", "frequency_mhz": 2412}}]})");
  const auto report = read_report(json, 3);
  ASSERT_TRUE(report);
  EXPECT_TRUE(report->hears_us);
  EXPECT_FALSE(read_report(json, 4)->hears_us);
  EXPECT_EQ(report->ethertype, 0x88b5u);
  EXPECT_EQ(report->network, "swarm");
  EXPECT_EQ(report->mtu_bytes, 1468u);
  for (const char* text : {"{}", "[]", "1", R"({"robot": 1, "links": []})",
                           R"({"robot": {}, "links": 3})", R"({"robot": {}, "links": [1]})"}) {
    const auto bad = nlohmann::ordered_json::parse(text);
    const auto read = read_report(bad, 1);
    EXPECT_TRUE(!read || !read->hears_us) << text;
  }
}

TEST(PeerReport, IsReadFromAFileThatAnotherSystemsShellHasWritten) {
  const std::string json = R"({"robot": {"node_id": 2, "version": "1.2.3"}, "links": []})";
  std::string problem;
  for (const std::string& text : {json, json + "\r\n", "\xEF\xBB\xBF" + json}) {
    const auto report = read_report(text, 3, problem);
    ASSERT_TRUE(report) << problem;
    EXPECT_EQ(report->version, "1.2.3");
  }
  std::string wide = "\xFF\xFE";
  for (const char c : json) wide += {c, '\0'};
  for (const std::string& text : {wide, wide.substr(2)}) {
    EXPECT_FALSE(read_report(text, 3, problem));
    EXPECT_EQ(problem, "is UTF-16; save it as UTF-8");
  }
  for (const char* text : {"", "[]", "{", "{}", "Gr\xF6\xDF"}) {
    EXPECT_FALSE(read_report(text, 3, problem)) << text;
    EXPECT_NE(problem.find("`swarmtalk-cli doctor --json`"), std::string::npos) << problem;
  }
}

}  // namespace
}  // namespace swarmtalk::cli::doctor
