#include "daemon/operator/prometheus.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <iterator>
#include <set>

#include "daemon/common/daemon_counters.hpp"
#include "daemon/operator/counter_list.hpp"
#include "daemon/station/node_station.hpp"
#include "drivers/link/link_counters.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::HasSubstr;

std::string operations_document() {
  std::ifstream file(SWARMTALK_DOCS "/operations.md");
  return {std::istreambuf_iterator<char>(file), {}};
}

void expect_listed(CounterOwner owner, const drivers::Counters& counters) {
  EXPECT_FALSE(counters.empty());
  for (const auto& [name, value] : counters) {
    EXPECT_NE(find_counter(owner, name), nullptr) << name << " is missing in counter_list.cpp";
  }
}

TEST(CounterList, HoldsEveryCounterThatSomebodyCounts) {
  expect_listed(CounterOwner::kDaemon, DaemonCounters().list());
  expect_listed(CounterOwner::kLink, drivers::LinkCounters().list());
  struct NoUser final : StationUser {
    void on_message(Station&, const MessageHead&, std::span<const std::uint8_t>) override {}
    void on_sent(Station&, std::uint16_t) override {}
    void on_namesake(Station&) override {}
  } user;
  NodeIdentity identity(7);
  const PoseKeeper poses(NodeConfig{});
  const NodeStation<core::Wifi> station("w", {frame::ProfileId::kWifi, "wifi"},
                                        std::make_unique<FakeLink>(), identity, poses, user);
  expect_listed(CounterOwner::kLink, station.counters());
}

TEST(CounterList, IsExplainedInTheManual) {
  const std::string document = operations_document();
  ASSERT_FALSE(document.empty());
  for (const CounterHelp& counter : counter_list()) {
    EXPECT_THAT(document, HasSubstr("`" + std::string(counter.name) + "`"));
  }
}

ipc::Status example() {
  ipc::Status status;
  status.set_version("1.2.3");
  status.set_node_id(7);
  status.set_uptime_ms(1500);
  status.set_clients(2);
  ipc::LinkStatus& link = *status.add_links();
  link.set_name("wi\"fi\\");
  link.set_type("raw_l2");
  link.set_device("wlan0");
  link.set_profile("wifi");
  link.set_up(true);
  ipc::Counter& frames = *link.add_counters();
  frames.set_name("frames_received");
  frames.set_value(18446744073709551615u);
  ipc::Counter& duplicates = *link.add_counters();
  duplicates.set_name("node_duplicates");
  duplicates.set_value(4);
  ipc::Counter& sent = *status.add_counters();
  sent.set_name("messages_sent");
  sent.set_value(9);
  return status;
}

TEST(PrometheusText, CountersCarryHelpTypeAndValue) {
  const std::string text = prometheus_text(example());
  EXPECT_THAT(text, HasSubstr("# HELP swarmtalk_messages_sent_total accepted messages whose last "
                              "packet has left on a link.\n"
                              "# TYPE swarmtalk_messages_sent_total counter\n"
                              "swarmtalk_messages_sent_total 9\n"));
}

TEST(PrometheusText, CountersOfALinkNameItEscaped) {
  const std::string text = prometheus_text(example());
  EXPECT_THAT(text, HasSubstr("swarmtalk_link_frames_received_total{link=\"wi\\\"fi\\\\\"} "
                              "18446744073709551615\n"));
  EXPECT_THAT(text, HasSubstr("swarmtalk_node_duplicates_total{link=\"wi\\\"fi\\\\\"} 4\n"));
}

TEST(PrometheusText, GaugesTellTheState) {
  const std::string text = prometheus_text(example());
  EXPECT_THAT(text, HasSubstr("swarmtalk_build_info{version=\"1.2.3\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("swarmtalk_uptime_seconds 1.500\n"));
  EXPECT_THAT(text, HasSubstr("swarmtalk_node_id 7\n"));
  EXPECT_THAT(text, HasSubstr("swarmtalk_clients 2\n"));
  EXPECT_THAT(text, HasSubstr("type=\"raw_l2\",device=\"wlan0\",profile=\"wifi\"} 1\n"));
}

TEST(PrometheusText, NoNameIsDeclaredTwice) {
  const std::string text = prometheus_text(example());
  std::set<std::string> names;
  for (std::size_t at = text.find("# TYPE "); at != std::string::npos;
       at = text.find("# TYPE ", at + 1)) {
    const std::string name = text.substr(at + 7, text.find(' ', at + 7) - at - 7);
    EXPECT_TRUE(names.insert(name).second) << name;
  }
  EXPECT_GT(names.size(), 50u);
}

}  // namespace
}  // namespace swarmtalk::daemon
