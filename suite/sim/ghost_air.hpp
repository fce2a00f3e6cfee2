// GhostAir: the air that ghosts (simulated robots among real ones) are on, as a simulator reaches
// it. Frames are air frames, without what a medium puts in front. Never waits; owned by Ghosts.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace swarmtalk::suite {

class GhostAir {
 public:
  using Hear = std::function<void(uint32_t ghost, std::span<const uint8_t> frame)>;

  virtual ~GhostAir() = default;

  /// The next ghost, from 0. @throws std::runtime_error  one line: it is not let in
  virtual void add(double x_mm, double y_mm) = 0;
  virtual void move(uint32_t ghost, double x_mm, double y_mm) = 0;

  /// @return false: it cannot leave
  virtual bool send(uint32_t ghost, std::span<const uint8_t> frame) = 0;

  /// Readable while frames wait.
  virtual int descriptor() const = 0;

  /// Hands on what has come. @throws std::runtime_error  one line: the air is gone
  virtual void receive(const Hear& hear) = 0;
};

/// The radio of a lab, by its control socket (SWARMTALK_MEDIUM): each ghost is a station of it, as
/// each robot is, and the medium decides who hears whom.
std::unique_ptr<GhostAir> join_medium(const std::string& control_socket);

/// A network interface, which all share: all robots there hear each frame of a ghost, and leave
/// what is too far away to their virtual_range_m. Ghosts hear whoever stands within `range_mm`, by
/// the poses in the frames, and those without a pose. Needs CAP_NET_RAW.
std::unique_ptr<GhostAir> join_interface(const std::string& interface, double range_mm);

/// Either, by name: a path is a socket, all else an interface.
/// @throws std::runtime_error  one line: no such, no right
std::unique_ptr<GhostAir> join_air(const std::string& target, double range_mm);

}  // namespace swarmtalk::suite
