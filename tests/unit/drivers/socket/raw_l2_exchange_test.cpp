// Two RawL2Links on the ends of a veth pair.
#include <gtest/gtest.h>

#include <cstdlib>

#include "drivers/socket/raw_l2.hpp"
#include "tests/unit/drivers/test_network.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

class RawL2Exchange : public LinkPair<RawL2Link, RawL2Config> {
 protected:
  void open(const std::function<void(RawL2Config&)>& change = {}) {
    LinkPair::open(change);
    ASSERT_TRUE(run_until(io_, [&] { return a_->is_up() && b_->is_up(); })) << a_->state();
  }

  void send_from_a(std::uint32_t number, std::size_t size) {
    user_a_.waiting.push_back(numbered_packet(number, size));
    a_->wake();
  }

  /// Replaces the queueing discipline of "air0".
  void run_tc(char side, const std::string& discipline) {
    network_->inside(side, [&] {
      const std::string command = "tc qdisc replace dev air0 root " + discipline;
      ASSERT_EQ(std::system(command.c_str()), 0);
    });
  }

  // Steps of the stories below, each on links of its own.
  void carry_packets_of_every_size_in_both_directions();
  void hand_up_the_transmitters_header_and_no_echo();
  void time_reception_by_the_kernel_not_by_the_reading();
  void put_packets_that_wait_into_full_frames();
  void speak_on_the_configured_ethertype_only();
  void carry_the_small_packets_of_another_profile();
  void carry_ten_thousand_packets_in_a_window_without_loss();
  void lose_nothing_when_the_kernels_send_queue_is_full();
  void count_what_the_kernel_drops();
  void keep_the_rate_limit();
  void retry_what_the_interfaces_queue_drops();
  void wait_until_the_socket_is_writable();
  void give_up_a_frame_after_a_second_and_count_it();
};

void RawL2Exchange::carry_packets_of_every_size_in_both_directions() {
  open();
  for (std::size_t size = 4; size <= config_.max_packet_bytes; size += 4) {
    user_a_.waiting.push_back(numbered_packet(1, size));
    user_b_.waiting.push_back(numbered_packet(2, size));
  }
  const std::size_t packets = user_a_.waiting.size();
  a_->wake();
  b_->wake();
  ASSERT_TRUE(run_until(io_, [&] {
    return user_a_.received.size() == packets && user_b_.received.size() == packets;
  }));
  for (std::size_t i = 0; i < packets; ++i) {
    ASSERT_EQ(user_b_.received[i], numbered_packet(1, 4 + 4 * i));
    ASSERT_EQ(user_a_.received[i], numbered_packet(2, 4 + 4 * i));
  }
}

void RawL2Exchange::hand_up_the_transmitters_header_and_no_echo() {
  open();
  user_a_.header.pose = frame::FramePose::from_metres(1.0, -2.0, 0.5, 0.04);
  send_from_a(1, 20);
  ASSERT_TRUE(run_until(io_, [&] { return !user_b_.received.empty(); }));
  const FrameReception& reception = user_b_.receptions[0];
  EXPECT_EQ(reception.transmitter, 1);
  EXPECT_EQ(reception.transmitter_epoch, user_a_.header.epoch);
  EXPECT_EQ(reception.frame_counter, 1U);
  EXPECT_EQ(reception.pose, user_a_.header.pose);
  run_for(io_, 20ms);
  EXPECT_EQ(counter(*a_, "own_echoes"), 0U) << "it is woken by its own frames leaving";
}

void RawL2Exchange::time_reception_by_the_kernel_not_by_the_reading() {
  open();
  send_from_a(1, 20);
  ASSERT_TRUE(run_until(io_, [&] { return !user_b_.received.empty(); }));
  user_b_.received.clear();
  user_b_.receptions.clear();

  const MonotonicTime before = std::chrono::steady_clock::now();
  send_from_a(2, 20);
  // One turn of the loop sends it; then the loop rests, as if the daemon were busy.
  ASSERT_TRUE(run_until(io_, [&] { return counter(*a_, "frames_sent") == 2; }));
  const MonotonicTime sent = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() < sent + 30ms) {
  }
  ASSERT_TRUE(run_until(io_, [&] { return !user_b_.received.empty(); }));
  EXPECT_GE(user_b_.receptions[0].received_at, before - 1ms);
  EXPECT_LE(user_b_.receptions[0].received_at, sent + 20ms);
}

