// What an operator changes on a running daemon: reload, levels of the log, node id, metrics.
#include "daemon/operator/operator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "daemon/common/logging.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kLink = "[links.fake]\ntype = \"udp\"\n";

using Level = std::pair<std::string, std::string>;  // of a subsystem

class OperatorTest : public testing::Test {
 protected:
  OperatorTest() {
    char name[] = "/tmp/swarmtalk-test-XXXXXX";
    folder_ = mkdtemp(name);
    hub_.add(station_);
    station_.identity_in_use = &identity_;
    start_logging("info");
  }
  ~OperatorTest() override {
    set_log_level("", "info");
    std::filesystem::remove_all(folder_);
  }

  /// From now on the file says this.
  void write(const std::string& text) { text_ = text; }
  /// The daemon, started with what the file says.
  void start() {
    parsed_ = load();
    resolve_node_id(parsed_.config.node, parsed_.lines, [this] { return host_; });
    if (parsed_.config.node.id) hub_.set_node_id(parsed_.config.node.id);
    operator_.emplace(
        Operator::Parts{parsed_, load_keys(parsed_.config, parsed_.lines), hub_, poses_, names_,
                        status_, metrics_, capture_},
        [this] { return load(); }, [this] { return host_; });
  }
  ParsedConfig load() const { return parse_config(text_, "f.toml"); }
  std::string id_source() {
    ipc::Status status;
    status_.fill_status(status);
    return status.node_id_source();
  }
  /// @return why not; empty: reloaded
  std::string reload() {
    reply_.Clear();
    const auto refusal = operator_->reload("test", reply_);
    if (!refusal) return "";
    EXPECT_EQ(refusal->code, ipc::ERROR_CONFIGURATION);
    return refusal->text;
  }
  std::string write_key(char digit) {
    const std::string path = folder_ + "/key";
    std::ofstream(path) << std::string(63, digit) << (digit == '0' ? '1' : '0');
    chmod(path.c_str(), 0600);
    return path;
  }
  const FakeLink& link() { return static_cast<FakeLink&>(station_.link()); }

