#include "tests/unit/drivers/test_link_user.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

namespace swarmtalk::drivers {

Bytes numbered_packet(std::uint32_t number, std::size_t size) {
  Bytes packet(std::max<std::size_t>(size, 4));
  for (std::size_t i = 0; i < 4; ++i) {
    packet[i] = static_cast<std::uint8_t>(number >> (24 - 8 * i));
  }
  for (std::size_t i = 4; i < packet.size(); ++i) {
    packet[i] = static_cast<std::uint8_t>(number + 31 * i);
  }
  return packet;
}

std::uint32_t packet_number(std::span<const std::uint8_t> packet) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4 && i < packet.size(); ++i) number = (number << 8) | packet[i];
  return number;
}

std::size_t TestLinkUser::pull_packet(std::span<std::uint8_t> out) {
  if (waiting.empty() || waiting.front().size() > out.size()) return 0;
  const Bytes packet = std::move(waiting.front());
  waiting.pop_front();
  std::copy(packet.begin(), packet.end(), out.begin());
  return packet.size();
}

void TestLinkUser::on_packet(std::span<const std::uint8_t> packet, const FrameReception& frame) {
  received.emplace_back(packet.begin(), packet.end());
  receptions.push_back(frame);
  if (on_received) on_received(received.back());
}

std::uint16_t udp_port() {
  return static_cast<std::uint16_t>(20000 + getpid() % 10000);
}

std::uint64_t counter(const Link& link, const std::string& name) {
  for (const auto& [counter_name, value] : link.counters()) {
    if (counter_name == name) return value;
  }
  ADD_FAILURE() << "no counter " << name;
  return 0;
}

}  // namespace swarmtalk::drivers
