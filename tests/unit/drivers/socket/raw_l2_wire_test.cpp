// What a RawL2Link puts on the wire, and what it makes of foreign and broken frames from there.
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/if_packet.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <filesystem>

#include "drivers/socket/ether_filter.hpp"
#include "drivers/socket/raw_l2.hpp"
#include "tests/unit/drivers/test_network.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

const Bytes kNeighbourMac = {0x02, 0, 0, 0, 0, 0x77};

/// A good frame with one packet of 10 bytes.
Bytes good_frame(frame::ProfileId profile = frame::ProfileId::kWifi) {
  Bytes bytes(100);
  frame::FrameHeader header;
  header.profile = profile;
  header.node = 5;
  frame::FrameWriter writer(bytes, header, bytes.size());
  writer.append(numbered_packet(1, 10));
  bytes.resize(writer.finish().size());
  return bytes;
}

constexpr std::uint16_t kVlanEthertype = 0x8100;  // IEEE 802.1Q

/// What follows that EtherType: the tag, and a good frame under our own.
Bytes tagged_frame(std::uint8_t vlan) {
  Bytes bytes = {0xE0, vlan, 0x88, 0xB5};
  const Bytes frame = good_frame();
  bytes.insert(bytes.end(), frame.begin(), frame.end());
  return bytes;
}

class RawL2Wire : public ::testing::Test {
 protected:
  void SetUp() override {
    SWARMTALK_SKIP_WITHOUT_ROOT();
    network_.emplace();
    config_.interface = "air0";
    link_ = network_->link<RawL2Link>('a', io_, config_);
    link_->start(user_);
    probe_.emplace(*network_, 'b');
    ASSERT_TRUE(run_until(io_, [&] { return link_->is_up(); })) << link_->state();
  }

  void expect_counted(const std::string& name, const Bytes& bytes,
                      std::uint16_t ethertype = 0x88B5) {
    SCOPED_TRACE(name);
    const std::uint64_t had = counter(*link_, name);
    probe_->inject(bytes, kNeighbourMac, ethertype);
    EXPECT_TRUE(run_until(io_, [&] { return counter(*link_, name) == had + 1; }));
    EXPECT_EQ(counter(*link_, "frames_received"), 0U);
    EXPECT_TRUE(user_.received.empty());
  }

  // Steps of the stories below.
  void say_nothing_unasked();
  void lock_its_filter_and_ignore_outgoing_frames();
  void count_what_is_no_frame_of_its_own();
  void drop_and_count_its_own_echo();
  void not_see_frames_of_other_ethertypes();
  void receive_a_frame_with_ethernet_padding();
  void receive_a_frame_with_a_priority_and_no_vlan();
  void keep_what_comes_before_a_bad_packet_length();
  void send_broadcast_frames_of_its_ethertype_and_nothing_else();
  void hear_others_and_not_itself_on_an_old_kernel();

  std::optional<TestNetwork> network_;
  std::optional<WireProbe> probe_;
  boost::asio::io_context io_;
  RawL2Config config_;
  TestLinkUser user_{1};
  std::unique_ptr<RawL2Link> link_;
};

void RawL2Wire::say_nothing_unasked() {
  run_for(io_, 100ms);
  EXPECT_TRUE(probe_->heard().empty());
}

void RawL2Wire::lock_its_filter_and_ignore_outgoing_frames() {
  // The link's socket is the only packet socket of this process that is not the probe's.
  int locked = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int descriptor = std::stoi(entry.path().filename());
    int domain = 0;
    socklen_t size = sizeof domain;
    if (getsockopt(descriptor, SOL_SOCKET, SO_DOMAIN, &domain, &size) != 0) continue;
    if (domain != AF_PACKET) continue;
    int is_locked = 0;
    getsockopt(descriptor, SOL_SOCKET, SO_LOCK_FILTER, &is_locked, &size);
    if (is_locked == 0) continue;
    ++locked;
    int ignores_outgoing = 0;
    getsockopt(descriptor, SOL_PACKET, PACKET_IGNORE_OUTGOING, &ignores_outgoing, &size);
    EXPECT_EQ(ignores_outgoing, 1);
    EXPECT_NE(setsockopt(descriptor, SOL_SOCKET, SO_DETACH_FILTER, nullptr, 0), 0);
    EXPECT_THROW(attach_locked_ether_filter(descriptor, 0x0800), std::runtime_error);
  }
  EXPECT_EQ(locked, 1);
}

void RawL2Wire::count_what_is_no_frame_of_its_own() {
  Bytes truncated = good_frame();
  truncated.pop_back();
  Bytes other_version = good_frame();
  other_version[2] = 2;
  Bytes unknown_flags = good_frame();
  unknown_flags[3] = 0x80;
  expect_counted("frames_not_ours", Bytes(200, 0xA5));
  expect_counted("frames_not_ours", {});
  expect_counted("frames_truncated", truncated);
  expect_counted("frames_other_version", other_version);
  expect_counted("frames_unknown_flags", unknown_flags);
  expect_counted("frames_other_profile", good_frame(frame::ProfileId::kKilobot));
  expect_counted("frames_tagged", tagged_frame(20), kVlanEthertype);
  expect_counted("frames_tagged", tagged_frame(1), kVlanEthertype);
}

void RawL2Wire::drop_and_count_its_own_echo() {
  const Bytes mac = WireProbe(*network_, 'a').mac();
  Bytes own = good_frame();
  for (std::size_t i = 0; i < 4; ++i) {
    own[frame::kEpochAt + i] = static_cast<std::uint8_t>(user_.header.epoch >> (24 - 8 * i));
  }
  probe_->inject(own, mac);  // as an access point repeats it
  ASSERT_TRUE(run_until(io_, [&] { return counter(*link_, "own_echoes") == 1; }));
  EXPECT_TRUE(user_.received.empty());
}

