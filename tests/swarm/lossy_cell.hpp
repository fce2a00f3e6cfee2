// Robots on one air that loses frames, in virtual time, from a seed. Each robot is what a daemon's
// station is without its clock and its sockets: a core node of the profile `wifi` with Repairs
// beside it, and the links' own FrameBuilder and FrameReceiver. Each frame is lost at each receiver
// by itself, and costs its air time; none collide.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "drivers/link/airtime.hpp"
#include "drivers/link/framer.hpp"
#include "redundancy/repairs.hpp"
#include "redundancy/wifi_packet.hpp"
#include "sim/event_queue.hpp"
#include "sim/random.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::testing {

struct CellConfig {
  uint32_t robots = 10;
  uint32_t talkers = 10;        // the first of them publish
  uint32_t message_bytes = 24;  // at least 8
  double rate_hz = 8;           // messages of each talker, each 20 % sooner or later
  double seconds = 100;
  double loss = 0.2;    // of frames, at each receiver
  unsigned copies = 1;  // each message is sent so often, as a publisher's `copies` are
  uint64_t copy_interval_us = 20'000;
  unsigned repairs = 0;       // of each message; 0: none
  bool is_automatic = false;  // repairs as repairs_for_loss() says
  uint64_t copy_wait_us = redundancy::RepairSender::kCopyWaitUs;
  uint8_t ttl = 0;
  uint32_t line_reach = 0;  // robots stand in a line and reach so many others; 0: all do
  uint32_t old_robots_from = UINT32_MAX;  // from this one on they know nothing of repair packets
  double air_rate_mbps = 6;
  std::size_t frame_bytes = 1500;  // at most: the interface's MTU
  bool has_pose = true;
  bool is_timestamped = false;
  uint64_t seed = 1;
};

struct CellResult {
  uint64_t sent = 0;          // messages
  uint64_t expected = 0;      // of them at other robots
  uint64_t delivered = 0;     // there, each counted once
  uint64_t duplicates = 0;    // delivered once more
  uint64_t damaged = 0;       // delivered with other bytes than were sent
  uint64_t out_of_order = 0;  // delivered after a later one of the same talker
  uint64_t frames = 0;
  uint64_t packets = 0;
  double air_us = 0;
  double late_us_sum = 0;              // from publish to delivery, of all delivered
  uint64_t recovered = 0;              // packets
  uint64_t shared = 0;                 // frames with a repair packet beside a packet of its message
  uint64_t resent = 0;                 // parity packets that one robot sent twice
  uint64_t forwarded = 0;              // parity packets sent on
  uint64_t refused = 0;                // packets counted as bad by nodes
  std::vector<uint64_t> delivered_at;  // by receiving robot

  double delivery() const {
    return expected == 0 ? 0 : static_cast<double>(delivered) / static_cast<double>(expected);
  }
  double packets_per_message() const {
    return static_cast<double>(packets) / static_cast<double>(sent);
  }
  double air_us_per_message() const { return air_us / static_cast<double>(sent); }
  double late_ms() const {
    return delivered == 0 ? 0 : late_us_sum / static_cast<double>(delivered) / 1e3;
  }
};

class LossyCell {
 public:
  explicit LossyCell(const CellConfig& config) : config_(config), random_(config.seed) {
    result_.delivered_at.assign(config.robots, 0);
    for (uint32_t i = 0; i < config.robots; ++i) {
      robots_.push_back(std::make_unique<Robot>(*this, i));
    }
  }

  CellResult run() {
    const auto end_us = static_cast<uint64_t>(config_.seconds * 1e6);
    for (uint32_t i = 0; i < config_.talkers; ++i) {
      events_.push(random_.below(static_cast<uint32_t>(interval_us())), i << kKindBits | kPublish);
    }
    // What is under way at the end has time to arrive, and nothing is begun.
    sim::Event event{};
    while (events_.pop(end_us + kDrainUs, event)) {
      now_us_ = event.at_us;
      Robot& robot = *robots_[event.what >> kKindBits];
      switch (event.what & ((1u << kKindBits) - 1)) {
        case kPublish:
          if (now_us_ < end_us) publish(robot);
          break;
        case kCopy:
          robot.send_again();
          break;
        case kWake:
          break;
      }
      flush(robot);
    }
    for (const auto& robot : robots_) {
      result_.recovered += robot->repairs.recovered();
      result_.forwarded += robot->repairs.forwarded();
      result_.refused += robot->node.counters().bad_packets;
    }
    return result_;
  }

 private:
  using Node = core::Swarmtalk<core::Wifi>;
  using Packet = std::vector<uint8_t>;
  enum Kind : uint32_t { kPublish, kCopy, kWake };
  static constexpr unsigned kKindBits = 2;
  static constexpr uint64_t kDrainUs = 5'000'000;
  static constexpr uint16_t kChannel = 7;
  static constexpr std::size_t kRoomBytes = 4096;

