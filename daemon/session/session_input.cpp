// Session's life and its input side.
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "daemon/common/printable.hpp"
#include "daemon/session/session.hpp"
#include "ipc/message_frames.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::size_t kReadBytes = 16 * 1024;
constexpr int kReadsPerTurn = 8;       // then the other sessions have their turn
constexpr int kRequestsPerTurn = 256;  // messages, of which a request counts as several
constexpr int kLooksAtOneRequest = 3;  // before it is read, at it, after it

constexpr const char* kNoFrame =
    "these bytes are not a frame of the local protocol: each is a u32 little-endian length, at "
    "most 65536, and one Envelope";
constexpr const char* kNoBell =
    "with a ring all frames go through it, and the socket carries bells (0xB7) only";
constexpr const char* kBrokenRing = "the ring's count of written bytes is impossible";

}  // namespace

Session::Session(boost::asio::io_context& io, int descriptor, SessionHost& host)
    : host_(host),
      loop_(loop::Loop::of(io)),
      socket_(loop_, [this](std::uint32_t events) { on_events(events); }),
      reading_(loop_, [this] { read_turn(false); }),
      input_(host.rings, client_),
      output_(host.limits, host.counters, [this] { on_output(); }),
      answers_(host.forms, output_, host.counters),
      channels_(host.hub, host.limits, host.counters, output_, answers_),
      operations_(host.operations, host.kilobots, host.limits, client_, output_, answers_),
      requests_(host.status, host.poses, host.limits, host.hub.shares(), host.counters, client_,
                input_, answers_, channels_, operations_),
      connected_at_(std::chrono::steady_clock::now()) {
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
  input_.leave();
  host_.on_closed(*this, reason, is_malformed);
}

// What comes through a ring is told once, when it begins: bells may stay where they are, unread.
void Session::watch() {
  if (is_closed_) return;
  std::uint32_t events = is_waiting_writable_ ? std::uint32_t{EPOLLOUT} : 0;
  if (!is_input_closed_ || is_discarding_) events |= EPOLLIN;
  if (input_.has_ring() && !is_input_closed_) events |= EPOLLRDHUP | EPOLLET;
  socket_.watch(events);
}

void Session::on_events(std::uint32_t events) {
  constexpr std::uint32_t kEnd = EPOLLRDHUP | EPOLLHUP | EPOLLERR;
  if (is_waiting_writable_ && (events & (EPOLLOUT | kEnd)) != 0) {
    is_waiting_writable_ = false;
    watch();
    flush();
  }
  if (is_closed_ || (events & (EPOLLIN | kEnd)) == 0) return;
  if (is_discarding_) return discard_input();
  if (is_input_closed_) return;
  if (input_.wake(socket_.fd(), (events & kEnd) != 0) == ClientInput::Result::kBroken) {
    return fail_malformed(kNoBell);
  }
  if (input_.has_unheard()) host_.hear_bells_later();
  if (!reading_.is_due()) read_turn(true);
}

void Session::hear_bells() {
  if (is_closed_ || is_input_closed_ || !input_.has_unheard()) return;
  if (input_.wake(socket_.fd(), true) == ClientInput::Result::kBroken) {
    return fail_malformed(kNoBell);
  }
  if (!reading_.is_due()) read_turn(true);
}

void Session::read_turn(bool may_look_again) {
  if (is_closed_ || is_input_closed_) return;
  requests_left_ = kRequestsPerTurn;
  looks_ = 0;
  parse_all();  // what the last turn left
  bool has_read = false;
  bool has_read_all = false;
  for (int i = 0; i < kReadsPerTurn && requests_left_ > 0 && !is_input_closed_ && !is_closed_;
       ++i) {
    const Read read = read_once();
    has_read = has_read || read != Read::kNothing;
    has_read_all = read == Read::kNothing;
    if (read != Read::kAllRoom) break;
  }
  if (is_closed_) return;
  if (!last_words_.empty() && !is_input_closed_) {
    return has_read_all ? close(last_words_) : reading_.next_turn();
  }
  is_streaming_ = is_streaming_ || looks_ > kLooksAtOneRequest;
  watch();
  if (!is_input_closed_) go_on_reading(has_read, may_look_again);
}

// Behind the others that have something to do, if there may be more. A client with a ring writes on
// without waking us until we sleep, so that is done as late as possible: when what has been read is
// on its way and nothing has come meanwhile.
void Session::go_on_reading(bool has_read, bool may_look_again) {
  if (requests_left_ <= 0) return reading_.next_turn();  // some count as many
  if (!input_.has_ring()) return;                        // the socket tells
  if (has_read && may_look_again) return reading_.at_end();
  // One that writes many has the next ready soon, and saves both of us a bell.
  const bool may_sleep = !has_read && !std::exchange(is_streaming_, false);
  if (!may_sleep || !input_.sleep(socket_.fd())) reading_.next_turn();
}

Session::Read Session::read_once() {
  const std::span<std::uint8_t> room = reader_.prepare(kReadBytes);
  std::size_t got = 0;
  switch (input_.read(socket_.fd(), room, got)) {
    case ClientInput::Result::kNothing:
      return Read::kNothing;
    case ClientInput::Result::kEnded:
      close(input_.end_reason());
      return Read::kNothing;
    case ClientInput::Result::kBroken:
      fail_malformed(input_.has_bad_bell() ? kNoBell : kBrokenRing);
      return Read::kNothing;
    case ClientInput::Result::kBytes:
      break;
  }
  reader_.commit(got);
  operations_.forget_reload();  // whoever asks from now on may have changed the file since
  if (input_.take_waiting_writer()) {
    answers_.make_notice().mutable_room();
    answers_.send_notice();
  }
  parse_all();
  return got == room.size() ? Read::kAllRoom : Read::kSome;
}

void Session::parse_all() {
  while (!is_input_closed_ && doom_.empty() && requests_left_ > 0) {
    --requests_left_;
    ++looks_;
    std::string_view envelope;
    const ipc::ReadResult result = reader_.next(envelope);
    if (result == ipc::ReadResult::kNeedMore) return;
    if (result == ipc::ReadResult::kMalformed || !parse(envelope)) {
      return fail_malformed(kNoFrame);
    }
    input_.note_frame();
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

void Session::fail_malformed(const std::string& text) {
  answers_.begin(0);
  end_stream({ipc::ERROR_MALFORMED, text, true});
}

// Answers, and closes when the answer is written: a stream cannot be resumed after a bad frame.
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
  is_waiting_writable_ = false;
  if (!reading_.is_due()) reading_.next_turn();
}

// After the end of our side; Clients closes a client that does not hang up.
void Session::discard_input() {
  std::array<char, 4096> bytes;
  for (int i = 0; i < kReadsPerTurn; ++i) {
    const ssize_t got = recv(socket_.fd(), bytes.data(), bytes.size(), 0);
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) break;
    if (got <= 0 && !(got < 0 && errno == EINTR)) return close(doom_);
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
