// Plays the lines of a packet file (packets_2020.txt explains them) against a node, both ways.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <sstream>
#include <string>

#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core::testing {

inline Bytes from_hex(const std::string& hex) {
  Bytes bytes;
  for (size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<uint8_t>(std::stoul(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

/// Plays the lines of one format.
template <class P>
class Player {
 public:
  /// @return false if the word is not one of ours
  bool play(const std::string& word, std::istringstream& line) {
    if (word == "send") {
      send(line);
    } else if (word == "packet") {
      node_->port.now = number(line, "clock");
      EXPECT_EQ(node_->pull(), rest(line)) << name_;
      ++checked;
    } else if (word == "too_long") {
      too_long(line);
    } else if (word == "listen") {
      listen(line);
    } else if (word == "hear") {
      node_->port.now = number(line, "clock");
      node_->received.clear();
      typename P::Sensing sensing{};
      sensing.distance = 7;
      node_->hear(rest(line), sensing);
    } else if (word == "deliver") {
      deliver(line);
    } else if (word == "forward") {
      EXPECT_EQ(node_->pull(), rest(line)) << name_;
      ++checked;
    } else {
      return false;
    }
    return true;
  }
  int checked = 0;

 private:
  static uint32_t number(std::istringstream& line, const std::string& label) {
    std::string word;
    uint32_t value = 0;
    line >> word >> value;
    EXPECT_EQ(word, label);
    return value;
  }
  static Bytes rest(std::istringstream& line) {
    std::string hex;
    line >> hex;
    if (hex == "bytes") line >> hex;
    return hex == "-" ? Bytes{} : from_hex(hex);
  }

  void send(std::istringstream& line) {
    line >> name_;
    node_ = std::make_unique<TestNode<P>>(static_cast<uint16_t>(number(line, "node")));
    const uint32_t message = number(line, "message");
    const uint32_t channel = number(line, "channel");
    const uint32_t ttl = number(line, "ttl");
    const bool timed = number(line, "timed") != 0;
    ASSERT_NE(node_->open(channel, ttl, timed), nullptr) << name_;
    for (uint32_t i = 1; i < (message == 0 ? 16 : message); ++i) {  // numbers count up from 1
      const uint8_t byte = 0;
      node_->publisher->send(&byte, 1);
      node_->pull();
    }
    node_->port.now = number(line, "clock");
    const Bytes body = rest(line);
    EXPECT_EQ(node_->publisher->send(body.data(), static_cast<uint16_t>(body.size())), Error::kOk);
  }
  void too_long(std::istringstream& line) {
    line >> name_;
    node_ = std::make_unique<TestNode<P>>(1);
    const uint32_t channel = number(line, "channel");
    node_->open(channel, 0, channel >= P::kTimestampedFrom);
    const Bytes body = rest(line);
    EXPECT_EQ(node_->publisher->send(body.data(), static_cast<uint16_t>(body.size())),
              Error::kTooLong);
    EXPECT_FALSE(node_->node.has_packet());
    ++checked;
  }
  void listen(std::istringstream& line) {
    line >> name_;
    node_ = std::make_unique<TestNode<P>>(static_cast<uint16_t>(number(line, "node")));
    const uint32_t channel = number(line, "channel");
    node_->open(channel, 0, number(line, "timed") != 0);
  }
  void deliver(std::istringstream& line) {
    ASSERT_EQ(node_->received.size(), 1u) << name_;
    const auto& [bytes, reception] = node_->received[0];
    EXPECT_EQ(bytes.size(), number(line, "size")) << name_;
    EXPECT_EQ(reception.ttl, number(line, "ttl")) << name_;
    EXPECT_EQ(reception.delay_ticks, number(line, "delay")) << name_;
    EXPECT_EQ(bytes, rest(line)) << name_;
    EXPECT_EQ(reception.sensing.distance, 7);
    ++checked;
  }

  std::string name_;
  std::unique_ptr<TestNode<P>> node_;
};

}  // namespace swarmtalk::core::testing