  struct Robot final : drivers::LinkUser {
    Robot(LossyCell& owner, uint32_t number)
        : cell(owner),
          index(number),
          node(core::Port{&clock, &draw, &owner}),
          repairs(owner.config_.copy_wait_us),
          builder(frame::ProfileId::kWifi, core::Wifi::kMtuBytes),
          receiver(frame::ProfileId::kWifi) {
      node.set_node_id(static_cast<uint16_t>(number + 1));
      node.set_epoch(static_cast<uint16_t>(100 + number));
      node.limit_forwarding(16, 5'000'000);
      repairs.relay().limit(16, 5'000'000);
      channel = node.new_channel(kChannel, 0, owner.config_.is_timestamped);
      channel->new_publisher([](void* self) { static_cast<Robot*>(self)->on_sent(); }, this);
      channel->new_subscriber(std::numeric_limits<float>::infinity(), &on_message, this);
    }
    static uint32_t clock(void* cell) {
      return static_cast<uint32_t>(static_cast<LossyCell*>(cell)->now_us_);
    }
    static uint32_t draw(void* cell) {
      return static_cast<uint32_t>(static_cast<LossyCell*>(cell)->random_.bits());
    }
    static void on_message(void* self, const uint8_t* bytes, uint16_t size,
                           const core::Reception<core::Wifi>& reception) {
      auto* const robot = static_cast<Robot*>(self);
      robot->cell.deliver(*robot, bytes, size, reception.node - 1u);
    }
    bool is_old() const { return index >= cell.config_.old_robots_from; }
    void on_sent() {
      if (copies_left == 0) return;
      --copies_left;
      cell.events_.push(cell.now_us_ + cell.config_.copy_interval_us, index << kKindBits | kCopy);
    }
    void send_again() {
      if (channel->send_again() == core::Error::kOk) repairs.sender().repeats(kChannel);
    }

    std::size_t node_bytes() {
      node.drop_late_forwards();
      return node.next_packet_bytes();
    }
    std::size_t pull_from_node(std::span<uint8_t> out) {
      const std::size_t bytes = node_bytes();
      if (bytes == 0 || bytes > out.size()) return 0;
      return node.pull_packet(out.data());
    }
    std::size_t pull_packet(std::span<uint8_t> out) override {
      using Next = redundancy::Repairs::Next;
      const Next next = repairs.choose(node_bytes(), out.size(), cell.now_us_);
      std::size_t bytes = 0;
      if (next == Next::kNode) {
        bytes = pull_from_node(out);
        repairs.take(next, out.first(bytes), cell.now_us_);
      } else {
        bytes = repairs.take(next, out, cell.now_us_);
      }
      if (bytes != 0) in_frame.emplace_back(out.begin(), out.begin() + static_cast<long>(bytes));
      return bytes;
    }
    std::size_t next_packet_bytes() override {
      return repairs.waiting_bytes(node_bytes(), cell.now_us_);
    }
    void on_packet(std::span<const uint8_t> packet, const drivers::FrameReception&) override {
      const core::Error result = give_to_node(packet);
      if (is_old() || !redundancy::is_marked(packet)) return;
      const redundancy::Header header = redundancy::Wire::decode(packet.data());
      for (const Packet& known : repairs.receive(packet, result != core::Error::kOk,
                                                 header.node == index + 1u, true, cell.now_us_)) {
        give_to_node(known);
      }
    }
    core::Error give_to_node(std::span<const uint8_t> packet) {
      return node.on_packet(packet.data(), static_cast<uint16_t>(packet.size()), {});
    }
    frame::FrameHeader frame_header() override {
      repairs.begin_frame();
      frame::FrameHeader header;
      header.node = static_cast<uint16_t>(index + 1);
      header.epoch = 100 + index;
      if (cell.config_.has_pose) header.pose = frame::FramePose{};
      return header;
    }

    LossyCell& cell;
    uint32_t index;
    Node node;
    redundancy::Repairs repairs;
    drivers::FrameBuilder builder;
    drivers::FrameReceiver receiver;
    drivers::LinkCounters counters;
    core::Channel<core::Wifi>* channel = nullptr;
    unsigned copies_left = 0;
    uint32_t published = 0;
    uint64_t wakes_at_us = 0;
    std::vector<Packet> in_frame;
    std::map<std::string, int> parities_sent;
    std::map<uint32_t, std::vector<bool>> heard;  // messages by talker
    std::map<uint32_t, uint32_t> newest;
  };

  double interval_us() const { return 1e6 / config_.rate_hz; }

  void publish(Robot& robot) {
    const double stretch = 1 + 0.2 * random_.symmetric();
    events_.push(now_us_ + static_cast<uint64_t>(interval_us() * stretch),
                 robot.index << kKindBits | kPublish);
    const uint32_t number = robot.published + 1;
    const Packet message = content(robot.index, number);
    if (robot.channel->publish(message.data(), static_cast<uint16_t>(message.size()), config_.ttl,
                               false) != core::Error::kOk) {
      return;  // the one before is still being repeated
    }
    robot.published = number;
    robot.copies_left = config_.copies - 1;
    ++result_.sent;
    result_.expected += config_.robots - 1;
    const unsigned packets = core::Wire<core::Wifi>::packets_for(
        static_cast<uint16_t>(message.size()), config_.is_timestamped ? 1379 : 1383);
    const unsigned repairs = config_.is_automatic
                                 ? redundancy::repairs_for_loss(packets, config_.loss)
                                 : config_.repairs;
    if (repairs != 0) robot.repairs.sender().protect(kChannel, number, repairs);
    times_[robot.index].push_back(now_us_);
  }

