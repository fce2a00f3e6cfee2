// Medium: what joins a lab's robots, and how each robot's daemon is linked to it. One object each
// for `bridge`, `udp` and their like; stateless: all that has to be known later, when another call
// of the tool takes the lab down, is in the State.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "lab/state.hpp"

namespace swarmtalk::lab {

/// Keys of a daemon's [links.wifi], in no order.
using LinkKeys = std::vector<std::pair<std::string, std::variant<std::string, std::int64_t>>>;

class Medium {
 public:
  virtual ~Medium() = default;

  virtual std::string name() const = 0;  // as behind --medium

  /// Why this medium cannot be had here, in one line with what to do; empty: it can.
  virtual std::string problem() const { return {}; }

  /// The medium that is like it, and needs no network namespaces; empty: it needs none itself, or
  /// there is no such.
  virtual std::string without_namespaces() const { return {}; }

  /// Names what make() will make. Comes first, and is written to the disk before make().
  virtual void plan(State& /*state*/) const {}

  /// Makes the medium and what each robot stands on; daemons are started behind it. Processes of
  /// its own go to State::medium_processes, which `down` ends behind the daemons. Throws
  /// std::runtime_error with one line when it cannot; then remove() follows.
  virtual void make(State& /*state*/) const {}

  /// How this robot's daemon is linked to it.
  virtual LinkKeys link_of(const State& state, const Robot& robot) const = 0;

  /// Removes what make() made. Safe on half of it, and on nothing. Its processes have ended.
  virtual void remove(const State& /*state*/) const {}

  /// What has to be started here so that `command` runs as this robot. The caller adds the
  /// environment, and the network namespace where the robot has one.
  virtual std::vector<std::string> as_robot(const State& /*state*/, const Robot& /*robot*/,
                                            const std::vector<std::string>& command) const {
    return command;
  }

  /// The daemons' sockets are not on this machine: commands reach them by as_robot() only.
  virtual bool is_elsewhere() const { return false; }

  /// Brings what the state says of the robots up to date: where they are now.
  virtual void refresh(State& /*state*/) const {}

  /// Frames collide on it, and all who have heard one would send it on in the same instant.
  virtual bool is_air() const { return false; }
};

/// What --medium means here. Where no network namespaces can be had, the one that nobody named and
/// `radio` have a stand-in.
/// @param asked  empty: nobody named one
/// @param why  gets the beginning of a sentence where it is a stand-in
std::string choose_medium(const std::string& asked, std::string& why);

/// Names of all media, for --medium.
std::vector<std::string> medium_names();

/// Throws std::runtime_error when there is none of this name (a state of another release).
const Medium& medium_named(const std::string& name);

}  // namespace swarmtalk::lab
