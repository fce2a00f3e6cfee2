// Clients: all connected sessions. Accepts them up to the limit, flushes those that have something
// to write when a turn of the event loop ends, and closes those that never say Hello.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <memory>
#include <unordered_map>
#include <vector>

#include "daemon/common/log_limiter.hpp"
#include "daemon/session/session.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::daemon {

class Clients final : public SessionHost {
 public:
  /// All references must outlive this object.
  Clients(boost::asio::io_context& io, Hub& hub, PoseKeeper& poses, const LimitsConfig& limits,
          DaemonCounters& counters, StatusSource& status);
  ~Clients() override;

  /// Begins to accept, on this socket only. @param listening  a listening, non-blocking Unix stream
  /// socket, duplicated
  void listen(int listening);

  /// Takes on one connected, non-blocking socket; owns it.
  void add(int descriptor);

  void close_all(const std::string& reason);

  /// Those that are served.
  std::size_t size() const { return sessions_.size() - refused_; }

  /// One entry for each that is served, those with most to read first; at most 128.
  void fill(google::protobuf::RepeatedPtrField<ipc::ClientStatus>& statuses) const;

  void schedule_flush(const std::shared_ptr<Session>& session) override;
  void schedule_next_flush(const std::shared_ptr<Session>& session) override;
  void on_closed(Session& session, const std::string& reason, bool is_malformed) override;
  void on_not_reading(const Session& session, std::size_t waiting_bytes) override;

 private:
  void wait_acceptable();
  void on_acceptable();
  void retry_accept_later();
  void flush_all();
  void watch_silent();
  void close_silent();

  boost::asio::io_context& io_;
  boost::asio::posix::stream_descriptor listener_;
  loop::Timer accept_timer_;
  loop::Timer silence_timer_;
  loop::Deferred flush_;
  loop::Deferred next_flush_;
  std::unordered_map<Session*, std::shared_ptr<Session>> sessions_;
  std::size_t refused_ = 0;  // of sessions_: those that still read why
  std::vector<std::shared_ptr<Session>> to_flush_;
  std::vector<std::shared_ptr<Session>> to_flush_next_;
  std::vector<std::shared_ptr<Session>> flushing_;
  LogLimiter closed_log_;
  LogLimiter not_reading_log_;
  LogLimiter refused_log_;
  LogLimiter accept_log_;
};

}  // namespace swarmtalk::daemon
