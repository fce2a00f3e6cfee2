// The air of a virtual swarm: each frame of a robot reaches at once all that are near enough. A
// link is the product's SocketLink; its medium is one end of a socket pair, whose other end is
// here.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <random>

#include "daemon/config/config.hpp"
#include "drivers/link/link.hpp"
#include "loop/loop.hpp"
#include "tests/virtual/course.hpp"

namespace swarmtalk::test {

struct Place {
  double x_m = 0;
  double y_m = 0;
};

class Air {
 public:
  /// @param course  each frame, with its time
  Air(boost::asio::io_context& io, std::uint64_t seed, Course& course)
      : io_(io), course_(course), chance_(static_cast<std::mt19937::result_type>(seed)) {}
  ~Air();

  void put(int robot, Place place) { places_[robot] = place; }
  void set_range(double range_m) { range_m_ = range_m; }
  /// Share of the frames that each receiver misses, drawn for each.
  void set_loss(double share) { loss_ = share; }

  /// As daemon::open_link(), for a link of this robot.
  std::unique_ptr<drivers::Link> open(int robot, const daemon::LinkConfig& config,
                                      frame::ProfileId profile, std::size_t max_packet_bytes);

  std::uint64_t frames_sent() const { return frames_sent_; }
  /// Deliveries of a frame to a robot.
  std::uint64_t frames_heard() const { return frames_heard_; }

 private:
  struct Antenna;

  void hear(Antenna& from);
  bool reaches(const Antenna& from, const Antenna& to);

  boost::asio::io_context& io_;
  Course& course_;
  std::mt19937 chance_;
  std::map<int, Place> places_;
  std::map<std::uint64_t, std::unique_ptr<Antenna>> antennas_;  // by their links' addresses
  std::uint64_t next_address_ = 0x020000000001;
  double range_m_ = 1e9;
  double loss_ = 0;
  std::uint64_t frames_sent_ = 0;
  std::uint64_t frames_heard_ = 0;
};

}  // namespace swarmtalk::test
