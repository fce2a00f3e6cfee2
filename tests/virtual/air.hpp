// The air of a virtual swarm: each frame of a robot reaches at once all that are near enough and
// have a link there. A link is the product's SocketLink; its medium is one end of a socket pair,
// whose other end is here.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <span>
#include <utility>

#include "daemon/config/config.hpp"
#include "drivers/link/link.hpp"
#include "tests/virtual/course.hpp"

namespace swarmtalk::test {

struct Place {
  double x_m = 0;
  double y_m = 0;
};

using Places = std::map<int, Place>;  // of the robots, by their numbers

class Air {
 public:
  /// @param number  from 0: of this air in its swarm
  /// @param seed    of what is lost here
  /// @param course  each frame, with its time
  /// @param places  where the robots are, on all airs
  Air(boost::asio::io_context& io, std::uint64_t number, std::uint64_t seed, Course& course,
      Places& places);
  ~Air();

  void put(int robot, Place place) { places_[robot] = place; }
  void set_range(double range_m) { range_m_ = range_m; }
  /// Share of the frames that each receiver misses, drawn for each.
  void set_loss(double share) { loss_ = share; }
  /// Share of the frames that each receiver hears twice, the second time up to `longest` later.
  void set_duplicates(double share, std::chrono::nanoseconds longest = {}) {
    duplicates_ = share;
    longest_duplicate_ = longest;
  }
  /// Share of the frames that come to a receiver up to `longest` later, others before them.
  void set_delays(double share, std::chrono::nanoseconds longest) {
    delays_ = share;
    longest_delay_ = longest;
  }
  /// Whether this robot's link is up.
  void set_link(int robot, bool is_up);
  /// Whether the medium takes frames of this robot. While not they wait with it.
  void set_busy(int robot, bool is_busy);
  /// With which errno the kernel refuses this robot's frames; 0: it takes them.
  void set_refusing(int robot, int error);

  /// As daemon::open_link(), for a link of this robot.
  std::unique_ptr<drivers::Link> open(boost::asio::io_context& io, int robot,
                                      const daemon::LinkConfig& config, frame::ProfileId profile,
                                      std::size_t max_packet_bytes);

  std::uint64_t frames_sent() const { return frames_sent_; }
  /// Deliveries of a frame to a robot.
  std::uint64_t frames_heard() const { return frames_heard_; }

  struct Plug;

  struct Frames {
    std::uint64_t sent = 0;
    std::uint64_t heard = 0;
    std::uint64_t different = 0;  // of those, without copies
    std::uint64_t lost = 0;       // on the way to this robot
    std::uint64_t twice = 0;
    std::uint64_t delayed = 0;
  };
  /// Of this robot, since its daemon's start.
  Frames frames_of(int robot) const;

  /// Robots whose packets had one epoch in two starts: 16 bits of chance, so one start in 65,536.
  const std::set<int>& same_after_restart() const { return same_after_restart_; }

 private:
  struct Antenna;
  struct Delayed;
  using Frame = std::span<const std::uint8_t>;

  void hear(Antenna& from);
  bool reaches(const Antenna& from, const Antenna& to);
  bool draw(double share) {
    return share > 0 && std::uniform_real_distribution<>()(chance_) < share;
  }
  void carry(Antenna& to, Frame frame);
  void deliver(Antenna& to, Frame frame);
  void deliver_within(Antenna& to, Frame frame, std::chrono::nanoseconds longest);
  void flush(Antenna& to);
  void watch(Antenna& antenna);

  boost::asio::io_context& io_;
  Course& course_;
  std::mt19937 chance_;
  Places& places_;
  std::uint64_t first_address_;
  std::map<std::uint64_t, std::unique_ptr<Antenna>> antennas_;  // in the order of their coming
  std::uint64_t next_antenna_ = 0;
  double range_m_ = 1e9;
  double loss_ = 0;
  double duplicates_ = 0;
  std::chrono::nanoseconds longest_duplicate_{};
  double delays_ = 0;
  std::chrono::nanoseconds longest_delay_{};
  std::set<int> down_;
  std::set<int> busy_;
  std::map<int, int> refusing_;  // robots and errno
  std::list<Delayed> delayed_;
  void note_start(Antenna& from, Frame frame);

  std::set<std::pair<int, std::uint16_t>> starts_;  // robots and epochs of their packets
  std::set<int> same_after_restart_;
  std::uint64_t frames_sent_ = 0;
  std::uint64_t frames_heard_ = 0;
};

}  // namespace swarmtalk::test