  std::string folder_, text_ = kLink;
  Host host_;
  boost::asio::io_context io_;
  ParsedConfig parsed_;
  ChannelTable names_{{}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{5};
  PoseKeeper poses_{NodeConfig{}};
  Hub hub_{names_, limits_, counters_, identity_};
  FakeStation station_{hub_};
  StatusReport status_{hub_, poses_, identity_, counters_, "f.toml"};
  MetricsFile metrics_{io_, [] { return "text"; }};
  Capture capture_{hub_};
  std::optional<Operator> operator_;
  ipc::Reloaded reply_;
};

TEST_F(OperatorTest, ReloadAppliesWhatItCanAndTellsEachTimeWhatNeedsARestart) {
  start();
  write("node.pose = [1, 2, 3]\nlog.level = \"warning\"\nlog.hub = \"debug\"\nchannels.x = 9\n" +
        std::string(kLink) +
        "rate_hz = 7\nforward_jitter_us = 700\nvirtual_range_m = 1.5\nport = 4000\n");
  EXPECT_EQ(reload(), "");
  EXPECT_THAT(reply_.applied(),
              ElementsAre("channels.x", "links.fake.forward_jitter_us", "links.fake.rate_hz",
                          "links.fake.virtual_range_m", "log.hub", "log.level", "node.pose"));
  EXPECT_THAT(reply_.needs_restart(), ElementsAre("links.fake.port"));
  EXPECT_DOUBLE_EQ(link().pacing.rate_limit_hz, 7.0);
  EXPECT_EQ(link().pacing.max_forward_jitter, std::chrono::microseconds(700));
  EXPECT_DOUBLE_EQ(station_.virtual_range.limit_m, 1.5);
  EXPECT_EQ(names_.find("x").number, 9);
  EXPECT_DOUBLE_EQ(poses_.valid(std::chrono::steady_clock::now())->y_m, 2.0);
  EXPECT_EQ(log_levels()[0], Level("daemon", "warning"));
  EXPECT_EQ(log_levels()[2], Level("hub", "debug"));
  EXPECT_EQ(reload(), "");
  EXPECT_THAT(reply_.applied(), IsEmpty());
  EXPECT_THAT(reply_.needs_restart(), ElementsAre("links.fake.port"));
}

TEST_F(OperatorTest, PoseThatLeavesTheFileIsForgotten) {
  write("node.pose = [1, 2, 3]\n" + std::string(kLink));
  start();
  poses_.set(1, 2, 3, std::nullopt);
  write(kLink);
  EXPECT_EQ(reload(), "");
  EXPECT_FALSE(poses_.valid(std::chrono::steady_clock::now()));
}

TEST_F(OperatorTest, ReloadOfAFileWithAMistakeChangesNothing) {
  start();
  write("node.id = 7\n" + std::string(kLink) + "rate_hz = -1\n");
  EXPECT_THAT(reload(), testing::StartsWith("nothing is changed: f.toml:4: key"));
  EXPECT_EQ(identity_.id(), 5);
  EXPECT_THAT(reply_.applied(), IsEmpty());
}

TEST_F(OperatorTest, ReloadWithANodeIdThatALinkHasNoRoomForChangesNothing) {
  start();
  station_.station_limits.max_node_id = 255;
  write("node.id = 300\nlog.level = \"error\"\n" + std::string(kLink));
  EXPECT_THAT(reload(), HasSubstr("key 'node.id': packets of link 'fake' have room for node ids up "
                                  "to 255"));
  EXPECT_EQ(identity_.id(), 5);
  EXPECT_EQ(log_levels()[0], Level("daemon", "info"));
}

TEST_F(OperatorTest, NodeIdOfTheFileIsTaken) {
  start();
  write("node.id = 300\n" + std::string(kLink));
  EXPECT_EQ(reload(), "");
  EXPECT_EQ(identity_.id(), 300);
  EXPECT_EQ(station_.node_id, 300);
}

TEST_F(OperatorTest, HostThatIsRenamedHasAnotherNodeIdAfterAReloadOfTheSameFile) {
  host_.name = "robot-07";
  write("node.id = \"hostname\"\n" + std::string(kLink));
  start();
  EXPECT_EQ(reload(), "");
  EXPECT_THAT(reply_.applied(), IsEmpty());
  EXPECT_FALSE(operator_->set_node_id("test", 1234));
  EXPECT_EQ(id_source(), "set by swarmtalk-cli node-id");
  EXPECT_EQ(reload(), "");
  EXPECT_EQ(identity_.id(), 1234) << "the rule gives what it gave";
  host_.name = "robot-08";
  ipc::Reloaded would;
  EXPECT_FALSE(operator_->check_configuration(would));
  EXPECT_THAT(would.applied(), ElementsAre("node.id"));
  EXPECT_EQ(identity_.id(), 1234);
  EXPECT_EQ(reload(), "");
  EXPECT_THAT(reply_.applied(), ElementsAre("node.id"));
  EXPECT_EQ(identity_.id(), 8);
  EXPECT_EQ(station_.node_id, 8);
  EXPECT_EQ(id_source(), "from the host's name 'robot-08'");
  EXPECT_EQ(reload(), "");
  EXPECT_THAT(reply_.applied(), IsEmpty());
}

TEST_F(OperatorTest, HostWhoseNewNameHasNoNumberIsNotReloaded) {
  host_.name = "robot-07";
  write("node.id = \"hostname\"\n" + std::string(kLink));
  start();
  host_.name = "raspberrypi";
  write("log.level = \"error\"\n" + text_);
  EXPECT_THAT(reload(), HasSubstr("key 'node.id': is \"hostname\", but the host's name"));
  EXPECT_EQ(identity_.id(), 7);
  EXPECT_EQ(log_levels()[0], Level("daemon", "info"));
}

TEST_F(OperatorTest, AddressThatIsGoneLeavesTheNodeIdAndOtherChangesApply) {
  const auto at = [](std::uint32_t last) { return HostAddress{"wlan0", 0xC0A80100 + last, true}; };
  host_.addresses = {at(32)};
  write("node.id = \"ip\"\n" + std::string(kLink));
  start();
  EXPECT_EQ(identity_.id(), 32);
  host_.addresses.clear();
  write(text_ + "rate_hz = 7\n");
  EXPECT_EQ(reload(), "");
  EXPECT_THAT(reply_.applied(), ElementsAre("links.fake.rate_hz"));
  EXPECT_THAT(reply_.node_id_stays(), HasSubstr("this machine has no IPv4 address"));
  EXPECT_EQ(identity_.id(), 32);
  host_.addresses = {at(33)};
  EXPECT_EQ(reload(), "");
  EXPECT_THAT(reply_.applied(), ElementsAre("node.id"));
  EXPECT_FALSE(reply_.has_node_id_stays());
  EXPECT_EQ(identity_.id(), 33);
  host_.addresses.clear();
  write("node.id_offset = 1\n" + text_);
  EXPECT_THAT(reload(), HasSubstr("this machine has no IPv4 address")) << "another rule";
  EXPECT_EQ(identity_.id(), 33);
}

TEST_F(OperatorTest, KeyFileWithNewContentIsAChangeOfTheKey) {
  write(kLink + ("key_file = \"" + write_key('a')) + "\"\n");
  start();
  EXPECT_EQ(reload(), "");
  EXPECT_THAT(reply_.applied(), IsEmpty());
  EXPECT_EQ(link().key, nullptr) << "it has it since the start";
  write_key('b');
  EXPECT_EQ(reload(), "");
  EXPECT_THAT(reply_.applied(), ElementsAre("links.fake.key_file"));
  ASSERT_NE(link().key, nullptr);
  EXPECT_EQ(link().key->bytes()[0], 0xBB);
  EXPECT_EQ(operator_->key_of("fake"), link().key);
}

TEST_F(OperatorTest, KeyFileThatIsGoneChangesNothing) {
  const std::string path = write_key('a');
  write(kLink + ("key_file = \"" + path) + "\"\n");
  start();
  std::filesystem::remove(path);
  write("node.id = 7\n" + text_);
  EXPECT_THAT(reload(), HasSubstr("key 'links.fake.key_file': " + path + " cannot be read"));
  EXPECT_EQ(identity_.id(), 5);
  EXPECT_NE(operator_->key_of("fake"), nullptr);
}

TEST_F(OperatorTest, MetricsFileFollowsTheConfiguration) {
  start();
  write("metrics.file = \"" + folder_ + "/m.prom\"\n" + std::string(kLink));
  EXPECT_EQ(reload(), "");
  EXPECT_TRUE(std::filesystem::exists(folder_ + "/m.prom"));
  write(kLink);
  EXPECT_EQ(reload(), "");
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/m.prom"));
}

TEST_F(OperatorTest, LevelOfASubsystemIsSetAndTold) {
  start();
  ipc::SetLogLevel request;
  request.set_subsystem("link");
  request.set_level("trace");
  EXPECT_FALSE(operator_->set_log_level("test", request));
  ipc::LogLevels levels;
  operator_->fill_log_levels(levels);
  ASSERT_EQ(levels.levels_size(), 4);
  EXPECT_EQ(levels.levels(3).subsystem(), "link");
  EXPECT_EQ(levels.levels(3).level(), "trace");
}

TEST_F(OperatorTest, LevelThatIsNoneIsToldWithTheLevelsThereAre) {
  start();
  ipc::SetLogLevel request;
  request.set_level("loud");
  const auto refusal = operator_->set_log_level("test", request);
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->code, ipc::ERROR_BAD_ARGUMENT);
  EXPECT_EQ(refusal->text,
            "subsystems are daemon, client, hub, link; levels are trace, debug, info, warning, "
            "error");
}

TEST_F(OperatorTest, NodeIdThatIsNoneIsRefused) {
  start();
  for (const std::uint32_t id : {0u, 65535u, 65536u + 7u}) {
    const auto refusal = operator_->set_node_id("test", id);
    ASSERT_TRUE(refusal) << id;
    EXPECT_EQ(refusal->code, ipc::ERROR_BAD_ARGUMENT);
  }
  EXPECT_FALSE(operator_->set_node_id("test", 7));
  EXPECT_EQ(identity_.id(), 7);
  EXPECT_FALSE(operator_->set_node_id("test", std::nullopt));
  EXPECT_FALSE(identity_.is_fixed());
}

TEST_F(OperatorTest, MetricsAreThoseOfTheStatus) {
  start();
  counters_.messages_published = 17;
  ipc::Metrics metrics;
  operator_->fill_metrics(metrics);
  EXPECT_THAT(metrics.text(), HasSubstr("swarmtalk_messages_published_total"));
  EXPECT_THAT(metrics.text(), HasSubstr(" 17\n"));
}

}  // namespace
}  // namespace swarmtalk::daemon
