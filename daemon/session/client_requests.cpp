#include "daemon/session/client_requests.hpp"

#include <algorithm>
#include <chrono>

#include "daemon/common/printable.hpp"
#include "ipc/framing.hpp"
#include "ipc/message_frames.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr int kStatusCost = 32;        // as many cheap requests take as long
constexpr int kLeastCostInATurn = 16;  // a request, in messages: others wait for it
constexpr int kReloadCost = 1000;      // the others' turn comes before the next

// A request of a newer minor looks like no request at all, but for fields that we do not know: in
// an Envelope without a submessage, whatever is not its id.
bool has_unknown_fields(const ipc::Envelope& request) {
  ipc::Envelope known;
  if (request.has_request_id()) known.set_request_id(request.request_id());
  return request.ByteSizeLong() > known.ByteSizeLong();
}

int cost_of(const ipc::Envelope& request) {
  if (request.has_reload() || request.has_check_configuration()) return kReloadCost;
  const bool is_report =
      request.has_get_status() || request.has_get_neighbours() || request.has_get_metrics();
  return is_report ? kStatusCost : 1;
}

bool is_change(const ipc::Envelope& request) {
  return request.has_reload() || request.has_check_configuration() || request.has_set_node_id() ||
         request.has_capture() ||
         (request.has_set_log_level() && request.set_log_level().has_level());
}

std::string version_text(std::uint32_t major, std::uint32_t minor) {
  return std::to_string(major) + "." + std::to_string(minor);
}

}  // namespace

std::optional<StreamEnd> ClientRequests::handle(const ipc::Envelope& request, int& requests_left) {
  answers_.begin(request.request_id());
  const int bodies = ipc::count_bodies(request);
  if (bodies > 1 || (bodies == 0 && !has_unknown_fields(request))) {
    return StreamEnd{ipc::ERROR_MALFORMED,
                     "a frame has exactly one submessage, this one has " + std::to_string(bodies),
                     true};
  }
  if (request.has_hello()) return greet(request.hello());
  if (!has_greeted_) {
    return StreamEnd{ipc::ERROR_MALFORMED, "the first frame must be Hello", true};
  }
  const bool is_repeated = request.has_reload() && operations_.has_reloaded();
  const int cost = is_repeated ? 1 : cost_of(request);
  const bool is_free = request.has_publish() || request.has_client_loss();  // they have own limits
  requests_left -= is_free ? cost : std::max(cost, kLeastCostInATurn);
  if (!is_free) {
    if (const auto refusal = check_rate(request, std::min(cost, kStatusCost))) {
      answers_.refuse(*refusal);
      return std::nullopt;
    }
  }
  answer(request);
  return std::nullopt;
}

// A reload that came before the last one began is answered by that, and takes no turn.
std::optional<Refusal> ClientRequests::check_rate(const ipc::Envelope& request, int cost) {
  auto refusal = shares_.take_request(channels_.share, static_cast<std::uint32_t>(cost));
  const bool is_repeated = request.has_reload() && operations_.has_reloaded();
  if (!refusal && is_change(request) && !is_repeated)
    refusal = shares_.take_change(channels_.share);
  if (refusal) ++counters_.requests_too_fast;
  return refusal;
}

void ClientRequests::answer(const ipc::Envelope& request) {
  if (request.has_publish()) {
    channels_.publish(ipc::frame_of(request.publish()));
  } else if (request.has_client_loss()) {
    channels_.note_loss(request.client_loss());
  } else if (request.has_set_pose()) {
    set_pose(request.set_pose());
  } else if (request.has_subscribe()) {
    channels_.subscribe(request.subscribe());
  } else if (request.has_unsubscribe()) {
    channels_.unsubscribe(request.unsubscribe().subscription_id());
  } else if (request.has_advertise()) {
    channels_.advertise(request.advertise());
  } else if (request.has_unadvertise()) {
    channels_.unadvertise(request.unadvertise().publisher_id());
  } else if (request.has_get_pose()) {
    get_pose();
  } else if (request.has_get_status()) {
    status_.fill_status(*answers_.make().mutable_status());
    answers_.send();
  } else if (request.has_get_neighbours()) {
    status_.fill_neighbours(*answers_.make().mutable_neighbours());
    answers_.send();
  } else if (request.has_kilobot_command()) {
    operations_.begin_kilobot(request.kilobot_command());
  } else if (request.has_kilobot_cancel()) {
    operations_.cancel_kilobot(request.kilobot_cancel().operation_id());
  } else if (!operations_.operate(request)) {
    answers_.refuse(
        {ipc::ERROR_UNSUPPORTED, "this daemon does not know this request", std::nullopt});
  }
}

std::optional<StreamEnd> ClientRequests::greet(const ipc::Hello& hello) {
  if (hello.major() != ipc::kProtocolMajor) {
    ++counters_.clients_other_version;
    return StreamEnd{ipc::ERROR_VERSION,
                     "the client speaks protocol " + version_text(hello.major(), hello.minor()) +
                         ", this daemon " + version_text(ipc::kProtocolMajor, ipc::kProtocolMinor) +
                         "; install client and daemon of one release",
                     false};
  }
  has_greeted_ = true;
  client_.name = printable(hello.name());
  status_.fill_hello(*answers_.make().mutable_hello());
  answers_.send();
  return std::nullopt;
}

void ClientRequests::set_pose(const ipc::SetPose& request) {
  std::optional<PoseKeeper::Time> known_at = loop::now();
  if (request.fixed()) known_at.reset();
  if (!poses_.set(request.x_m(), request.y_m(), request.theta_rad(), known_at, client_.name)) {
    return answers_.refuse(
        {ipc::ERROR_BAD_POSE,
         "a pose is x and y in metres, -32.767 to 32.767, and a finite angle in radians",
         std::nullopt});
  }
  answers_.send_done();
}

void ClientRequests::get_pose() {
  fill_own_pose(poses_, *answers_.make().mutable_pose());
  answers_.send();
}

void fill_own_pose(const PoseKeeper& poses, ipc::Pose& reply) {
  const auto now = loop::now();
  if (poses.max_age_ms() != 0) reply.set_max_age_ms(poses.max_age_ms());
  const auto age_ms = poses.age_ms(now);
  if (!age_ms) return;
  reply.set_age_ms(*age_ms);
  reply.set_told_by(poses.told_by());
  if (const auto pose = poses.valid(now)) {
    reply.set_x_m(static_cast<float>(pose->x_m));
    reply.set_y_m(static_cast<float>(pose->y_m));
    reply.set_theta_rad(static_cast<float>(pose->theta_rad));
  }
}

}  // namespace swarmtalk::daemon
