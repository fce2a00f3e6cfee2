// Session's life and its input side.
#include <sys/socket.h>

#include <array>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <cstring>

#include "daemon/common/printable.hpp"
#include "daemon/session/session.hpp"
#include "ipc/message_frames.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::size_t kReadBytes = 16 * 1024;
constexpr int kReadsPerTurn = 8;  // then the other sessions have their turn
constexpr int kRequestsPerTurn = 256;

constexpr const char* kNoFrame =
    "these bytes are not a frame of the local protocol: each is a u32 little-endian length, at "
    "most "
    "65536, and one Envelope";
constexpr const char* kNoBell =
    "with a ring all frames go through it, and the socket carries bells (0xB7) only";
constexpr const char* kBrokenRing = "the ring's count of written bytes is impossible";

}  // namespace

Session::Session(boost::asio::io_context& io, int descriptor, SessionHost& host)
    : host_(host),
      socket_(io, descriptor),
      input_(host.rings, client_),
      output_(host.limits, host.counters, [this] { on_output(); }),
      answers_(host.forms, output_, host.counters),
      channels_(host.hub, host.limits, host.counters, output_, answers_),
      operations_(host.operations, host.kilobots, host.limits, client_, output_, answers_),
      requests_(host.status, host.poses, host.limits, host.hub.shares(), host.counters, client_,
                input_, answers_, channels_, operations_),
      connected_at_(std::chrono::steady_clock::now()) {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return;
  client_.pid = static_cast<std::uint32_t>(peer.pid);
  client_.uid = peer.uid;
}

void Session::start() {
  wait_readable();
}

void Session::close(const std::string& reason, bool is_malformed) {
  if (std::exchange(is_closed_, true)) return;
  output_.close();
  operations_.leave();
  channels_.leave();
  boost::system::error_code ignored;
  socket_.close(ignored);
  input_.leave();
  host_.on_closed(*this, reason, is_malformed);
}

void Session::wait_readable() {
  socket_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                     [self = shared_from_this()](const boost::system::error_code& error) {
                       if (!error) self->on_readable();
                     });
}

void Session::on_readable() {
  if (is_closed_) return;
  if (input_.wake(socket_.native_handle()) == ClientInput::Result::kBroken) {
    return fail_malformed(kNoBell);
  }
  read_turn();
}

void Session::read_turn() {
  if (is_closed_ || is_input_closed_) return;
  requests_left_ = kRequestsPerTurn;
  parse_all();  // what the last turn left
  bool has_read = false;
  for (int i = 0; i < kReadsPerTurn && requests_left_ > 0 && !is_input_closed_ && !is_closed_;
       ++i) {
    const Read read = read_once();
    has_read = has_read || read != Read::kNothing;
    if (read != Read::kAllRoom) break;
  }
  if (!is_closed_ && !is_input_closed_) go_on_reading(has_read);
}

// Behind the others that have something to do, if there may be more. A client with a ring writes on
// without waking us until we sleep, so that is done as late as possible: when what has been read is
// on its way and nothing has come meanwhile.
void Session::go_on_reading(bool has_read) {
  const bool may_sleep = requests_left_ > 0 && !(input_.has_ring() && has_read);
  if (may_sleep && input_.sleep()) return wait_readable();
  boost::asio::post(socket_.get_executor(), [self = shared_from_this()] { self->read_turn(); });
}

Session::Read Session::read_once() {
  const std::span<std::uint8_t> room = reader_.prepare(kReadBytes);
  std::size_t got = 0;
  switch (input_.read(socket_.native_handle(), room, got)) {
    case ClientInput::Result::kNothing:
      return Read::kNothing;
    case ClientInput::Result::kEnded:
      close(input_.end_reason());
      return Read::kNothing;
    case ClientInput::Result::kBroken:
      fail_malformed(kBrokenRing);
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
    std::string_view envelope;
    const ipc::ReadResult result = reader_.next(envelope);
    if (result == ipc::ReadResult::kNeedMore) return;
    if (result == ipc::ReadResult::kMalformed || !parse(envelope)) {
      return fail_malformed(kNoFrame);
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
  answers_.refuse({end.code, end.text, std::nullopt});
}

// After the end of our side; Clients closes a client that does not hang up.
void Session::discard_input() {
  std::array<char, 4096> bytes;
  for (int i = 0; i < kReadsPerTurn; ++i) {
    const ssize_t got = recv(socket_.native_handle(), bytes.data(), bytes.size(), 0);
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) break;
    if (got <= 0 && !(got < 0 && errno == EINTR)) return close(doom_);
  }
  socket_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                     [self = shared_from_this()](const boost::system::error_code& error) {
                       if (!error && !self->is_closed_) self->discard_input();
                     });
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
