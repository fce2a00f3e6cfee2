// Two network namespaces joined by a veth pair, for the tests of the links on real wires. Made in
// the constructor, removed in the destructor, under names that no other test has. Needs root.
#pragma once

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

}  // namespace swarmtalk::drivers
