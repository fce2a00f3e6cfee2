// Session's output side: writes what ClientOutput holds, when the turn of the event loop ends.
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "daemon/common/logging.hpp"
#include "daemon/session/session.hpp"
#include "ipc/pass_descriptor.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr int kWritesPerTurn = 8;  // then the other sessions have their turn

}  // namespace

void Session::on_output() {
  if (doom_.empty() && !output_.problem().empty()) doom_ = output_.problem();
  if (is_flush_scheduled_ || (is_waiting_writable_ && doom_.empty())) return;
  is_flush_scheduled_ = true;
  host_.schedule_flush(shared_from_this());
}

void Session::flush() {
  is_flush_scheduled_ = false;
  if (is_closed_ || !last_words_.empty()) return;
  if (!doom_.empty() && !closes_when_written_) return close(doom_);
  // A client that is to be closed may never read again: it is tried once more, and not waited for.
  if (is_waiting_writable_ && !closes_when_written_) return;
  output_.put_answers_ahead();
  for (int i = 0; i < kWritesPerTurn; ++i) {
    if (output_.unwritten().empty() && !output_.refill()) break;
    if (!write_once()) return;
  }
  if (output_.unwritten().empty() && closes_when_written_) {
    if (!is_refused_) return close(doom_, is_malformed_);
    shutdown(socket_.fd(), SHUT_WR);
    return discard_input();
  }
  if (output_.is_empty()) return;
  is_flush_scheduled_ = true;
  host_.schedule_next_flush(shared_from_this());
}

// The ring's memory goes with the first byte of all, which is that of our hello.
ssize_t Session::write_some() {
  const int descriptor = input_.descriptor_to_pass();
  const std::string_view bytes = output_.unwritten();
  if (descriptor < 0) {
    return send(socket_.fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  const ssize_t sent =
      ipc::send_with_descriptor(socket_.fd(), bytes.data(), bytes.size(), descriptor);
  if (sent > 0) input_.descriptor_is_passed();
  return sent;
}

// The kernel limits the descriptors on their way of all a user's processes together (ETOOMANYREFS):
// clients that keep theirs unread must not lock others out. Our hello, of which nothing is written
// yet, then offers no ring.
void Session::withdraw_ring() {
  log_of("client")->debug("{}: no ring, it cannot be passed: {}", client_.who(),
                          std::strerror(errno));
  input_.withdraw_ring();
  watch();
  const std::string_view frames = output_.unwritten();
  const std::size_t size = ipc::frame_bytes(frames.data());
  ipc::Envelope& hello = answers_.make_notice();
  hello.ParseFromArray(frames.data() + ipc::kLengthBytes,
                       static_cast<int>(size - ipc::kLengthBytes));
  hello.mutable_hello()->clear_features();
  output_.replace_first(hello);
}

bool Session::write_once() {
  const ssize_t sent = write_some();
  if (sent >= 0) {
    output_.advance(static_cast<std::size_t>(sent));
    return true;
  }
  if (errno == EINTR) return true;
  if (input_.descriptor_to_pass() >= 0 && (errno == ETOOMANYREFS || errno == ENOMEM)) {
    withdraw_ring();
    return true;
  }
  if (errno != EAGAIN && errno != EWOULDBLOCK) {
    read_last_words(errno == EPIPE ? kHungUp : std::strerror(errno));
  } else if (closes_when_written_) {
    close(doom_, is_malformed_);  // it does not read what was wrong either
  } else {
    wait_writable();
  }
  return false;
}

void Session::wait_writable() {
  is_waiting_writable_ = true;
  watch();
}

}  // namespace swarmtalk::daemon
