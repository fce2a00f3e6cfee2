#include "tests/virtual/air.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <unordered_set>
#include <utility>
#include <vector>

#include "daemon/station/link_factory.hpp"
#include "drivers/socket/socket_link.hpp"
#include "loop/clock.hpp"
#include "loop/timer.hpp"
#include "tests/support/turned_clock.hpp"
#include "tests/virtual/virtual_kernel.hpp"

namespace swarmtalk::test {

/// What a link and the air know of each other.
struct Air::Plug {
  std::function<void()> refresh;  // the link looks again; empty: it has ended
  int socket = -1;                // the link's
  bool is_up = true;
};

namespace {

constexpr std::size_t kAddressBytes = 6;  // before each frame
constexpr std::size_t kFrameBytes = 1500;
constexpr std::size_t kDatagramBytes = 2048;
constexpr std::uint64_t kFirstAddress = 0x020000000000;
constexpr int kTransmitBytes = 32768;  // of frames that the medium has not taken

std::uint64_t address_of(std::span<const std::uint8_t> datagram) {
  std::uint64_t address = 0;
  for (std::size_t i = 0; i < kAddressBytes && i < datagram.size(); ++i) {
    address = address << 8 | datagram[i];
  }
  return address;
}

class AirLink final : public drivers::SocketLink {
 public:
  AirLink(boost::asio::io_context& io, int socket, std::uint64_t address,
          std::shared_ptr<Air::Plug> plug, const daemon::LinkConfig& config,
          frame::ProfileId profile, std::size_t max_packet_bytes)
      : SocketLink(io, profile, max_packet_bytes, daemon::pacing_of(config)),
        plug_(std::move(plug)) {
    plug_->refresh = [this] { refresh(); };
    plug_->socket = socket;
    use_receive_socket(socket);
    set_limits(kFrameBytes, kDatagramBytes);
    std::array<std::uint8_t, kAddressBytes> header{};
    for (std::uint8_t& byte : header) {
      byte = static_cast<std::uint8_t>(address >> 40);
      address <<= 8;
    }
    transmit_queue().set_medium_header(header);
    set_own_hardware(address_of(header));
  }
  ~AirLink() override {
    refuse_frames(plug_->socket, 0);  // the next of this number is another one
    plug_->refresh = {};
  }
  void refresh() override { set_state(plug_->is_up, plug_->is_up ? "up" : "down: switched off"); }
  std::string type() const override { return "virtual"; }
  std::string device() const override { return "air"; }

 protected:
  std::optional<std::span<const std::uint8_t>> air_frame(
      const drivers::Datagram& datagram) override {
    return datagram.bytes.subspan(std::min(datagram.bytes.size(), kAddressBytes));
  }
  std::uint64_t hardware_of(const drivers::Datagram& datagram) const override {
    return address_of(datagram.bytes);
  }
  std::size_t medium_header_bytes() const override { return kAddressBytes; }
  std::uint64_t kernel_drops() const override { return 0; }

 private:
  std::shared_ptr<Air::Plug> plug_;
};

}  // namespace

struct Air::Antenna {
  Antenna(boost::asio::io_context& io, const boost::asio::io_context& robots_io, int its_robot,
          std::uint64_t its_number, Air& air)
      : machine(robots_io),
        robot(its_robot),
        number(its_number),
        socket(loop::Loop::of(io), [this, &air](std::uint32_t events) {
          if ((events & EPOLLOUT) != 0) air.flush(*this);
          if ((events & ~std::uint32_t{EPOLLOUT}) != 0) air.hear(*this);
        }) {}

  bool is_heard() const { return plug->refresh && plug->is_up; }

  const boost::asio::io_context& machine;
  int robot;
  std::uint64_t number;
  bool is_gone = false;
  std::shared_ptr<Plug> plug = std::make_shared<Plug>();
  bool is_busy = false;
  std::deque<std::vector<std::uint8_t>> waiting;  // what its robot's socket has no room for yet
  Frames frames;
  std::unordered_set<std::size_t> different;  // hashes of what it has heard
  loop::Descriptor socket;
};

/// A frame that comes later.
struct Air::Delayed {
  Delayed(Air& air, std::uint64_t antenna, Frame its_frame)
      : frame(its_frame.begin(), its_frame.end()), timer(air.io_, [this, &air, antenna] {
          const auto to = air.antennas_.find(antenna);
          if (to != air.antennas_.end() && to->second->is_heard()) air.deliver(*to->second, frame);
        }) {}

  std::vector<std::uint8_t> frame;
  loop::Timer timer;
};

Air::Air(boost::asio::io_context& io, std::uint64_t number, std::uint64_t seed, Course& course,
         Places& places)
    : io_(io),
      course_(course),
      chance_(static_cast<std::mt19937::result_type>(seed)),
      places_(places),
      first_address_(kFirstAddress + (number << 32)) {}

Air::~Air() = default;

std::unique_ptr<drivers::Link> Air::open(boost::asio::io_context& io, int robot,
                                         const daemon::LinkConfig& config, frame::ProfileId profile,
                                         std::size_t max_packet_bytes) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) != 0) {
    throw std::system_error(errno, std::system_category(), "the air of a virtual swarm");
  }
  std::erase_if(antennas_, [](const auto& each) { return each.second->is_gone; });
  const std::uint64_t number = next_antenna_++;
  const std::uint64_t address = first_address_ + static_cast<std::uint64_t>(robot);
  Antenna& antenna =
      *antennas_.emplace(number, std::make_unique<Antenna>(io_, io, robot, number, *this))
           .first->second;
  ::setsockopt(ends[1], SOL_SOCKET, SO_SNDBUF, &kTransmitBytes, sizeof kTransmitBytes);
  antenna.socket.own(ends[0]);
  antenna.plug->is_up = !down_.contains(robot);
  if (refusing_.contains(robot)) refuse_frames(ends[1], refusing_[robot]);
  antenna.is_busy = busy_.contains(robot);
  watch(antenna);
  return std::make_unique<AirLink>(io, ends[1], address, antenna.plug, config, profile,
                                   max_packet_bytes);
}

