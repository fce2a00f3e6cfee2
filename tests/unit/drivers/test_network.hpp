// Two network namespaces joined by a veth pair, for the tests of the links on real wires. Made in
// the constructor, removed in the destructor, under names that no other test has. Needs root.
#pragma once

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/unit/drivers/test_link_user.hpp"

#define SWARMTALK_SKIP_WITHOUT_ROOT()                                         \
  if (!swarmtalk::drivers::TestNetwork::is_possible()) {                      \
    GTEST_SKIP() << "needs root, for network namespaces (ip netns) and veth"; \
  }

namespace swarmtalk::drivers {

class TestNetwork {
 public:
  TestNetwork();
  ~TestNetwork();
  TestNetwork(const TestNetwork&) = delete;
  TestNetwork& operator=(const TestNetwork&) = delete;

  static bool is_possible();

  /// The pair: "air0" in both namespaces, switched on.
  void add_pair();

  /// `ip -n NAMESPACE ARGUMENTS`; throws when it fails. @param side  'a' or 'b'
  void ip(char side, const std::string& arguments) const;

  /// Runs `work` inside a namespace, in a thread of its own; what it opens belongs to there.
  void inside(char side, const std::function<void()>& work) const;

  template <typename LinkType, typename Config>
  std::unique_ptr<LinkType> link(char side, boost::asio::io_context& io,
                                 const Config& config) const {
    std::unique_ptr<LinkType> result;
    inside(side, [&] { result = std::make_unique<LinkType>(io, config); });
    return result;
  }

 private:
  std::string name(char side) const { return prefix_ + side; }

  std::string prefix_;
};

/// A packet socket of the test's own on "air0", for all EtherTypes: sees and injects anything.
class WireProbe {
 public:
  WireProbe(const TestNetwork& network, char side);
  ~WireProbe();
  WireProbe(const WireProbe&) = delete;
  WireProbe& operator=(const WireProbe&) = delete;

  /// Whole Ethernet frames that have come in from the other side since the last call.
  std::vector<Bytes> heard() const;

  /// @param source_mac  6 bytes
  void inject(const Bytes& air_frame, const Bytes& source_mac, std::uint16_t ethertype = 0x88B5);

  /// Address of "air0" on this side.
  Bytes mac() const;

 private:
  int socket_ = -1;
};

/// Two links on the ends of a network of the test's own.
template <typename LinkType, typename Config>
class LinkPair : public ::testing::Test {
 protected:
  void SetUp() override {
    SWARMTALK_SKIP_WITHOUT_ROOT();
    network_.emplace();
  }

  /// A new pair of links: nothing was counted or heard so far.
  void open(const std::function<void(Config&)>& change = {}) {
    a_.reset();
    b_.reset();
    user_a_ = TestLinkUser(1);
    user_b_ = TestLinkUser(2);
    config_ = Config{};
    config_.interface = "air0";
    if (change) change(config_);
    a_ = network_->link<LinkType>('a', io_, config_);
    b_ = network_->link<LinkType>('b', io_, config_);
    a_->start(user_a_);
    b_->start(user_b_);
  }

  std::optional<TestNetwork> network_;
  boost::asio::io_context io_;
  Config config_;
  TestLinkUser user_a_{1};
  TestLinkUser user_b_{2};
  std::unique_ptr<LinkType> a_;
  std::unique_ptr<LinkType> b_;
};

}  // namespace swarmtalk::drivers