  /// What a message holds: who, which, and bytes that follow from both.
  Packet content(uint32_t talker, uint32_t number) const {
    Packet bytes(config_.message_bytes);
    std::memcpy(bytes.data(), &talker, sizeof talker);
    std::memcpy(bytes.data() + 4, &number, sizeof number);
    uint64_t draw = sim::mix(uint64_t{talker} << 32 | number);
    for (std::size_t i = 8; i < bytes.size(); ++i) {
      if (i % 8 == 0) draw = sim::mix(draw + i);
      bytes[i] = static_cast<uint8_t>(draw >> (i % 8 * 8));
    }
    return bytes;
  }

  void deliver(Robot& robot, const uint8_t* bytes, uint16_t size, uint32_t talker) {
    uint32_t number = 0;
    if (size >= 8) std::memcpy(&number, bytes + 4, sizeof number);
    if (Packet(bytes, bytes + size) != content(talker, number)) {
      ++result_.damaged;
      return;
    }
    std::vector<bool>& heard = robot.heard[talker];
    if (heard.size() <= number) heard.resize(number + 1);
    if (heard[number]) {
      ++result_.duplicates;
      return;
    }
    heard[number] = true;
    uint32_t& newest = robot.newest[talker];
    if (number < newest) ++result_.out_of_order;
    newest = std::max(newest, number);
    ++result_.delivered;
    ++result_.delivered_at[robot.index];
    result_.late_us_sum += static_cast<double>(now_us_ - times_[talker][number - 1]);
  }

  /// Sends all that waits, one frame after the other.
  void flush(Robot& robot) {
    std::vector<uint8_t> buffer(robot.builder.buffer_bytes(config_.frame_bytes) + kRoomBytes);
    for (bool more = true; more;) {
      robot.in_frame.clear();
      const drivers::BuiltFrame built =
          robot.builder.build(robot, buffer, config_.frame_bytes, robot.counters);
      more = built.more_waits;
      if (built.size_bytes == 0) break;
      note_frame(robot, built.size_bytes);
      hear_around(robot, std::span(buffer).first(built.size_bytes));
    }
    const auto due_us = robot.repairs.sender().next_due_us();
    if (!due_us || *due_us == robot.wakes_at_us || *due_us > kNever) return;
    robot.wakes_at_us = *due_us;
    events_.push(*due_us, robot.index << kKindBits | kWake);
  }
  static constexpr uint64_t kNever = UINT64_MAX / 4;

  void note_frame(Robot& robot, std::size_t bytes) {
    ++result_.frames;
    result_.packets += robot.in_frame.size();
    result_.air_us += drivers::airtime_us(1, bytes, config_.air_rate_mbps);
    std::map<std::string, int> messages;
    bool has_parity_of = false;
    for (const Packet& packet : robot.in_frame) {
      const redundancy::Header header = redundancy::Wire::decode(packet.data());
      std::string name(reinterpret_cast<const char*>(packet.data()), 6);
      name.append(reinterpret_cast<const char*>(packet.data()) + 8, 2);
      const bool is_parity = redundancy::is_parity(packet, header);
      const bool is_whole = redundancy::source_packets(header) == 1;
      if ((messages[name]++ > 0 && is_whole) || is_parity) has_parity_of |= messages[name] > 1;
      if (is_parity) {
        const std::string key(reinterpret_cast<const char*>(packet.data()), 10);
        if (robot.parities_sent[key]++ > 0) ++result_.resent;
      }
    }
    if (has_parity_of) ++result_.shared;
  }

  void hear_around(Robot& from, std::span<const uint8_t> bytes) {
    for (const auto& to : robots_) {
      if (to.get() == &from) continue;
      const uint32_t apart =
          to->index > from.index ? to->index - from.index : from.index - to->index;
      if (config_.line_reach != 0 && apart > config_.line_reach) continue;
      if (random_.uniform() < config_.loss) continue;
      to->receiver.receive(bytes, {}, *to, to->counters);
      if (to->next_packet_bytes() > 0) {
        events_.push(now_us_ + 1000 + random_.below(4000), to->index << kKindBits | kWake);
      }
    }
  }

  CellConfig config_;
  sim::Random random_;
  sim::EventQueue events_;
  uint64_t now_us_ = 0;
  std::vector<std::unique_ptr<Robot>> robots_;
  std::map<uint32_t, std::vector<uint64_t>> times_;  // of publication, by talker
  CellResult result_;
};

}  // namespace swarmtalk::testing