void Air::set_link(int robot, bool is_up) {
  if (is_up) {
    down_.erase(robot);
  } else {
    down_.insert(robot);
  }
  for (const auto& [number, antenna] : antennas_) {
    if (antenna->robot != robot || !antenna->plug->refresh) continue;
    antenna->plug->is_up = is_up;
    enter(antenna->machine);
    antenna->plug->refresh();
  }
}

void Air::set_busy(int robot, bool is_busy) {
  if (is_busy) {
    busy_.insert(robot);
  } else {
    busy_.erase(robot);
  }
  for (const auto& [number, antenna] : antennas_) {
    if (antenna->robot != robot) continue;
    antenna->is_busy = is_busy;
    watch(*antenna);
  }
}

void Air::watch(Antenna& antenna) {
  if (antenna.is_gone) return antenna.socket.watch(0);
  antenna.socket.watch((antenna.is_busy ? 0u : std::uint32_t{EPOLLIN}) |
                       (antenna.waiting.empty() ? 0u : std::uint32_t{EPOLLOUT}));
}

void Air::set_refusing(int robot, int error) {
  if (error != 0) {
    refusing_[robot] = error;
  } else {
    refusing_.erase(robot);
  }
  for (const auto& [number, antenna] : antennas_) {
    if (antenna->robot == robot && antenna->plug->refresh) {
      refuse_frames(antenna->plug->socket, error);
    }
  }
}

Air::Frames Air::frames_of(int robot) const {
  for (const auto& [number, antenna] : antennas_) {
    if (antenna->robot == robot && antenna->plug->refresh) return antenna->frames;
  }
  return {};
}

bool Air::reaches(const Antenna& from, const Antenna& to) {
  if (from.robot == to.robot || !to.is_heard()) return false;
  const Place a = places_[from.robot];
  const Place b = places_[to.robot];
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m) <= range_m_;
}

void Air::hear(Antenna& from) {
  std::array<std::uint8_t, kDatagramBytes> bytes;
  for (;;) {
    const ssize_t size = ::recv(from.socket.fd(), bytes.data(), bytes.size(), 0);
    if (size < 0) return;
    if (size == 0) {  // its robot has ended
      from.is_gone = true;
      return watch(from);
    }
    const Frame frame(bytes.data(), static_cast<std::size_t>(size));
    ++frames_sent_;
    if (++from.frames.sent == 1) note_start(from, frame);
    course_.add(static_cast<std::uint64_t>(loop::now().time_since_epoch().count()));
    course_.add(frame);
    for (const auto& [number, to] : antennas_) {
      if (!reaches(from, *to)) continue;
      carry(*to, frame);
      if (!draw(duplicates_)) continue;
      ++to->frames.twice;
      if (longest_duplicate_.count() > 0) {
        deliver_within(*to, frame, longest_duplicate_);
      } else {
        carry(*to, frame);
      }
    }
  }
}

/// Its first frame: the epoch is in clear also where the rest is sealed (docs/wire-format.md).
void Air::note_start(Antenna& from, Frame frame) {
  constexpr std::size_t kEpochAt = 12;  // its low half, which packets have
  if (frame.size() < kEpochAt + 2) return;
  const auto epoch = static_cast<std::uint16_t>(frame[kEpochAt] << 8 | frame[kEpochAt + 1]);
  if (!starts_.emplace(from.robot, epoch).second) same_after_restart_.insert(from.robot);
}

/// What chance does to a frame on its way.
void Air::carry(Antenna& to, Frame frame) {
  if (draw(loss_)) {
    ++to.frames.lost;
    return;
  }
  if (!draw(delays_)) return deliver(to, frame);
  ++to.frames.delayed;
  deliver_within(to, frame, longest_delay_);
}

void Air::deliver_within(Antenna& to, Frame frame, std::chrono::nanoseconds longest) {
  delayed_.remove_if([](const Delayed& each) { return !each.timer.is_armed(); });
  const auto delay = std::uniform_int_distribution<std::int64_t>(0, longest.count())(chance_);
  delayed_.emplace_back(*this, to.number, frame).timer.after(std::chrono::nanoseconds(delay));
}

void Air::deliver(Antenna& to, Frame frame) {
  to.waiting.push_back(stamped(frame, wall_now_of(to.machine)));
  if (to.waiting.size() == 1) flush(to);
}

void Air::flush(Antenna& to) {
  while (!to.waiting.empty()) {
    const std::vector<std::uint8_t>& frame = to.waiting.front();
    if (::send(to.socket.fd(), frame.data(), frame.size(), MSG_NOSIGNAL | MSG_DONTWAIT) >= 0) {
      ++frames_heard_;
      ++to.frames.heard;
      to.different.insert(std::hash<std::string_view>()(
          {reinterpret_cast<const char*>(frame.data()), frame.size() - kStampBytes}));
      to.frames.different = to.different.size();
    } else if (errno == EAGAIN) {
      break;
    }
    to.waiting.pop_front();
  }
  watch(to);
}

}  // namespace swarmtalk::test
