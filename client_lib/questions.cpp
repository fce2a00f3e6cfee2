#include "client_lib/questions.hpp"

#include "client_lib/convert.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::client {

bool Questions::wait(const std::function<bool()>& enough) {
  return hooks_.wait_until(loop::now() + timeout_, enough);
}

/// Sends what requests_.make() was filled with, and waits for its answer.
Status Questions::ask(const std::function<void(const ipc::Envelope&)>& use) {
  bool is_answered = false;
  Status result;
  const auto id = requests_.send([&](const ipc::Envelope* reply, const Status& status) {
    is_answered = true;
    result = status;
    if (reply != nullptr) use(*reply);
  });
  if (wait([&] { return is_answered; })) return result;
  requests_.abandon(id);
  return Status(StatusCode::kTimeout);
}

Status Questions::get_status(DaemonStatus& status) {
  if (Status connection = hooks_.require(); !connection) return connection;
  requests_.make().mutable_get_status();
  return ask([&](const ipc::Envelope& reply) { convert(reply.status(), status); });
}

Status Questions::get_neighbours(std::vector<Neighbour>& neighbours) {
  if (Status connection = hooks_.require(); !connection) return connection;
  requests_.make().mutable_get_neighbours();
  return ask([&](const ipc::Envelope& reply) { convert(reply.neighbours(), neighbours); });
}

Status Questions::get_pose(std::optional<Pose>& pose) {
  pose.reset();
  if (Status connection = hooks_.require(); !connection) return connection;
  requests_.make().mutable_get_pose();
  return ask([&](const ipc::Envelope& reply) { pose = convert(reply.pose()); });
}

Status Questions::sync(const std::function<bool()>& is_idle) {
  if (Status connection = hooks_.require(); !connection) return connection;
  const bool is_done = wait([&] { return requests_.is_empty() && is_idle(); });
  const Status refusal = requests_.take_refusal();
  if (!is_done) return Status(StatusCode::kTimeout);
  return !refusal || hooks_.require() ? refusal : Status(StatusCode::kDisconnected);
}

}  // namespace swarmtalk::client
