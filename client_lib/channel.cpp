#include "swarmtalk/client/channel.hpp"

#include <utility>

#include "client_lib/session.hpp"
#include "client_lib/state.hpp"

namespace swarmtalk {
namespace {

template <typename State>
void remove(std::shared_ptr<State>& state) {
  if (!state) return;
  state->is_closed = true;
  if (const auto session = state->session.lock()) session->remove(*state);
  state.reset();
}

template <typename State>
Status handle_status(const std::shared_ptr<State>& state) {
  return state ? state->status : Status(StatusCode::kBadArgument, "this handle was moved from");
}

Status gone() {
  return Status(StatusCode::kDisconnected, "the Client of this handle is gone");
}

}  // namespace

Publisher& Publisher::operator=(Publisher&& other) noexcept {
  if (this != &other) {
    remove(state_);
    state_ = std::move(other.state_);
  }
  return *this;
}

Publisher::~Publisher() {
  remove(state_);
}

Status Publisher::send(std::string_view text, std::optional<std::uint32_t> ttl) {
  if (!state_) return handle_status(state_);
  const auto session = state_->session.lock();
  return session ? session->publish(*state_, text, ttl) : gone();
}

bool Publisher::busy() const {
  return state_ && state_->is_in_flight;
}

std::size_t Publisher::max_message_bytes() const {
  return state_ && state_->id != 0 ? state_->max_message_bytes : 0;
}

std::optional<std::uint16_t> Publisher::channel_number() const {
  return state_ ? state_->channel : std::nullopt;
}

Status Publisher::status() const {
  return handle_status(state_);
}

Subscriber& Subscriber::operator=(Subscriber&& other) noexcept {
  if (this != &other) {
    remove(state_);
    state_ = std::move(other.state_);
  }
  return *this;
}

Subscriber::~Subscriber() {
  remove(state_);
}

std::optional<std::uint16_t> Subscriber::channel_number() const {
  return state_ ? state_->channel : std::nullopt;
}

Status Subscriber::status() const {
  return handle_status(state_);
}

Publisher Channel::publisher(SentCallback sent) const {
  if (const auto session = session_.lock()) {
    return Publisher(session->add_publisher(key_, std::move(sent)));
  }
  auto state = std::make_shared<client::PublisherState>();
  state->status = gone();
  return Publisher(std::move(state));
}

Subscriber Channel::subscriber(ReceiveCallback receive, Policy policy) const {
  if (const auto session = session_.lock()) {
    return Subscriber(session->add_subscriber(key_, std::move(receive), policy));
  }
  auto state = std::make_shared<client::SubscriberState>();
  state->status = gone();
  return Subscriber(std::move(state));
}

}  // namespace swarmtalk
