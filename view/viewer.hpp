// Viewer: one WebSocket's conversation, whatever it speaks (our page's JSON, or the Foxglove
// protocol), without the socket. A Connection owns it, feeds it what came and writes what waits in
// its queue; the Stage calls it ten times a second and for each message. On one thread.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "view/scene/foxglove_scene.hpp"
#include "view/send_queue.hpp"
#include "view/source.hpp"

namespace swarmtalk::view {

/// What all viewers of a turn are shown; made once for all of them.
struct Scene {
  Time now{};                                // of the source: ages are counted to it
  std::uint64_t wall_ns = 0;                 // at that time, since 1970
  std::shared_ptr<const std::string> state;  // JSON
  Pictures pictures{};                       // for who wants them
  std::shared_ptr<const std::string> info;   // JSON; null: not in this turn
};

class Viewer {
 public:
  virtual ~Viewer() = default;

  virtual void begin() = 0;
  virtual void on_text(std::string_view text) = 0;
  virtual void on_binary(std::string_view bytes) = 0;
  virtual void show(const Scene& scene) = 0;
  virtual void on_message(const HeardMessage& message) = 0;
  virtual void on_line(const LogLine& line) = 0;
  /// A recording's time has jumped.
  virtual void on_jump() = 0;
  /// Whether the next scene should have pictures, or else the JSON state.
  virtual bool wants_pictures() const { return false; }

  SendQueue queue;
  std::function<void()> wake = [] {};                           // something waits in the queue
  std::function<void(std::string)> leave = [](std::string) {};  // close it; says why
};

}  // namespace swarmtalk::view
