#include "view/stage.hpp"

#include <algorithm>
#include <chrono>

#include "view/foxglove_viewer.hpp"
#include "view/page_viewer.hpp"
#include "view/swarm_json.hpp"

namespace swarmtalk::view {
namespace {

constexpr auto kTurn = std::chrono::milliseconds(100);
constexpr unsigned kTurnsBetweenInfos = 10;

}  // namespace

Stage::Stage(boost::asio::io_context& io, Source& source, bool may_operate)
    : source_(source), may_operate_(may_operate), timer_(io) {
  source_.on_message = [this](const HeardMessage& message) {
    for (Viewer* viewer : viewers_) viewer->on_message(message);
  };
  source_.on_line = [this](const LogLine& line) {
    for (Viewer* viewer : viewers_) viewer->on_line(line);
  };
  source_.on_jump = [this] {
    for (Viewer* viewer : viewers_) viewer->on_jump();
  };
}

std::unique_ptr<Viewer> Stage::make_viewer(std::string_view subprotocol) {
  if (subprotocol.starts_with("foxglove.")) return std::make_unique<FoxgloveViewer>(source_);
  return std::make_unique<PageViewer>(source_, may_operate_);
}

void Stage::add(Viewer& viewer) {
  viewers_.insert(&viewer);
  source_.set_watched(true);
  turns_ = 0;  // a newcomer is shown everything in the next turn
  if (!is_waiting_) wait_turn();
}

void Stage::remove(Viewer& viewer) {
  viewers_.erase(&viewer);
  if (viewers_.empty()) source_.set_watched(false);
}

// Nobody looks: nothing is made.
void Stage::wait_turn() {
  is_waiting_ = !viewers_.empty();
  if (!is_waiting_) return;
  timer_.expires_after(kTurn);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (error) return;
    turn();
    wait_turn();
  });
}

void Stage::turn() {
  Scene scene;
  scene.now = source_.now();
  scene.wall_ns = source_.wall_ns();
  scene.state = std::make_shared<const std::string>(state_json(source_));
  if (turns_++ % kTurnsBetweenInfos == 0) {
    scene.info = std::make_shared<const std::string>(info_json(source_));
  }
  const auto wants = [](const Viewer* viewer) { return viewer->wants_pictures(); };
  if (std::any_of(viewers_.begin(), viewers_.end(), wants)) {
    scene.pictures = draw(source_.swarm(), scene.now, scene.wall_ns);
  }
  for (Viewer* viewer : viewers_) {
    viewer->show(scene);
    viewer->wake();
  }
}

}  // namespace swarmtalk::view
