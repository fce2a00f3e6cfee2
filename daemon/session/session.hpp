// Session: the connection of one client. Reads all that waits, has requests answered, and writes
// all that is ready at once. It never waits for its client: what does not fit into the kernel's
// buffer stays in the bounded ClientOutput. Runs on the daemon's one thread; kept alive by its
// SessionHost and by its own handlers.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "daemon/session/client_answers.hpp"
#include "daemon/session/client_channels.hpp"
#include "daemon/session/client_identity.hpp"
#include "daemon/session/client_operations.hpp"
#include "daemon/session/client_output.hpp"
#include "daemon/session/client_requests.hpp"
#include "ipc/framing.hpp"
#include "loop/loop.hpp"

namespace swarmtalk::daemon {

class Session;

/// What all sessions share. Outlives them.
class SessionHost {
 public:
  SessionHost(Hub& hub_, PoseKeeper& poses_, const LimitsConfig& limits_, DaemonCounters& counters_,
              StatusSource& status_)
      : hub(hub_), poses(poses_), limits(limits_), counters(counters_), status(status_) {}
  virtual ~SessionHost() = default;

  /// Calls session.flush() at the end of this turn of the event loop.
  virtual void schedule_flush(const std::shared_ptr<Session>& session) = 0;
  /// The same in the next turn, behind what else is ready.
  virtual void schedule_next_flush(const std::shared_ptr<Session>& session) = 0;
  /// The session is closed; drop it. @param is_malformed  for what it sent
  virtual void on_closed(Session& session, const std::string& reason, bool is_malformed) = 0;
  /// The session's client lets replies pile up, and is read no further until it reads them. Told
  /// once of each session.
  virtual void on_not_reading(const Session& session, std::size_t waiting_bytes) = 0;

  Hub& hub;
  PoseKeeper& poses;
  const LimitsConfig& limits;
  DaemonCounters& counters;
  StatusSource& status;
  // Before any session.
  KilobotControl* kilobots = nullptr;  // none: no link of that type
  Operations* operations = nullptr;    // none: such requests are refused
  // Reused by every session, one at a time: parsing and building allocate nothing.
  ipc::Envelope request;
  AnswerForms forms;
};

constexpr const char* kHungUp = "it closed the connection";

class Session final : public std::enable_shared_from_this<Session> {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// @param descriptor  a connected, non-blocking stream socket; owned from now on
  Session(boost::asio::io_context& io, int descriptor, SessionHost& host);

  void start();
  void flush();
  /// Removes the client from the hub and closes its socket. May be called again.
  void close(const std::string& reason, bool is_malformed = false);
  /// Refuses the connection as a whole: the failure is written, and what the client still sends is
  /// thrown away until it hangs up. Closed at once, the client might meet the end before the
  /// reason.
  void refuse_connection(const Refusal& refusal);
  /// Answers, and closes when the answer is written: a stream cannot be resumed after a bad frame.
  void end_stream(const StreamEnd& end);

  void fill(ipc::ClientStatus& status) const;

  bool is_refused() const { return is_refused_; }
  /// For a mistake of the client's, which has been told why; not one that hung up or was refused.
  bool was_ended() const { return !doom_.empty() && !is_refused_; }
  bool has_greeted() const { return requests_.has_greeted(); }
  Time connected_at() const { return connected_at_; }
  const ClientIdentity& client() const { return client_; }
  ClientShare& share() { return channels_.share; }

 private:
  // session_input.cpp: bytes to envelopes
  void on_events(std::uint32_t events);
  void read_turn();
  void watch();
  void pause();
  void note_not_reading();
  void go_on();
  enum class Read { kNothing, kSome, kAllRoom };  // kAllRoom: more may wait
  Read read_once();
  bool may_handle() const;  // another request, in this turn
  void parse_all();
  bool parse(std::string_view envelope);
  void fail_malformed();
  void discard_input();
  void read_last_words(const std::string& reason);

  // session_output.cpp: what waits to the socket
  void on_output();
  void write_all();
  void write_last_answers();
  void wait_writable();
  bool write_once();  // false: the client's buffer is full, or the session is closed

  SessionHost& host_;
  loop::Loop& loop_;
  loop::Descriptor socket_;
  loop::Deferred reading_;  // goes on
  ClientIdentity client_;
  ipc::FrameReader reader_;
  ClientOutput output_;
  ClientAnswers answers_;
  ClientChannels channels_;
  ClientOperations operations_;
  ClientRequests requests_;
  int requests_left_ = 0;   // in this turn
  std::string doom_;        // not empty: close at the next flush, for this reason
  std::string last_words_;  // not empty: nobody hears us; close when all is read, for this reason
  bool is_malformed_ = false;
  bool is_closed_ = false;
  bool is_refused_ = false;       // as a whole
  bool is_input_closed_ = false;  // no more requests are read
  bool is_discarding_ = false;    // what still comes is thrown away
  bool closes_when_written_ = false;
  bool is_flush_scheduled_ = false;
  bool is_waiting_writable_ = false;
  bool is_paused_ = false;  // its requests are not read until replies have been written
  bool was_not_reading_ = false;
  Time connected_at_;
};

}  // namespace swarmtalk::daemon
