#include "drivers/socket/socket_link.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/link/link_log.hpp"
#include "loop/chance.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

// The interface's queue is full (ENOBUFS), and the kernel does not say until when.
constexpr auto kFullQueueWait = 1ms;
// In case no change of the interface announces the end of an error.
constexpr auto kBrokenLinkWait = 100ms;
// What a frame says of its sender is worthless after that.
constexpr auto kOldestFrame = 1s;
constexpr auto kErrorLogInterval = 1s;

bool is_link_error(int error) {
  switch (error) {
    case ENETDOWN:
    case ENXIO:
    case ENODEV:
    case ENETUNREACH:
    case EHOSTUNREACH:
    case EADDRNOTAVAIL:
      return true;
    default:
      return false;
  }
}

}  // namespace

SocketLink::SocketLink(boost::asio::io_context& io, frame::ProfileId profile,
                       std::size_t max_packet_bytes, const PacerConfig& pacer,
                       std::size_t network_header_bytes)
    : watch_(io),
      max_packet_bytes_(max_packet_bytes),
      pacer_(pacer, loop::random_bits()),
      builder_(profile, max_packet_bytes),
      receiver_(profile),
      airtime_(network_header_bytes),
      receive_socket_(loop::Loop::of(io), [this](std::uint32_t events) { on_events(events); }),
      send_socket_(loop::Loop::of(io), [this](std::uint32_t) { on_writable(); }),
      flush_(loop::Loop::of(io), [this] { flush(); }),
      timer_(io,
             [this] {
               is_forward_wait_ = false;
               flush();
             }),
      wake_timer_(io, *this),
      beacon_(io,
              [this](MonotonicTime now) {
                const Pacer::Duration ahead = pacer_.ahead(now);
                if (ahead == 0ns) send_frame_without_packets(now);
                return ahead;
              }),
      seal_(io, builder_, receiver_, [this](MonotonicTime now) { return speak(now); }),
      state_(io, [this](bool is_up, const std::string& line) {
        link_log()->log(is_up ? spdlog::level::info : spdlog::level::warn, "{} {}: {}", type(),
                        device(), line);
      }) {}

void SocketLink::use_receive_socket(int socket) {
  receive_socket_.own(socket);
}

void SocketLink::use_send_socket(int socket) {
  send_socket_.own(socket);
}

// What there is now stays in the text: other interfaces that come and go are no news of this link.
void SocketLink::wait_for_interface(const std::string& interface, const std::string& error) {
  const std::string names = InterfaceWatch::names();
  missing_ = error + "; this machine has " + names;
  waiting_ = "down: waiting for interface '" + interface + "'; at the start this machine had " +
             names + kGoneRemedy;
}

void SocketLink::set_gone(const std::string& interface) {
  set_state(false, waiting_.empty() ? "down: interface '" + interface + "' is gone" + kGoneRemedy
                                    : waiting_);
}

void SocketLink::start(LinkUser& user) {
  user_ = &user;
  echoes_.begin(user.frame_header().epoch, loop::now());
  watch_.start([this] { refresh(); });
  refresh();
  receive_socket_.watch(EPOLLIN);
  beacon_.start();
  seal_.use(user_->frame_header().epoch);
  wake();
}

void SocketLink::wake() {
  if (user_ != nullptr && !is_filling_) flush_.at_end();
}

void SocketLink::set_pacing(const PacerConfig& pacing) {
  pacer_ = Pacer(pacing, loop::random_bits());
  pacer_.suit(is_radio(settings().interface));
  timer_.cancel();  // the old pace's wait
  is_forward_wait_ = false;
  wake();
}

// Not when something else is about to leave, or nothing can, nor faster than messages: else these
// would wait for all beacons that were too many.
bool SocketLink::send_frame_without_packets(MonotonicTime now) {
  if (!is_up() || !queue_.is_empty() || user_->next_packet_bytes() > 0) return false;
  if (pacer_.ahead(now) > 0ns) return false;
  const BuiltFrame built = builder_.build_beacon(
      *user_, queue_.slot(builder_.buffer_bytes(frame_limit_bytes_)), frame_limit_bytes_, now);
  if (built.size_bytes == 0) return false;
  ++counters_.beacons_sent;
  if (tap_ != nullptr) tap_->sent(queue_.slot(built.size_bytes));
  queue_.push(built.size_bytes, built.packets, now);
  pacer_.sent(now);
  transmit(now);
  return true;
}

void SocketLink::set_key(std::shared_ptr<const frame::SwarmKey> key) {
  seal_.set_key(std::move(key));
  if (user_ == nullptr) return;  // start() uses it
  seal_.use(user_->frame_header().epoch);
  refresh();  // longest packets may not fit any more
}

// What waits to be sent shows as well that we live.
bool SocketLink::speak(MonotonicTime now) {
  const bool has_left = send_frame_without_packets(now);
  beacon_.silence_begins(now);
  return has_left;
}

Counters SocketLink::counters() const {
  LinkCounters counters = counters_;
  counters.kernel_drops = kernel_drops();
  airtime_.fill(counters);
  return counters.list();
}

void SocketLink::set_limits(std::size_t frame_bytes, std::size_t datagram_bytes) {
  frame_limit_bytes_ = frame_bytes;
  batch_.set_datagram_bytes(datagram_bytes);
}

std::string SocketLink::mtu_remark() const {
  const std::size_t fits = packet_limit_bytes();
  if (fits >= max_packet_bytes_) return {};
  return ", too small: packets of more than " + std::to_string(fits) +
         " bytes are dropped (up to " + std::to_string(max_packet_bytes_) + " occur)";
}

