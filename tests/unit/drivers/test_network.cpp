#include "tests/unit/drivers/test_network.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

namespace swarmtalk::drivers {
namespace {

void run(const std::string& command) {
  if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
}

std::string unique_prefix() {
  static std::atomic<int> count = 0;
  return "swt-" + std::to_string(getpid()) + "-" + std::to_string(count++) + "-";
}

}  // namespace

TestNetwork::TestNetwork() : prefix_(unique_prefix()) {
  for (const char side : {'a', 'b'}) {
    run("ip netns add " + name(side));
    // The kernel's own IPv6 frames would be on the wire too.
    run("ip netns exec " + name(side) +
        " sysctl -q -w net.ipv6.conf.all.disable_ipv6=1 net.ipv6.conf.default.disable_ipv6=1");
    ip(side, "link set lo up");
  }
  add_pair();
}

TestNetwork::~TestNetwork() {
  for (const char side : {'a', 'b'}) {
    if (std::system(("ip netns del " + name(side)).c_str()) != 0) std::abort();
  }
}

bool TestNetwork::is_possible() {
  return geteuid() == 0 && std::system("ip netns list >/dev/null 2>&1") == 0;
}

void TestNetwork::add_pair() {
  run("ip link add name air0 netns " + name('a') + " type veth peer name air0 netns " + name('b'));
  for (const char side : {'a', 'b'}) ip(side, "link set air0 up");
}

void TestNetwork::ip(char side, const std::string& arguments) const {
  run("ip -n " + name(side) + " " + arguments);
}

void TestNetwork::inside(char side, const std::function<void()>& work) const {
  std::exception_ptr failure;
  std::thread([&] {
    try {
      const int descriptor = open(("/run/netns/" + name(side)).c_str(), O_RDONLY | O_CLOEXEC);
      const bool is_inside = descriptor >= 0 && setns(descriptor, CLONE_NEWNET) == 0;
      if (descriptor >= 0) close(descriptor);
      if (!is_inside) throw std::runtime_error(std::string("setns: ") + std::strerror(errno));
      work();
    } catch (...) {
      failure = std::current_exception();
    }
  }).join();
  if (failure) std::rethrow_exception(failure);
}

WireProbe::WireProbe(const TestNetwork& network, char side) {
  network.inside(side, [this] {
    socket_ = socket(AF_PACKET, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, htons(ETH_P_ALL));
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(ETH_P_ALL);
    address.sll_ifindex = static_cast<int>(if_nametoindex("air0"));
    const int on = 1;
    const int buffer_bytes = 64 << 20;
    setsockopt(socket_, SOL_PACKET, PACKET_IGNORE_OUTGOING, &on, sizeof on);
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUFFORCE, &buffer_bytes, sizeof buffer_bytes);
    if (bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error(std::string("probe: ") + std::strerror(errno));
    }
  });
}

WireProbe::~WireProbe() {
  close(socket_);
}

std::vector<Bytes> WireProbe::heard() const {
  std::vector<Bytes> frames;
  Bytes buffer(65536);
  for (;;) {
    const ssize_t size = recv(socket_, buffer.data(), buffer.size(), 0);
    if (size < 0) return frames;
    frames.emplace_back(buffer.begin(), buffer.begin() + size);
  }
}

void WireProbe::inject(const Bytes& air_frame, const Bytes& source_mac, std::uint16_t ethertype) {
  Bytes frame(6, 0xFF);
  frame.insert(frame.end(), source_mac.begin(), source_mac.end());
  frame.push_back(static_cast<std::uint8_t>(ethertype >> 8));
  frame.push_back(static_cast<std::uint8_t>(ethertype));
  frame.insert(frame.end(), air_frame.begin(), air_frame.end());
  if (send(socket_, frame.data(), frame.size(), 0) < 0) {
    throw std::runtime_error(std::string("inject: ") + std::strerror(errno));
  }
}

Bytes WireProbe::mac() const {
  ifreq request{};
  std::strcpy(request.ifr_name, "air0");
  if (ioctl(socket_, SIOCGIFHWADDR, &request) != 0) throw std::runtime_error("SIOCGIFHWADDR");
  return Bytes(request.ifr_hwaddr.sa_data, request.ifr_hwaddr.sa_data + 6);
}

}  // namespace swarmtalk::drivers