void RawL2Wire::not_see_frames_of_other_ethertypes() {
  probe_->inject(good_frame(), kNeighbourMac, 0x0800);
  probe_->inject(good_frame(), kNeighbourMac, 0x88B6);
  probe_->inject(good_frame(), kNeighbourMac);
  ASSERT_TRUE(run_until(io_, [&] { return !user_.received.empty(); }));
  run_for(io_, 20ms);
  EXPECT_EQ(user_.received.size(), 1U);
  user_.received.clear();
}

void RawL2Wire::receive_a_frame_with_ethernet_padding() {
  Bytes bytes = good_frame();
  bytes.resize(46);
  probe_->inject(bytes, kNeighbourMac);
  ASSERT_TRUE(run_until(io_, [&] { return !user_.received.empty(); }));
  EXPECT_EQ(user_.received[0], numbered_packet(1, 10));
  user_.received.clear();
}

void RawL2Wire::receive_a_frame_with_a_priority_and_no_vlan() {
  probe_->inject(tagged_frame(0), kNeighbourMac, kVlanEthertype);
  ASSERT_TRUE(run_until(io_, [&] { return !user_.received.empty(); }));
  EXPECT_EQ(user_.received[0], numbered_packet(1, 10));
  user_.received.clear();
}

void RawL2Wire::keep_what_comes_before_a_bad_packet_length() {
  Bytes bytes = good_frame();
  bytes.push_back(0xFF);
  bytes[5] = static_cast<std::uint8_t>(bytes[5] + 1);  // the frame's length
  probe_->inject(bytes, kNeighbourMac);
  ASSERT_TRUE(run_until(io_, [&] { return counter(*link_, "frames_bad_packet_length") == 1; }));
  EXPECT_EQ(user_.received.size(), 1U);
}

void RawL2Wire::send_broadcast_frames_of_its_ethertype_and_nothing_else() {
  for (std::uint32_t i = 0; i < 200; ++i) {
    user_.waiting.push_back(numbered_packet(i, 4 + 7 * i));
    link_->wake();
  }
  const Bytes mac = WireProbe(*network_, 'a').mac();
  ASSERT_TRUE(run_until(io_, [&] { return counter(*link_, "packets_sent") == 200; }));
  run_for(io_, 20ms);
  const std::vector<Bytes> frames = probe_->heard();
  EXPECT_EQ(frames.size(), counter(*link_, "frames_sent"));
  for (const Bytes& bytes : frames) {
    ASSERT_GE(bytes.size(), 14U);
    ASSERT_LE(bytes.size(), 1514U);
    EXPECT_EQ(Bytes(bytes.begin(), bytes.begin() + 6), Bytes(6, 0xFF));
    EXPECT_EQ(Bytes(bytes.begin() + 6, bytes.begin() + 12), mac);
    EXPECT_EQ(Bytes(bytes.begin() + 12, bytes.begin() + 14), (Bytes{0x88, 0xB5}));
    frame::Frame frame;
    EXPECT_EQ(frame::parse(std::span(bytes).subspan(14), frame), frame::ParseResult::kOk);
  }
}

/// From now on this thread's setsockopt(SOL_PACKET, PACKET_IGNORE_OUTGOING) is refused.
void be_a_kernel_before_4_20() {
  std::array<sock_filter, 8> refusal{{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_setsockopt, 0, 5),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, args[1])),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SOL_PACKET, 0, 3),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, args[2])),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PACKET_IGNORE_OUTGOING, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOPROTOOPT),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  }};
  const sock_fprog program{static_cast<unsigned short>(refusal.size()), refusal.data()};
  ASSERT_EQ(prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0), 0);
  ASSERT_EQ(syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, 0, &program), 0);
}

void RawL2Wire::hear_others_and_not_itself_on_an_old_kernel() {
  link_.reset();
  user_.received.clear();
  network_->inside('a', [&] {
    be_a_kernel_before_4_20();
    link_ = std::make_unique<RawL2Link>(io_, config_);
  });
  ASSERT_NE(link_, nullptr);
  link_->start(user_);
  ASSERT_TRUE(run_until(io_, [&] { return link_->is_up(); })) << link_->state();
  user_.waiting.push_back(numbered_packet(1, 10));
  link_->wake();
  ASSERT_TRUE(run_until(io_, [&] { return counter(*link_, "packets_sent") == 1; }));
  probe_->inject(good_frame(), kNeighbourMac);
  ASSERT_TRUE(run_until(io_, [&] { return !user_.received.empty(); }));
  run_for(io_, 20ms);
  EXPECT_EQ(probe_->heard().size(), 1U);
  EXPECT_EQ(user_.received.size(), 1U);
  EXPECT_EQ(counter(*link_, "own_echoes"), 0U);
}

TEST_F(RawL2Wire, TakesAndSendsFramesOfItsOwnAndCountsTheOthers) {
  say_nothing_unasked();
  lock_its_filter_and_ignore_outgoing_frames();
  count_what_is_no_frame_of_its_own();
  drop_and_count_its_own_echo();
  not_see_frames_of_other_ethertypes();
  receive_a_frame_with_ethernet_padding();
  receive_a_frame_with_a_priority_and_no_vlan();
  keep_what_comes_before_a_bad_packet_length();
  send_broadcast_frames_of_its_ethertype_and_nothing_else();
  hear_others_and_not_itself_on_an_old_kernel();
}

}  // namespace
}  // namespace swarmtalk::drivers
