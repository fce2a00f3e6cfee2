// GhostDoor: where simulated robots come onto the air of a radio that runs (swarmtalk-sim --join).
// A Unix socket (SOCK_SEQPACKET); each connection is one ghost, and becomes a Port of the medium.
//
// A packet that begins with '{' is a place, {"x_m": 1.5, "y_m": 0}: the first one puts the ghost on
// the air and is answered by {"robot": 6, "header_bytes": 14}, how many bytes of Ethernet header
// frames have here; later ones move it. All other packets, both ways, are frames.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "lab/radio/port.hpp"

namespace swarmtalk::lab::radio {

/// At most so many ghosts at once; others are turned away.
inline constexpr std::size_t kMostGhosts = 400;

/// Where the door of the medium with this control socket is.
std::string ghost_door_of(const std::string& control_path);

struct GhostPlace {
  double x_m = 0;
  double y_m = 0;
};

/// @return none: not a place within 100 km
std::optional<GhostPlace> read_ghost_place(std::string_view packet);

class GhostPort final : public Port {
 public:
  /// @param fd  of a connection, not waiting; owned from here on
  explicit GhostPort(int fd) : fd_(fd) {}
  ~GhostPort() override;
  GhostPort(const GhostPort&) = delete;
  GhostPort& operator=(const GhostPort&) = delete;

  int descriptor() const override { return fd_; }
  std::size_t read(std::span<std::uint8_t> buffer) override;
  bool write(std::span<const std::uint8_t> frame) override;
  std::uint64_t dropped_frames() const override { return 0; }  // it waits, or is told
  bool is_gone() const override { return is_gone_; }

 private:
  int fd_;
  bool is_gone_ = false;
};

class GhostDoor {
 public:
  /// @throws std::runtime_error  one line: it cannot listen there
  explicit GhostDoor(const std::string& path);
  ~GhostDoor();
  GhostDoor(const GhostDoor&) = delete;
  GhostDoor& operator=(const GhostDoor&) = delete;

  /// Readable while somebody waits.
  int descriptor() const { return listening_; }

  /// The next who has come; null: nobody waits.
  std::unique_ptr<GhostPort> accept();

 private:
  std::string path_;
  int listening_ = -1;
};

}  // namespace swarmtalk::lab::radio
