// Session's output side: writes what ClientOutput holds, when the turn of the event loop ends.
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "daemon/session/session.hpp"
#include "ipc/stream.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr int kWritesPerTurn = 8;  // then the other sessions have their turn

}  // namespace

void Session::on_output() {
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
  write_all();
  if (!is_paused_ || is_closed_) return;
  if (!output_.is_full()) {
    go_on();
  } else if (is_waiting_writable_) {
    note_not_reading();
  }
}

void Session::write_all() {
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

bool Session::write_once() {
  const std::string_view bytes = output_.unwritten();
  const ssize_t sent = ipc::write_stream(socket_.fd(), bytes);
  if (sent >= 0) {
    output_.advance(static_cast<std::size_t>(sent));
    return true;
  }
  if (errno != EAGAIN) {
    read_last_words(errno == EPIPE ? kHungUp : std::strerror(errno));
  } else if (closes_when_written_) {
    close(doom_, is_malformed_);  // it does not read what was wrong either
  } else {
    wait_writable();
  }
  return false;
}

// Whoever ends only its own side still reads what it asked for; nobody waits for it.
void Session::write_last_answers() {
  output_.put_answers_ahead();
  if (output_.unwritten().empty()) output_.refill();
  const std::string_view bytes = output_.unwritten();
  if (!bytes.empty()) (void)ipc::write_stream(socket_.fd(), bytes);
}

void Session::wait_writable() {
  is_waiting_writable_ = true;
  watch();
}

}  // namespace swarmtalk::daemon
