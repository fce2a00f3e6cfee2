// What a status and a list of neighbours say of what the parts know.
#include "daemon/operator/status_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::ElementsAre;
using testing::Eq;

using namespace std::chrono_literals;

class StatusReportTest : public testing::Test {
 protected:
  StatusReportTest() {
    hub_.add(first_);
    hub_.add(second_);
  }

  ipc::Neighbours neighbours() {
    ipc::Neighbours reply;
    report_.fill_neighbours(reply);
    return reply;
  }
  ipc::Status status() {
    ipc::Status reply;
    report_.fill_status(reply);
    return reply;
  }
  FakeLink& link() { return static_cast<FakeLink&>(first_.link()); }
  static Neighbour heard_ago(std::uint16_t node, std::chrono::milliseconds ago) {
    Neighbour neighbour;
    neighbour.node = node;
    neighbour.last_heard = std::chrono::steady_clock::now() - ago;
    return neighbour;
  }

  ChannelTable names_{{{"hello", 1}}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{5};
  PoseKeeper poses_{NodeConfig{}};
  Hub hub_{names_, limits_, counters_, identity_};
  FakeStation first_{hub_, "first"};
  FakeStation second_{hub_, "second", 6};
  StatusReport report_{hub_, poses_, identity_, counters_, "a\x1b.toml"};
};

TEST_F(StatusReportTest, SaysAllThatIsKnownOfANeighbour) {
  Neighbour heard = heard_ago(7, 300ms);
  heard.epoch = 0x1234;
  heard.hardware = 70;
  heard.range.distance_m = 1.5f;
  heard.range.bearing_rad = -0.5f;
  heard.pose = frame::FramePose::from_metres(1.25, -2.5, 0.5, 0.1);
  heard.frames = 30;
  heard.frames_lost = 4;
  heard.is_out_of_range = true;
  first_.around = {heard};
  link().strengths = {{69, -30}, {70, -61}, {71, -90}};
  const ipc::Neighbours reply = neighbours();
  ASSERT_EQ(reply.neighbours_size(), 1);
  EXPECT_EQ(reply.left_out(), 0u);
  const ipc::Neighbour& told = reply.neighbours(0);
  EXPECT_EQ(told.link(), "first");
  EXPECT_EQ(told.node_id(), 7u);
  EXPECT_EQ(told.epoch(), 0x1234u);
  EXPECT_EQ(told.address(), "address 70");
  EXPECT_GE(told.age_ms(), 300u);
  EXPECT_LT(told.age_ms(), 60'000u);
  EXPECT_EQ(told.signal_dbm(), -61);
  EXPECT_EQ(told.distance_m(), 1.5f);
  EXPECT_EQ(told.bearing_rad(), -0.5f);
  EXPECT_EQ(told.pose().x_m(), 1.25f);
  EXPECT_EQ(told.pose().y_m(), -2.5f);
  EXPECT_NEAR(told.pose().theta_rad(), 0.5f, 1e-4);
  EXPECT_EQ(told.pose().age_ms(), 100u + told.age_ms());
  EXPECT_EQ(told.frames(), 30u);
  EXPECT_EQ(told.frames_lost(), 4u);
  EXPECT_TRUE(told.out_of_range());
  EXPECT_FALSE(told.duplicate_id());
  EXPECT_FALSE(told.ghost());
}

TEST_F(StatusReportTest, MarksANeighbourThatHasOurNodeIdOnThatLink) {
  first_.around = {heard_ago(first_.identity().id(), 0ms)};
  second_.around = {heard_ago(first_.identity().id(), 0ms)};
  const ipc::Neighbours reply = neighbours();
  ASSERT_EQ(reply.neighbours_size(), 2);
  EXPECT_TRUE(reply.neighbours(0).duplicate_id());
  EXPECT_FALSE(reply.neighbours(1).duplicate_id()) << "there we are node 6";
  Neighbour before = heard_ago(first_.identity().id(), 2000ms), after = heard_ago(8, 100ms);
  before.hardware = after.hardware = 70;
  first_.around = {before, after};
  EXPECT_FALSE(neighbours().neighbours(0).duplicate_id()) << "it has another id now";
  before.is_ghost = after.is_ghost = true;
  first_.around = {before, after};
  EXPECT_TRUE(neighbours().neighbours(0).duplicate_id()) << "two ghosts of one machine";
}

TEST_F(StatusReportTest, LeavesOutWhatIsNotKnownOfANeighbour) {
  Neighbour heard = heard_ago(7, 0ms);
  heard.pose = frame::FramePose::stale();
  heard.is_duplicate = true;
  Neighbour ghost = heard_ago(8, 0ms);
  ghost.is_ghost = true;
  first_.around = {heard, ghost};
  link().strengths = {{69, -30}};
  const ipc::Neighbours reply = neighbours();
  ASSERT_EQ(reply.neighbours_size(), 2);
  for (const ipc::Neighbour& told : reply.neighbours()) {
    EXPECT_EQ(told.address(), "");
    EXPECT_FALSE(told.has_signal_dbm());
    EXPECT_FALSE(told.has_distance_m());
    EXPECT_FALSE(told.has_bearing_rad());
    EXPECT_FALSE(told.has_pose());
    EXPECT_FALSE(told.out_of_range());
  }
  EXPECT_TRUE(reply.neighbours(0).duplicate_id());
  EXPECT_FALSE(reply.neighbours(0).ghost());
  EXPECT_FALSE(reply.neighbours(1).duplicate_id());
  EXPECT_TRUE(reply.neighbours(1).ghost());
}

TEST_F(StatusReportTest, TellsNoAgeBelowZero) {
  first_.around = {heard_ago(7, -1h)};  // heard while the list was made
  EXPECT_EQ(neighbours().neighbours(0).age_ms(), 0u);
}

TEST_F(StatusReportTest, ListsAsManyNeighboursAsFitAFrameAndCountsTheOthers) {
  first_.around.assign(StatusReport::kMostNeighbours - 1, heard_ago(1, 0ms));
  second_.around = {heard_ago(2, 0ms)};
  EXPECT_EQ(neighbours().neighbours_size(), StatusReport::kMostNeighbours);
  EXPECT_EQ(neighbours().left_out(), 0u);
  second_.around.assign(3, heard_ago(2, 0ms));
  const ipc::Neighbours reply = neighbours();
  ASSERT_EQ(reply.neighbours_size(), StatusReport::kMostNeighbours);
  EXPECT_EQ(reply.left_out(), 2u);
  EXPECT_EQ(reply.neighbours(0).link(), "first");
  EXPECT_EQ(reply.neighbours(StatusReport::kMostNeighbours - 1).link(), "second");
}

TEST_F(StatusReportTest, SaysWhoItIsAndWhereItsConfigurationIs) {
  const ipc::Status told = status();
  EXPECT_EQ(told.version(), SWARMTALK_VERSION);
  EXPECT_EQ(told.node_id(), 5u);
  EXPECT_EQ(told.epoch(), identity_.epoch());
  EXPECT_EQ(told.clients(), 0u);
  EXPECT_EQ(told.config_file().find('\x1b'), std::string::npos) << told.config_file();
  EXPECT_FALSE(told.has_pose());
  poses_.set(1, 2, 0.5, std::nullopt);
  EXPECT_EQ(status().pose().y_m(), 2.0f);
  ipc::Hello hello;
  report_.fill_hello(hello);
  EXPECT_EQ(hello.node_id(), 5u);
  EXPECT_EQ(hello.major(), ipc::kProtocolMajor);
  EXPECT_EQ(hello.minor(), ipc::kProtocolMinor);
}

TEST_F(StatusReportTest, SaysOfEachLinkWhatItIsAndHowItIsSet) {
  first_.station_limits = {100, 1000, 996, 15, 255};
  link().link_settings = {"fake0", 0x88B5, true, 6.5, 1500us, 4096, 8192};
  link().packet_limit = 600;
  second_.set_up(false);
  const ipc::Status told = status();
  ASSERT_EQ(told.links_size(), 2);
  const ipc::LinkStatus& first = told.links(0);
  EXPECT_EQ(first.name(), "first");
  EXPECT_EQ(first.type(), "fake");
  EXPECT_EQ(first.device(), "fake0");
  EXPECT_EQ(first.profile(), "fake");
  EXPECT_TRUE(first.up());
  EXPECT_EQ(first.state(), "up");
  EXPECT_EQ(first.mtu_bytes(), 100u);
  EXPECT_EQ(first.max_message_bytes(), 1000u);
  EXPECT_EQ(first.max_ttl(), 15u);
  EXPECT_EQ(first.max_channel(), 255u);
  EXPECT_EQ(first.node_id(), 5u);
  EXPECT_EQ(first.interface(), "fake0");
  EXPECT_EQ(first.ethertype(), 0x88B5u);
  EXPECT_TRUE(first.sealed());
  EXPECT_EQ(first.air_rate_mbps(), 6.5);
  EXPECT_EQ(first.asked_buffer_bytes(), 4096u);
  EXPECT_EQ(first.given_buffer_bytes(), 8192u);
  EXPECT_EQ(first.packet_limit_bytes(), 600u);
  EXPECT_EQ(first.forward_jitter_us(), 1500u);
  std::vector<std::pair<std::string, std::uint64_t>> counters;
  for (const ipc::Counter& each : first.counters())
    counters.emplace_back(each.name(), each.value());
  EXPECT_THAT(counters, ElementsAre(testing::Pair("frames_sent", 42u),
                                    testing::Pair("node_messages_sent", 43u)));
  const ipc::LinkStatus& second = told.links(1);
  EXPECT_EQ(second.name(), "second");
  EXPECT_EQ(second.node_id(), 6u);
  EXPECT_FALSE(second.up());
  EXPECT_EQ(second.state(), "interface fake0 is gone");
  EXPECT_FALSE(second.has_asked_buffer_bytes());
  EXPECT_FALSE(second.has_forward_jitter_us());
}

TEST_F(StatusReportTest, SaysOfEachUserWhatItsProgramsHold) {
  UserShare& student = hub_.shares().user(1000);
  UserShare& gone = hub_.shares().user(1001);
  UserShare& left = hub_.shares().user(1002);
  ClientShare client;
  hub_.shares().enter(student, client);
  Shares::hold(client, Shares::End::kPublisher, 1);
  left.waiting_messages = 3;  // of programs that have ended
  left.waiting_bytes = 30;
  ASSERT_EQ(gone.clients, 0u);
  ipc::Status told = status();
  ASSERT_EQ(told.users_size(), 2);
  EXPECT_EQ(told.users(0).uid(), 1000u);
  EXPECT_FALSE(told.users(0).is_operator());
  const auto share = [](const ipc::UserStatus& user, const std::string& name) {
    for (const ipc::ShareStatus& each : user.shares()) {
      if (each.name() == name) return std::pair(each.used(), each.limit());
    }
    return std::pair(std::uint64_t{99}, std::uint64_t{99});
  };
  EXPECT_THAT(share(told.users(0), "clients"), Eq(std::pair(1ul, 1ul * limits_.clients_per_user)));
  EXPECT_THAT(share(told.users(0), "channels"),
              Eq(std::pair(1ul, 1ul * limits_.channels_per_user)));
  EXPECT_THAT(share(told.users(0), "publishers"),
              Eq(std::pair(1ul, 1ul * limits_.publishers_per_user)));
  EXPECT_THAT(share(told.users(0), "subscriptions"),
              Eq(std::pair(0ul, 1ul * limits_.subscriptions_per_user)));
  EXPECT_EQ(told.users(1).uid(), 1002u);
  EXPECT_THAT(share(told.users(1), "waiting_messages"),
              Eq(std::pair(3ul, 1ul * limits_.waiting_messages_per_user)));
  EXPECT_THAT(share(told.users(1), "waiting_bytes"),
              Eq(std::pair(30ul, 1ul * limits_.waiting_bytes / 2)));
  student.is_operator = true;
  told = status();
  EXPECT_TRUE(told.users(0).is_operator());
  EXPECT_EQ(share(told.users(0), "clients").second, limits_.clients);
  EXPECT_EQ(share(told.users(0), "publishers").second, 0u) << "no limit";
  for (std::uint32_t uid = 2000; uid < 2040; ++uid) hub_.shares().user(uid).clients = 1;
  EXPECT_EQ(status().users_size(), 32);
  Shares::leave(client);
}

}  // namespace
}  // namespace swarmtalk::daemon
