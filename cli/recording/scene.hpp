// Scene: what a 3D panel draws of a recording: the swarm as this robot's daemon knows it, four
// times a second while robots move, and else once. Reads no clock.
#pragma once

#include <chrono>
#include <cstddef>
#include <string_view>
#include <vector>

#include <swarmtalk/client.hpp>

#include "recording/recorder.hpp"
#include "view/scene/foxglove_scene.hpp"

namespace swarmtalk::cli {

class Scene {
 public:
  using Time = view::Time;
  static constexpr std::chrono::milliseconds kPeriod{250};
  static constexpr std::chrono::milliseconds kStillPeriod{1000};

  /// Our own daemon's answer, and all whom it hears.
  void note(const DaemonStatus& daemon, const std::vector<Neighbour>& neighbours, Time now);
  void note(const std::vector<Neighbour>& neighbours, Time now);
  void note(const Message& message, Time at);
  /// Writes a line of the channel `debug` as a log panel shows it. @return as draw()
  static bool write_log(recording::Recorder& to, const Message& message, Time at);

  /// Writes a picture if it is time for one. @return false after a failure: see problem() of `to`
  bool draw(recording::Recorder& to, Time now);
  /// The same at the end, of what has changed since the last one.
  bool draw_last(recording::Recorder& to, Time now);

 private:
  struct Shown {
    std::uint32_t id;
    float x_m, y_m, theta_rad;
    bool operator==(const Shown&) const = default;
  };
  std::vector<Shown> places() const;
  bool write(recording::Recorder& to, Time now, std::vector<Shown> places);
  /// @param topic  index of view::topics()
  static bool write(recording::Recorder& to, std::size_t topic, std::string_view bytes, Time at);

  view::Swarm swarm_;
  std::vector<Shown> shown_;
  Time drawn_at_{};
};

}  // namespace swarmtalk::cli