void RawL2Exchange::put_packets_that_wait_into_full_frames() {
  open();
  constexpr std::size_t kPackets = 100;
  constexpr std::size_t kPacketBytes = 60;
  for (std::uint32_t i = 0; i < kPackets; ++i) send_from_a(i, kPacketBytes);
  ASSERT_TRUE(run_until(io_, [&] { return user_b_.received.size() == kPackets; }));
  const std::size_t per_frame =
      (1500 - frame::kHeaderBytes) / (frame::kLengthPrefixBytes + kPacketBytes);
  EXPECT_EQ(counter(*a_, "frames_sent"), (kPackets + per_frame - 1) / per_frame);
  EXPECT_EQ(counter(*a_, "packets_sent"), kPackets);
  EXPECT_EQ(counter(*b_, "packets_received"), kPackets);
  EXPECT_EQ(counter(*b_, "bytes_received"), counter(*a_, "bytes_sent"));
}

void RawL2Exchange::speak_on_the_configured_ethertype_only() {
  open([](RawL2Config& config) { config.ethertype = 0x88B6; });
  WireProbe probe(*network_, 'a');
  probe.inject(Bytes(50, 1), Bytes{2, 0, 0, 0, 0, 9}, 0x88B5);
  send_from_a(1, 20);
  ASSERT_TRUE(run_until(io_, [&] { return !user_b_.received.empty(); }));
  EXPECT_EQ(counter(*b_, "frames_not_ours"), 0U);
}

void RawL2Exchange::carry_the_small_packets_of_another_profile() {
  open([](RawL2Config& config) {
    config.profile = frame::ProfileId::kKilobot;
    config.max_packet_bytes = 9;
  });
  for (std::uint32_t i = 0; i < 50; ++i) send_from_a(i, 9);
  ASSERT_TRUE(run_until(io_, [&] { return user_b_.received.size() == 50; }));
  EXPECT_EQ(counter(*a_, "frames_sent"), 1U);
}

void RawL2Exchange::carry_ten_thousand_packets_in_a_window_without_loss() {
  constexpr std::uint32_t kPackets = 10000;
  constexpr std::uint32_t kWindow = 256;
  open();
  std::uint32_t next = 0;
  const bool is_complete = run_until(io_, [&] {
    while (next < kPackets && next < user_b_.received.size() + kWindow) {
      user_a_.waiting.push_back(numbered_packet(next, 4 + next % 1397));
      ++next;
    }
    if (!user_a_.waiting.empty()) a_->wake();
    return user_b_.received.size() >= kPackets;
  });
  ASSERT_TRUE(is_complete) << user_b_.received.size();
  for (std::uint32_t i = 0; i < kPackets; ++i) {
    ASSERT_EQ(user_b_.received[i], numbered_packet(i, 4 + i % 1397));
  }
  EXPECT_EQ(counter(*b_, "kernel_drops"), 0U);
  EXPECT_EQ(counter(*a_, "send_errors"), 0U);
}

void RawL2Exchange::lose_nothing_when_the_kernels_send_queue_is_full() {
  // Far more than a socket's send buffer holds, at once; what the receiver cannot take, it counts.
  constexpr std::uint32_t kPackets = 3000;
  open();
  for (std::uint32_t i = 0; i < kPackets; ++i) send_from_a(i, 1400);
  EXPECT_TRUE(run_until(io_, [&] { return counter(*a_, "packets_sent") == kPackets; }));
  EXPECT_TRUE(run_until(io_, [&] {
    return user_b_.received.size() + counter(*b_, "kernel_drops") == kPackets;
  })) << user_b_.received.size();
  EXPECT_EQ(counter(*a_, "send_errors"), 0U);
}

