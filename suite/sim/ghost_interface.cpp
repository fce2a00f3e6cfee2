#include <arpa/inet.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <deque>
#include <stdexcept>
#include <utility>
#include <vector>

#include "frame/air_frame.hpp"
#include "suite/sim/ghost_air.hpp"
#include "suite/sim/ghost_ethernet.hpp"

namespace swarmtalk::suite {
namespace {

constexpr std::size_t kShortestBytes = 60;  // of an Ethernet frame, without its checksum
constexpr std::size_t kLongestBytes = 1514;

class InterfaceAir final : public GhostAir {
 public:
  InterfaceAir(const std::string& interface, double range_mm) : range_mm_(range_mm) {
    const unsigned index = if_nametoindex(interface.c_str());
    if (index == 0) {
      throw std::runtime_error("there is no interface " + interface + " (`ip link` lists them)");
    }
    fd_ =
        socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, htons(frame::kDefaultEthertype));
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(frame::kDefaultEthertype);
    address.sll_ifindex = static_cast<int>(index);
    if (fd_ < 0 || bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      const std::string why = std::strerror(errno);
      if (fd_ >= 0) close(fd_);
      throw std::runtime_error("joining " + interface + ": " + why +
                               (errno == EPERM ? "; run it with sudo" : ""));
    }
  }
  ~InterfaceAir() override { close(fd_); }
  InterfaceAir(const InterfaceAir&) = delete;
  InterfaceAir& operator=(const InterfaceAir&) = delete;

  void add(double x_mm, double y_mm) override { places_.emplace_back(x_mm, y_mm); }
  void move(uint32_t ghost, double x_mm, double y_mm) override { places_[ghost] = {x_mm, y_mm}; }

  bool send(uint32_t ghost, std::span<const uint8_t> frame) override {
    std::array<uint8_t, kLongestBytes> buffer{};
    if (kEthernetBytes + frame.size() > buffer.size()) return false;
    put_ethernet(buffer, static_cast<uint16_t>(ghost + 1));
    std::memcpy(buffer.data() + kEthernetBytes, frame.data(), frame.size());
    // The kernel does not hand our own frames back to us.
    among_ghosts_.emplace_back(ghost, std::vector<uint8_t>(frame.begin(), frame.end()));
    const std::size_t size = std::max(kShortestBytes, kEthernetBytes + frame.size());
    return ::send(fd_, buffer.data(), size, MSG_DONTWAIT) == static_cast<ssize_t>(size);
  }

  int descriptor() const override { return fd_; }

  void receive(const Hear& hear) override {
    constexpr int kFrames = 256;
    std::array<uint8_t, kLongestBytes> buffer;
    for (int i = 0; i < kFrames; ++i) {
      sockaddr_ll source{};
      socklen_t source_size = sizeof source;
      const ssize_t size = recvfrom(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT,
                                    reinterpret_cast<sockaddr*>(&source), &source_size);
      if (size < 0) break;  // none waits, or the interface is down: it may come back
      if (source.sll_pkttype == PACKET_OUTGOING) continue;
      const auto whole = static_cast<std::size_t>(size);
      if (whole > kEthernetBytes) {
        hand_on(std::span(buffer).first(whole).subspan(kEthernetBytes), UINT32_MAX, hear);
      }
    }
    while (!among_ghosts_.empty()) {
      const auto [ghost, frame] = std::move(among_ghosts_.front());
      among_ghosts_.pop_front();
      hand_on(frame, ghost, hear);
    }
  }

 private:
  /// To all ghosts that are in range of the pose in the frame, but not to `from`.
  void hand_on(std::span<const uint8_t> bytes, uint32_t from, const Hear& hear) const {
    frame::Frame read;
    const bool is_readable = frame::parse(bytes, read) == frame::ParseResult::kOk;
    const bool has_place = is_readable && read.header.pose && !read.header.pose->is_stale();
    for (uint32_t ghost = 0; ghost < places_.size(); ++ghost) {
      if (ghost == from) continue;
      const auto& [x_mm, y_mm] = places_[ghost];
      if (has_place &&
          std::hypot(x_mm - read.header.pose->x_mm, y_mm - read.header.pose->y_mm) > range_mm_) {
        continue;
      }
      hear(ghost, bytes);
    }
  }

  int fd_ = -1;
  double range_mm_;
  std::vector<std::pair<double, double>> places_;  // mm, by ghost
  std::deque<std::pair<uint32_t, std::vector<uint8_t>>> among_ghosts_;
};

}  // namespace

std::unique_ptr<GhostAir> join_interface(const std::string& interface, double range_mm) {
  return std::make_unique<InterfaceAir>(interface, range_mm);
}

}  // namespace swarmtalk::suite
