// What the tests of the links put above a link: a LinkUser with a queue of packets to send and a
// list of those received, and a bounded run of the event loop.
#pragma once

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "drivers/link/link.hpp"

namespace swarmtalk::drivers {

using Bytes = std::vector<std::uint8_t>;

/// `size` bytes that say their number: big-endian in the first four, then a pattern.
Bytes numbered_packet(std::uint32_t number, std::size_t size);
std::uint32_t packet_number(std::span<const std::uint8_t> packet);

class TestLinkUser : public LinkUser {
 public:
  explicit TestLinkUser(std::uint16_t node, std::uint32_t epoch = 0x1000) {
    header.node = node;
    header.epoch = epoch + node;
  }

  std::size_t pull_packet(std::span<std::uint8_t> out) override;
  std::size_t next_packet_bytes() override { return waiting.empty() ? 0 : waiting.front().size(); }
  bool has_forwards_only() override { return !waiting.empty() && own_waiting == 0; }
  void on_packet(std::span<const std::uint8_t> packet, const FrameReception& frame) override;
  frame::FrameHeader frame_header() override { return header; }
  void on_frame(const FrameReception& frame) override { frames.push_back(frame); }
  std::size_t last_messages(std::span<frame::LastMessage> out) override {
    const std::size_t count = std::min(out.size(), last.size());
    std::copy_n(last.begin(), count, out.begin());
    return count;
  }
  void on_last_message(const frame::LastMessage& told, const FrameReception&) override {
    last_heard.push_back(told);
  }
  bool is_own_frame(const frame::FrameHeader& other) override {
    return knows_itself && other.node == header.node && other.epoch == header.epoch;
  }

  std::deque<Bytes> waiting;
  int own_waiting = 1;  // of them; 0: all are of others
  std::vector<Bytes> received;
  std::vector<FrameReception> receptions;  // one for each packet
  std::vector<FrameReception> frames;
  std::vector<frame::LastMessage> last;  // for beacons
  std::vector<frame::LastMessage> last_heard;
  frame::FrameHeader header;
  bool knows_itself = false;                      // on the air
  std::function<void(const Bytes&)> on_received;  // may be empty
};

/// A port of this process: below those that the kernel gives away, and below those of tests in
/// Python (tests/support/ports.py).
std::uint16_t udp_port();

std::uint64_t counter(const Link& link, const std::string& name);

/// Runs `io` until `is_done`, at most test::kPatience. @return is_done()
bool run_until(boost::asio::io_context& io, const std::function<bool()>& is_done);

/// Runs `io` for `duration`: to see that nothing happens.
void run_for(boost::asio::io_context& io, std::chrono::milliseconds duration);

}  // namespace swarmtalk::drivers