void RawL2Exchange::count_what_the_kernel_drops() {
  open([](RawL2Config& config) { config.receive_buffer_bytes = 4096; });
  for (std::uint32_t i = 0; i < 100; ++i) send_from_a(i, 1400);
  // The loop does not read meanwhile: frames leave in the same turn that pulls them.
  EXPECT_TRUE(run_until(io_,
                        [&] {
                          return counter(*a_, "frames_sent") == 100 &&
                                 user_b_.received.size() + counter(*b_, "kernel_drops") == 100;
                        }))
      << user_b_.received.size() << " " << counter(*b_, "kernel_drops");
  EXPECT_GT(counter(*b_, "kernel_drops"), 0U);
}

void RawL2Exchange::keep_the_rate_limit() {
  open([](RawL2Config& config) {
    config.pacer.rate_limit_hz = 100.0;
    config.pacer.burst_frames = 2;
  });
  const MonotonicTime before = std::chrono::steady_clock::now();
  for (std::uint32_t i = 0; i < 12; ++i) send_from_a(i, 1400);  // a frame each
  ASSERT_TRUE(run_until(io_, [&] { return user_b_.received.size() == 12; }));
  EXPECT_GE(std::chrono::steady_clock::now() - before, 95ms);
}

void RawL2Exchange::retry_what_the_interfaces_queue_drops() {
  // A queue of 8 kB on a wire of 10 Mbit/s: the sixth frame in a row is refused (ENOBUFS).
  constexpr std::uint32_t kPackets = 60;
  open();
  run_tc('a', "tbf rate 10mbit burst 2kb limit 8kb");
  for (std::uint32_t i = 0; i < kPackets; ++i) send_from_a(i, 1400);
  ASSERT_TRUE(run_until(io_, [&] { return user_b_.received.size() == kPackets; }))
      << user_b_.received.size();
  for (std::uint32_t i = 0; i < kPackets; ++i) ASSERT_EQ(packet_number(user_b_.received[i]), i);
  EXPECT_GT(counter(*a_, "send_retries"), 0U);
  EXPECT_EQ(counter(*a_, "send_errors"), 0U);
}

void RawL2Exchange::wait_until_the_socket_is_writable() {
  // A long queue: it is the socket's send buffer that is full first (EAGAIN).
  constexpr std::uint32_t kPackets = 400;
  open();
  run_tc('a', "tbf rate 40mbit burst 2kb limit 10mb");
  for (std::uint32_t i = 0; i < kPackets; ++i) send_from_a(i, 1400);
  ASSERT_TRUE(run_until(io_, [&] { return user_b_.received.size() == kPackets; }))
      << user_b_.received.size();
  EXPECT_GT(counter(*a_, "send_retries"), 0U);
  EXPECT_LT(counter(*a_, "send_retries"), kPackets) << "it waits, it does not spin";
  EXPECT_EQ(counter(*a_, "send_errors"), 0U);
}

void RawL2Exchange::give_up_a_frame_after_a_second_and_count_it() {
  open();
  run_tc('a', "tbf rate 8kbit burst 2kb limit 2kb");  // a frame in one and a half seconds
  for (std::uint32_t i = 0; i < 10; ++i) send_from_a(i, 1400);
  EXPECT_TRUE(run_until(io_, [&] { return counter(*a_, "send_errors") > 0; }));
  EXPECT_EQ(counter(*a_, "frames_sent") + counter(*a_, "send_errors"), 10U);
}

TEST_F(RawL2Exchange, CarriesPacketsBothWaysAndSaysOfWhom) {
  carry_packets_of_every_size_in_both_directions();
  hand_up_the_transmitters_header_and_no_echo();
  time_reception_by_the_kernel_not_by_the_reading();
  put_packets_that_wait_into_full_frames();
  speak_on_the_configured_ethertype_only();
  carry_the_small_packets_of_another_profile();
}

TEST_F(RawL2Exchange, LosesNothingSilentlyWhateverIsFull) {
  carry_ten_thousand_packets_in_a_window_without_loss();
  lose_nothing_when_the_kernels_send_queue_is_full();
  count_what_the_kernel_drops();
  keep_the_rate_limit();
  retry_what_the_interfaces_queue_drops();
  wait_until_the_socket_is_writable();
  give_up_a_frame_after_a_second_and_count_it();
}

}  // namespace
}  // namespace swarmtalk::drivers
