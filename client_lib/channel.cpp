#include "swarmtalk/client/channel.hpp"

#include <mutex>
#include <optional>
#include <utility>

#include "client_lib/engine.hpp"
#include "client_lib/program_end.hpp"
#include "client_lib/state.hpp"

namespace swarmtalk {
namespace {

template <typename State>
void remove(std::shared_ptr<State>& state) {
  if (!state) return;
  if (const auto session = state->session.lock()) session->remove(*state);
  state.reset();
}

/// A state's session and its gate, held; neither when the session is gone, nor in a child of
/// fork(), where another thread of the parent may hold it for ever.
class StateLock {
 public:
  explicit StateLock(const client::HandleState& state) : session_(state.session.lock()) {
    if (session_) refusal_ = session_->refusal_of_child();
    if (session_ && !refusal_) lock_ = std::unique_lock(session_->gate());
  }
  const std::optional<Status>& refusal() const { return refusal_; }

 private:
  const client::LockingCall locking_;
  std::shared_ptr<client::Engine> session_;
  std::optional<Status> refusal_;
  std::unique_lock<std::mutex> lock_;
};

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
  const auto session = state_ ? state_->session.lock() : nullptr;
  return session && session->is_busy(*state_);
}

std::size_t Publisher::max_message_bytes() const {
  if (!state_) return 0;
  const StateLock lock(*state_);
  return !lock.refusal() && state_->id != 0 ? state_->max_message_bytes : 0;
}

bool Publisher::has_redundancy() const {
  if (!state_) return false;
  const StateLock lock(*state_);
  return !lock.refusal() && state_->id != 0 && state_->has_redundancy;
}

std::optional<std::uint16_t> Publisher::channel_number() const {
  if (!state_) return std::nullopt;
  const StateLock lock(*state_);
  return lock.refusal() ? std::nullopt : state_->channel;
}

Status Publisher::status() const {
  if (!state_) return handle_status(state_);
  const StateLock lock(*state_);
  return lock.refusal() ? *lock.refusal() : state_->status;
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

Publisher Channel::publisher(SentCallback sent, Sending sending) const {
  if (const auto session = session_.lock()) {
    return Publisher(session->add_publisher(key_, std::move(sent), sending));
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
