#include "daemon/session/clients.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <tuple>

#include "daemon/common/logging.hpp"
#include "daemon/host/peer.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::daemon {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kAcceptsPerTurn = 16;
constexpr int kMostListed = 128;            // clients in a status, so that it fits a frame
constexpr std::size_t kRefusedAtOnce = 16;  // refused clients that still read why
constexpr auto kHelloTimeout = std::chrono::seconds(10);
constexpr auto kRefusedTimeout = std::chrono::seconds(2);  // to read why, and hang up
constexpr auto kSilenceWatchPeriod = std::chrono::seconds(1);
constexpr auto kAcceptRetry = std::chrono::seconds(1);

}  // namespace

Clients::Clients(boost::asio::io_context& io, Hub& hub_ref, PoseKeeper& poses_ref,
                 const LimitsConfig& limits_ref, DaemonCounters& counters_ref,
                 StatusSource& status_ref)
    : SessionHost(hub_ref, poses_ref, limits_ref, counters_ref, status_ref),
      io_(io),
      listener_(io),
      accept_timer_(io, [this] { on_acceptable(); }),
      silence_timer_(io, [this] { close_silent(); }),
      flush_(loop::Loop::of(io), [this] { flush_all(); }),
      next_flush_(loop::Loop::of(io), [this] {
        to_flush_.insert(to_flush_.end(), to_flush_next_.begin(), to_flush_next_.end());
        to_flush_next_.clear();
        flush_all();
      }) {}

Clients::~Clients() {
  close_all("swarmtalkd ends");
}

void Clients::listen(int listening) {
  const int duplicate = fcntl(listening, F_DUPFD_CLOEXEC, 0);
  if (duplicate < 0) throw std::runtime_error(std::string("listening: ") + std::strerror(errno));
  boost::system::error_code ignored;
  if (listener_.is_open()) listener_.close(ignored);
  listener_.assign(duplicate);
  wait_acceptable();
}

void Clients::wait_acceptable() {
  listener_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                       [this](const boost::system::error_code& error) {
                         if (!error) on_acceptable();
                       });
}

void Clients::on_acceptable() {
  for (int i = 0; i < kAcceptsPerTurn; ++i) {
    const int descriptor =
        accept4(listener_.native_handle(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (descriptor >= 0) {
      add(descriptor);
      continue;
    }
    if (errno == EAGAIN || errno == EWOULDBLOCK) break;
    if (errno == ECONNABORTED || errno == EINTR) continue;
    if (const auto silent = accept_log_.pass(loop::now())) {
      log_of("client")->error("cannot accept a client: {}; trying again every second",
                              std::strerror(errno));
    }
    return retry_accept_later();
  }
  wait_acceptable();
}

// Out of descriptors or memory: waiting for the socket again would spin.
void Clients::retry_accept_later() {
  accept_timer_.after(kAcceptRetry);
}

void Clients::add(int descriptor) {
  UserShare& user = hub.shares().user(uid_of(descriptor));
  const auto refusal = hub.shares().check_client(user, size());
  if (refusal) {
    ++counters.clients_refused;
    if (const auto silent = refused_log_.pass(loop::now())) {
      log_of("client")->warn("client refused ({}): {} ({} more since the last line)",
                             peer_of(descriptor), refusal->text, *silent);
    }
    if (refused_ >= kRefusedAtOnce) {
      ::close(descriptor);
      return;
    }
  } else {
    ++counters.clients_accepted;
    log_of("client")->debug("client connected ({})", peer_of(descriptor));
  }
  const int bytes = static_cast<int>(limits.socket_buffer_bytes);
  setsockopt(descriptor, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
  auto session = std::make_shared<Session>(io_, descriptor, *this);
  sessions_.emplace(session.get(), session);
  watch_silent();
  if (refusal) {
    ++refused_;
    return session->refuse_connection(*refusal);
  }
  hub.shares().enter(user, session->share());
  session->start();
}

void Clients::close_all(const std::string& reason) {
  boost::system::error_code ignored;
  if (listener_.is_open()) listener_.close(ignored);
  accept_timer_.cancel();
  silence_timer_.cancel();
  while (!sessions_.empty()) {
    const std::shared_ptr<Session> session = sessions_.begin()->second;
    session->close(reason);
  }
  to_flush_.clear();
  to_flush_next_.clear();
}

void Clients::fill(google::protobuf::RepeatedPtrField<ipc::ClientStatus>& statuses) const {
  for (const auto& [session, shared] : sessions_) {
    if (session->has_greeted()) session->fill(*statuses.Add());
  }
  std::sort(statuses.begin(), statuses.end(), [](const auto& a, const auto& b) {
    return std::make_tuple(~a.queued_bytes(), a.pid()) <
           std::make_tuple(~b.queued_bytes(), b.pid());
  });
  while (statuses.size() > kMostListed) statuses.RemoveLast();
}

void Clients::schedule_flush(const std::shared_ptr<Session>& session) {
  to_flush_.push_back(session);
  flush_.at_end();
}

void Clients::schedule_next_flush(const std::shared_ptr<Session>& session) {
  to_flush_next_.push_back(session);
  next_flush_.next_turn();
}

void Clients::flush_all() {
  flushing_.swap(to_flush_);
  for (const auto& session : flushing_) session->flush();
  flushing_.clear();
}

void Clients::on_closed(Session& session, const std::string& reason, bool is_malformed) {
  if (is_malformed) ++counters.clients_malformed;
  if (session.was_ended()) {
    if (const auto silent = closed_log_.pass(loop::now())) {
      log_of("client")->warn("{} closed: {} ({} more since the last line)", session.client().who(),
                             reason, *silent);
    }
  } else {
    log_of("client")->debug("{} closed: {}", session.client().who(), reason);
  }
  if (session.is_refused()) --refused_;
  Shares::leave(session.share());
  sessions_.erase(&session);
}

void Clients::on_not_reading(const Session& session, std::size_t waiting_bytes) {
  if (const auto silent = not_reading_log_.pass(loop::now())) {
    log_of("client")->warn(
        "{} does not read its replies: {} bytes wait, limits.reply_bytes is {}; it is read no "
        "further until it does: let it call run() or process() ({} more since the last line)",
        session.client().who(), waiting_bytes, limits.reply_bytes, *silent);
  }
}

void Clients::watch_silent() {
  if (!silence_timer_.is_armed()) silence_timer_.after(kSilenceWatchPeriod);
}

void Clients::close_silent() {
  const auto now = loop::now();
  std::vector<std::shared_ptr<Session>> silent;
  bool is_any_new = false;
  for (const auto& [session, shared] : sessions_) {
    if (session->has_greeted()) continue;
    const auto limit = session->is_refused() ? kRefusedTimeout : kHelloTimeout;
    if (now - session->connected_at() >= limit)
      silent.push_back(shared);
    else
      is_any_new = true;
  }
  for (const auto& session : silent) {
    if (session->is_refused()) {
      session->close("it was refused and did not hang up within 2 s");
      continue;
    }
    ++counters.clients_silent;
    session->end_stream({ipc::ERROR_MALFORMED, "Hello did not come within 10 s", false});
  }
  if (is_any_new) watch_silent();
}

}  // namespace swarmtalk::daemon
