// Session's life and its input side.
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "daemon/session/session.hpp"
#include "ipc/message_frames.hpp"
#include "ipc/stream.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::size_t kReadBytes = 16 * 1024;
constexpr int kReadsPerTurn = 8;       // then the other sessions have their turn
constexpr int kRequestsPerTurn = 256;  // messages, of which a request counts as several

constexpr const char* kNoFrame =
    "these bytes are not a frame of the local protocol: each is a u32 little-endian length, at "
    "most 65536, and one Envelope";

}  // namespace

Session::Session(boost::asio::io_context& io, int descriptor, SessionHost& host)
    : host_(host),
      loop_(loop::Loop::of(io)),
      socket_(loop_, [this](std::uint32_t events) { on_events(events); }),
      reading_(loop_, [this] { read_turn(); }),
      output_(host.limits, host.counters, [this] { on_output(); }),
      answers_(host.forms, output_, host.counters),
      channels_(host.hub, host.limits, host.counters, output_, answers_),
      operations_(host.operations, host.kilobots, host.limits, client_, output_, answers_),
      requests_(host.status, host.poses, host.hub.shares(), host.counters, client_, answers_,
                channels_, operations_),
      connected_at_(loop::now()) {
  socket_.own(descriptor);
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return;
  client_.pid = static_cast<std::uint32_t>(peer.pid);
  client_.uid = peer.uid;
}

void Session::start() {
  watch();
}

void Session::close(const std::string& reason, bool is_malformed) {
  if (std::exchange(is_closed_, true)) return;
  loop_.keep(shared_from_this());  // we are inside one of our own functions
  output_.close();
  operations_.leave();
  channels_.leave();
  socket_.close();
  host_.on_closed(*this, reason, is_malformed);
}

void Session::watch() {
  if (is_closed_) return;
  std::uint32_t events = is_waiting_writable_ ? std::uint32_t{EPOLLOUT} : 0;
  if ((!is_input_closed_ && !is_paused_) || is_discarding_) events |= EPOLLIN;
  socket_.watch(events);
}

// Whoever leaves its replies unread may ask no more: only its own socket fills.
void Session::pause() {
  is_paused_ = true;
  watch();
  if (is_waiting_writable_) note_not_reading();
}

void Session::note_not_reading() {
  if (std::exchange(was_not_reading_, true)) return;
  ++host_.counters.clients_not_reading;
  host_.on_not_reading(*this, output_.answer_bytes());
}

void Session::go_on() {
  is_paused_ = false;
  watch();
  if (!reading_.is_due()) reading_.next_turn();
}

void Session::on_events(std::uint32_t events) {
  constexpr std::uint32_t kEnd = EPOLLHUP | EPOLLERR;
  if (is_waiting_writable_ && (events & (EPOLLOUT | kEnd)) != 0) {
    is_waiting_writable_ = false;
    watch();
    flush();
  }
  if (is_closed_ || (events & (EPOLLIN | kEnd)) == 0) return;
  if (is_discarding_) return discard_input();
  if (is_paused_ && (events & kEnd) != 0) return read_last_words(kHungUp);  // it never will
  if (!is_input_closed_ && !is_paused_ && !reading_.is_due()) read_turn();
}

void Session::read_turn() {
  if (is_closed_ || is_input_closed_ || is_paused_) return;
  requests_left_ = kRequestsPerTurn;
  parse_all();  // what the last turn left
  bool has_read_all = false;
  for (int i = 0; i < kReadsPerTurn && may_handle() && !is_closed_; ++i) {
    const Read read = read_once();
    has_read_all = read == Read::kNothing;
    if (read != Read::kAllRoom) break;
  }
  if (is_closed_) return;
  if (!last_words_.empty() && !is_input_closed_) {
    return has_read_all ? close(last_words_) : reading_.next_turn();
  }
  if (output_.is_full() && !is_input_closed_) return pause();
  watch();
  // After the others that have something to do. Whether the socket has more, it says itself.
  if (!is_input_closed_ && requests_left_ <= 0) reading_.next_turn();
}

Session::Read Session::read_once() {
  const std::span<std::uint8_t> room = reader_.prepare(kReadBytes);
  const ssize_t got = ipc::read_stream(socket_.fd(), room);
  if (got == 0) {
    write_last_answers();
    close(kHungUp);
    return Read::kNothing;
  }
  if (got < 0) {
    if (errno != EAGAIN) close(std::strerror(errno));
    return Read::kNothing;
  }
  reader_.commit(static_cast<std::size_t>(got));
  operations_.forget_reload();  // whoever asks from now on may have changed the file since
  parse_all();
  return static_cast<std::size_t>(got) == room.size() ? Read::kAllRoom : Read::kSome;
}

bool Session::may_handle() const {
  return requests_left_ > 0 && !is_input_closed_ && !output_.is_full();
}

void Session::parse_all() {
  while (may_handle() && doom_.empty()) {
    --requests_left_;
    std::string_view envelope;
    const ipc::ReadResult result = reader_.next(envelope);
    if (result == ipc::ReadResult::kNeedMore) return;
    if (result == ipc::ReadResult::kMalformed || !parse(envelope)) {
      return fail_malformed();
    }
  }
}

// Nearly all that comes is messages. @return false: malformed
bool Session::parse(std::string_view envelope) {
  ipc::PublishFrame publication;
  if (has_greeted() && ipc::parse(envelope, publication)) {
    channels_.publish(publication);
    return true;
  }
  if (!ipc::parse(envelope, host_.request)) return false;
  if (const auto end = requests_.handle(host_.request, requests_left_)) end_stream(*end);
  return true;
}

void Session::fail_malformed() {
  answers_.begin(0);
  end_stream({ipc::ERROR_MALFORMED, kNoFrame, true});
}

void Session::end_stream(const StreamEnd& end) {
  is_malformed_ = is_malformed_ || end.is_malformed;
  is_input_closed_ = true;
  closes_when_written_ = true;
  doom_ = end.text;
  if (!last_words_.empty()) return close(doom_, is_malformed_);  // nobody would read it
  watch();
  answers_.refuse({end.code, end.text, std::nullopt});
}

// It can be written nothing any more. What it sent before that counts: a program that publishes and
// ends is not there to hear that it was sent.
void Session::read_last_words(const std::string& reason) {
  if (is_input_closed_) return close(reason);
  last_words_ = reason;
  output_.close();
  is_waiting_writable_ = is_paused_ = false;
  if (!reading_.is_due()) reading_.next_turn();
}

// After the end of our side; Clients closes a client that does not hang up.
void Session::discard_input() {
  std::array<std::uint8_t, 4096> bytes;
  for (int i = 0; i < kReadsPerTurn; ++i) {
    const ssize_t got = ipc::read_stream(socket_.fd(), bytes);
    if (got < 0 && errno == EAGAIN) break;
    if (got <= 0) return close(doom_);
  }
  is_discarding_ = true;
  watch();
}

void Session::refuse_connection(const Refusal& refusal) {
  is_refused_ = true;
  is_input_closed_ = true;
  closes_when_written_ = true;
  doom_ = refusal.text;
  answers_.refuse(refusal);
}

void Session::fill(ipc::ClientStatus& status) const {
  status.set_name(client_.name);
  status.set_pid(client_.pid);
  status.set_uid(client_.uid);
  channels_.fill(status);
  status.set_queued_bytes(output_.waiting_bytes());
  status.set_deliveries_sent(output_.deliveries_sent());
  status.set_lost_daemon(output_.lost());
}

}  // namespace swarmtalk::daemon
