// Captures: frames as they come and go, and why what they carried was dropped.
#include "daemon/operator/capture.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <type_traits>

#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

static_assert(std::is_trivially_destructible_v<drivers::Counters::value_type>,
              "a capture asks for all counters twice a frame: their names are not strings to copy");

class Listener final : public CaptureListener {
 public:
  void on_captured(ipc::Captured& captured) override { heard.push_back(captured); }
  std::vector<ipc::Captured> heard;
};

class CaptureTest : public testing::Test {
 protected:
  CaptureTest() {
    hub_.add(station_);
    link().counts = {{"frames_sent", 42}, {"frames_not_authentic", 3}, {"kernel_drops", 5}};
  }
  FakeLink& link() { return static_cast<FakeLink&>(station_.link()); }
  void set(const char* name, std::uint64_t value) {
    for (auto& [each, count] : link().counts) {
      if (each == name) count = value;
    }
  }
  /// A frame comes; reading it makes the link count.
  template <typename Read>
  ipc::Captured receive(Read read) {
    const std::vector<std::uint8_t> datagram{1, 2, 3, 4, 5};
    link().tap->before_received();
    read();
    link().tap->received(datagram, 2);
    return listener_.heard.back();
  }

  ChannelTable names_{{}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{5};
  Hub hub_{names_, limits_, counters_, identity_};
  FakeStation station_{hub_};
  Capture capture_{hub_};
  Listener listener_;
};

TEST_F(CaptureTest, LinkIsTappedWhileSomebodyListens) {
  Listener other;
  EXPECT_EQ(link().tap, nullptr);
  capture_.add(listener_);
  capture_.add(other);
  EXPECT_NE(link().tap, nullptr);
  receive([] {});
  EXPECT_EQ(other.heard.size(), 1u);
  capture_.remove(listener_);
  EXPECT_NE(link().tap, nullptr);
  capture_.remove(other);
  capture_.remove(other);
  EXPECT_EQ(link().tap, nullptr);
}

TEST_F(CaptureTest, FrameThatCameIsToldWithHeaderLinkAndCause) {
  capture_.add(listener_);
  const auto captured = receive([this] { set("frames_not_authentic", 5); });
  EXPECT_EQ(captured.link(), "fake");
  EXPECT_EQ(captured.ethernet_header(), std::string("\1\2"));
  EXPECT_EQ(captured.frame(), std::string("\3\4\5"));
  EXPECT_FALSE(captured.sent());
  ASSERT_EQ(captured.dropped_size(), 1);
  EXPECT_EQ(captured.dropped(0).name(), "frames_not_authentic");
  EXPECT_EQ(captured.dropped(0).value(), 2u);
}

TEST_F(CaptureTest, WhatWasCountedBetweenTwoFramesIsNoneOfTheirs) {
  capture_.add(listener_);
  set("frames_not_authentic", 9);
  EXPECT_EQ(receive([] {}).dropped_size(), 0);
  EXPECT_EQ(receive([this] { set("frames_sent", 99); }).dropped_size(), 0) << "that is not a drop";
}

TEST_F(CaptureTest, WhatTheKernelDroppedIsToldWithTheFrameBehindIt) {
  capture_.add(listener_);
  set("kernel_drops", 8);
  const auto captured = receive([] {});
  ASSERT_EQ(captured.dropped_size(), 1);
  EXPECT_EQ(captured.dropped(0).name(), "kernel_drops");
  EXPECT_EQ(captured.dropped(0).value(), 3u);
  EXPECT_EQ(receive([] {}).dropped_size(), 0);
}

TEST_F(CaptureTest, FrameThatLeavesIsToldAsSent) {
  capture_.add(listener_);
  link().tap->sent(std::vector<std::uint8_t>{7, 8});
  ASSERT_EQ(listener_.heard.size(), 1u);
  EXPECT_TRUE(listener_.heard[0].sent());
  EXPECT_EQ(listener_.heard[0].frame(), std::string("\7\10"));
  EXPECT_GT(listener_.heard[0].time_ns(), 0u);
}

}  // namespace
}  // namespace swarmtalk::daemon
