#include "swarmtalk/client.hpp"

#include <algorithm>
#include <utility>

#include "client_lib/engine.hpp"
#include "client_lib/program_end.hpp"
#include "client_lib/state.hpp"
#include "loop/clock.hpp"
#include "text/utf8.hpp"

namespace swarmtalk {
namespace {

using Clock = std::chrono::steady_clock;

/// Now and `duration`, without overflow.
Clock::time_point after(std::chrono::nanoseconds duration) {
  const auto now = loop::now();
  return duration > Clock::time_point::max() - now ? Clock::time_point::max() : now + duration;
}

}  // namespace

Client::Client(std::string_view name, ClientOptions options)
    : session_(std::make_shared<client::Engine>(name, options)) {
  client::end_with_program(session_);
}

Client::Client(Client&&) noexcept = default;

Client& Client::operator=(Client&& other) noexcept {
  if (this != &other) {
    if (session_) session_->close();
    session_ = std::move(other.session_);
  }
  return *this;
}

Client::~Client() {
  if (session_) session_->close();
}

Client Client::connected(std::string_view name, ClientOptions options) {
  Client client(name, std::move(options));
  if (Status status = client.connect(); !status) throw Error(std::move(status));
  return client;
}

Status Client::connect() {
  return session_->connect();
}
bool Client::is_connected() const {
  return session_->is_connected();
}

Channel Client::channel(std::string_view name, ChannelOptions options) {
  auto key = std::make_shared<client::ChannelKey>();
  key->name = name;
  key->options = options;
  key->label = "channel " + key->name;
  if (!text::is_utf8(name)) {
    key->problem = Status(StatusCode::kBadChannel, "the name of a channel is not UTF-8 text");
  }
  return Channel(session_, std::move(key));
}

Channel Client::channel(int number, ChannelOptions options) {
  auto key = std::make_shared<client::ChannelKey>();
  key->number = static_cast<std::uint32_t>(number);
  key->options = options;
  key->label = "channel " + std::to_string(number);
  if (number < 0 || number > 65535) {
    key->problem = Status(StatusCode::kBadChannel,
                          "channel numbers go from 0 to 65535, not " + std::to_string(number));
  }
  return Channel(session_, std::move(key));
}

Status Client::set_pose(float x_m, float y_m, float theta_rad) {
  return session_->set_pose({x_m, y_m, theta_rad, false});
}

Status Client::set_fixed_pose(float x_m, float y_m, float theta_rad) {
  return session_->set_pose({x_m, y_m, theta_rad, true});
}

// What the daemon refuses for its rate is counted there.
Status Client::log(std::string_view line) {
  constexpr std::uint32_t kTtl = 4;
  constexpr std::uint32_t kLinesThatWait = 16;
  auto& publisher = session_->log_publisher;
  if (!publisher) {
    ChannelOptions options;
    options.ttl = kTtl;
    publisher =
        channel("debug", options).publisher([](const Status&) {}, Sending::newest(kLinesThatWait));
  }
  return publisher->send(line);
}

Status Client::get_status(DaemonStatus& status) {
  return session_->get_status(status);
}
Status Client::get_neighbours(std::vector<Neighbour>& neighbours) {
  return session_->get_neighbours(neighbours);
}
Status Client::get_pose(std::optional<Pose>& pose) {
  return session_->get_pose(pose);
}
Status Client::sync() {
  return session_->sync();
}
std::uint32_t Client::node_id() const {
  return session_->node_id();
}
std::string Client::daemon_name() const {
  return session_->daemon_name();
}
int Client::fd() const {
  return session_->fd();
}
Status Client::process() {
  return session_->process();
}
Status Client::run() {
  return session_->run_until(Clock::time_point::max());
}

Status Client::run_for(std::chrono::nanoseconds duration) {
  const auto session = session_;  // a callback may destroy this Client
  return session->run_until(after(duration));
}

Status Client::run_once(std::chrono::nanoseconds timeout) {
  const auto session = session_;
  return session->run_once(after(timeout));
}

void Client::stop() {
  session_->stop();
}

void Client::on_disconnect(std::function<void(const Status&)> callback) {
  session_->callbacks().on_disconnect = std::move(callback);
}
void Client::on_reconnect(std::function<void()> callback) {
  session_->callbacks().on_reconnect = std::move(callback);
}
void Client::on_gap(std::function<void(const Message&)> callback) {
  session_->callbacks().on_gap = std::move(callback);
}
void Client::on_error(std::function<void(const Status&)> callback) {
  session_->callbacks().on_error = std::move(callback);
  session_->tell_errors_to_program();
}

}  // namespace swarmtalk