void SocketLink::set_state(bool is_up, const std::string& text) {
  if (!is_up) watch_.look_later();
  if (!state_.set(is_up, text)) return;
  if (is_up) {
    waiting_.clear();
    pacer_.suit(is_radio(settings().interface));
  }
  if (!is_up) ++counters_.link_down_events;
  if (user_ != nullptr) user_->on_link_state();
  if (is_up) wake();
}

void SocketLink::on_events(std::uint32_t events) {
  if (is_waiting_writable_ && send_socket_.fd() < 0 && (events & (EPOLLOUT | EPOLLERR)) != 0) {
    on_writable();
  }
  if ((events & ~std::uint32_t{EPOLLOUT}) != 0) receive();
}

void SocketLink::receive() {
  const int count = batch_.read(receive_socket_.fd());
  if (count < 0) {
    if (is_link_error(errno)) refresh();
    return;
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) receive(batch_[i]);
  seal_.arm();
  if (!unreadable_.has_news(counters_)) return;
  for (const std::string& line : unreadable_.news(counters_, loop::now())) {
    link_log()->warn("{} {}: {}", type(), device(), line);
  }
}

void SocketLink::receive(const Datagram& datagram) {
  kernel_drops_ += datagram.drops - static_cast<std::uint32_t>(kernel_drops_);  // theirs wraps
  if (is_of_another_vlan(datagram)) {
    ++counters_.frames_tagged;
    return;
  }
  if (tap_ != nullptr) tap_->before_received();
  const std::optional<std::span<const std::uint8_t>> bytes = air_frame(datagram);
  if (bytes) {
    const std::uint64_t hardware = hardware_of(datagram);
    receiver_.receive(*bytes,
                      {datagram.received_at, kernel_drops_, datagram.is_time_known, hardware,
                       hardware != 0 && hardware == own_hardware_},
                      *user_, counters_);
  } else {
    ++counters_.own_echoes;
  }
  if (tap_ == nullptr) return;
  tap_->received(datagram.bytes, std::min(medium_header_bytes(), datagram.bytes.size()));
}

// Something of our own has come: it does not wait as others' packets do.
bool SocketLink::ends_forward_wait() {
  if (!is_forward_wait_ || user_->has_forwards_only()) return false;
  timer_.cancel();
  is_forward_wait_ = false;
  return true;
}

void SocketLink::flush() {
  if (!is_up() || is_waiting_writable_ || (timer_.is_armed() && !ends_forward_wait())) return;
  const MonotonicTime now = loop::now();
  counters_.send_errors += queue_.drop_built_before(now - kOldestFrame);
  if (!queue_.is_empty()) transmit(now);  // nothing more is built before the kernel has these
  if (!queue_.is_empty()) return;
  is_filling_ = true;
  const bool more_waits = fill_queue(now);
  is_filling_ = false;
  transmit(now);
  if (more_waits) flush_.next_turn();  // after what else is ready
}

bool SocketLink::fill_queue(MonotonicTime now) {
  for (std::size_t i = 0; i < frames_at_once_ && !queue_.is_full(); ++i) {
    const bool is_forward = pacer_.tells_forwards() && user_->has_forwards_only();
    const Pacer::Duration wait = pacer_.wait(now, is_forward);
    if (wait > 0ns) {
      flush_after(wait);
      is_forward_wait_ = is_forward;
      return false;
    }
    const BuiltFrame built =
        builder_.build(*user_, queue_.slot(builder_.buffer_bytes(frame_limit_bytes_)),
                       frame_limit_bytes_, counters_, now);
    if (built.size_bytes == 0) return built.more_waits;
    if (tap_ != nullptr) tap_->sent(queue_.slot(built.size_bytes));
    queue_.push(built.size_bytes, built.packets, now);
    pacer_.sent(now);
    beacon_.silence_begins(now);
    if (!built.more_waits) return false;
  }
  return true;
}

void SocketLink::transmit(MonotonicTime now) {
  const int socket = send_socket_.fd() >= 0 ? send_socket_.fd() : receive_socket_.fd();
  while (const int error = queue_.send(socket, counters_)) {
    if (error == EAGAIN || error == EWOULDBLOCK) {
      ++counters_.send_retries;
      return wait_writable();
    }
    if (error == ENOBUFS) {
      frames_at_once_ = 1;  // whatever else is built might be given up after it was told as sent
      ++counters_.send_retries;
      return flush_after(kFullQueueWait);
    }
    if (is_link_error(error)) {
      ++counters_.send_retries;
      refresh();
      return flush_after(kBrokenLinkWait);
    }
    on_send_error(error, now);
  }
  frames_at_once_ = std::min(2 * frames_at_once_, TransmitQueue::kFrames);
}

void SocketLink::on_send_error(int error, MonotonicTime now) {
  ++counters_.send_errors;
  if (error == EMSGSIZE) {  // the MTU shrank after the frame was built
    counters_.packets_over_mtu += queue_.first_packets();
    refresh();
  }
  queue_.drop_first();
  if (now - last_error_log_ < kErrorLogInterval) return;
  last_error_log_ = now;
  link_log()->warn("{} {}: a frame could not be sent: {} ({} so far)", type(), device(),
                   std::strerror(error), counters_.send_errors);
}

void SocketLink::wait_writable() {
  if (std::exchange(is_waiting_writable_, true)) return;
  if (send_socket_.fd() >= 0) return send_socket_.watch(EPOLLOUT);
  receive_socket_.watch(EPOLLIN | EPOLLOUT);
}

void SocketLink::on_writable() {
  is_waiting_writable_ = false;
  if (send_socket_.fd() >= 0) {
    send_socket_.watch(0);
  } else {
    receive_socket_.watch(EPOLLIN);
  }
  flush();
}

void SocketLink::flush_after(std::chrono::steady_clock::duration delay) {
  if (!timer_.is_armed()) timer_.after(delay);
}

}  // namespace swarmtalk::drivers
