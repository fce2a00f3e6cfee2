// Session: one client. Reads all that waits, answers requests, and queues deliveries; writes all
// that is ready at once, replies ahead of deliveries. It never waits for its client: what does not
// fit into the kernel's buffer stays in bounded queues. Runs on the daemon's one thread; kept alive
// by its SessionHost and by its own handlers.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>

#include "daemon/common/token_bucket.hpp"
#include "daemon/hub/hub.hpp"
#include "daemon/kilobot/kilobot_control.hpp"
#include "daemon/pose/pose_keeper.hpp"
#include "daemon/session/client_input.hpp"
#include "daemon/session/operations.hpp"
#include "daemon/session/subscription_queue.hpp"
#include "ipc/framing.hpp"
#include "ipc/message_frames.hpp"

namespace swarmtalk::daemon {

class Session;

/// What all sessions share. Outlives them.
class SessionHost {
 public:
  SessionHost(Hub& hub_, PoseKeeper& poses_, const LimitsConfig& limits_, DaemonCounters& counters_)
      : hub(hub_), poses(poses_), limits(limits_), counters(counters_) {}
  virtual ~SessionHost() = default;

  /// Calls session.flush() at the end of this turn of the event loop.
  virtual void schedule_flush(const std::shared_ptr<Session>& session) = 0;
  /// The session is closed; drop it. @param is_malformed  for what it sent
  virtual void on_closed(Session& session, const std::string& reason, bool is_malformed) = 0;
  virtual void fill_hello(ipc::Hello& hello) = 0;
  virtual void fill_status(ipc::Status& status) = 0;
  virtual void fill_neighbours(ipc::Neighbours& reply) = 0;

  Hub& hub;
  PoseKeeper& poses;
  const LimitsConfig& limits;
  DaemonCounters& counters;
  KilobotControl* kilobots = nullptr;  // none: no link of that type
  Operations* operations = nullptr;    // none: such requests are refused
  // Reused by every session, one at a time: parsing and building allocate nothing. What nobody
  // asked for has its own: a reply may cause it while that is being made.
  ipc::Envelope request;
  ipc::Envelope reply;
  ipc::Envelope notice;
};

class Session final : public HubClient,
                      public KilobotClient,
                      public CaptureListener,
                      public std::enable_shared_from_this<Session> {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// @param descriptor  a connected, non-blocking stream socket; owned from now on
  Session(boost::asio::io_context& io, int descriptor, SessionHost& host);
  ~Session() override;

  void start();
  void flush();
  /// Removes the client from the hub and closes its socket. May be called again.
  void close(const std::string& reason, bool is_malformed = false);
  /// Refuses the connection as a whole: the failure is written, and what the client still sends is
  /// thrown away until it hangs up. Closed at once, the client might meet the end before the
  /// reason.
  void refuse_connection(const Refusal& refusal);

  void fill(ipc::ClientStatus& status) const;

  bool is_refused() const { return is_refused_; }
  bool has_greeted() const { return has_greeted_; }
  Time connected_at() const { return connected_at_; }
  const std::string& client_name() const { return client_name_; }
  /// "pid 123, uid 1000"
  std::string peer() const {
    return "pid " + std::to_string(pid_) + ", uid " + std::to_string(uid_);
  }

  void on_captured(ipc::Captured& captured) override;
  void on_message(Subscription& subscription, const MessageRef& message) override;
  void on_sent(Publisher& publisher, std::uint64_t publish_number) override;
  void on_unsent(std::uint32_t publisher_id, std::uint64_t publish_number,
                 const Refusal& refusal) override;
  void on_links_down(const Refusal& why) override;
  void on_kilobot_progress(const ipc::KilobotProgress& progress) override;
  void on_kilobot_ended(const ipc::KilobotEnded& ended) override;

 private:
  struct QueuedSubscription : Subscription {
    QueuedSubscription(std::size_t keep_last, bool latest_of_each)
        : queue(keep_last, latest_of_each) {}
    SubscriptionQueue queue;
    std::optional<std::uint32_t> max_age_ms;
    bool is_ready = false;  // listed in ready_
  };

  // session_input.cpp: bytes to envelopes
  void wait_readable();
  void on_readable();
  void read_turn();
  void go_on_reading(bool has_read);
  enum class Read { kNothing, kSome, kAllRoom };  // kAllRoom: more may wait
  Read read_once();
  void parse_all();
  bool parse(std::string_view envelope);
  void fail_malformed(const std::string& text);
  void discard_input();
  void fail_stream(ipc::ErrorCode code, const std::string& text);

  // session_requests.cpp: envelopes to answers
  void handle(const ipc::Envelope& request);
  void greet(const ipc::Hello& hello);
  void subscribe(const ipc::Subscribe& request);
  void unsubscribe(std::uint32_t id);
  std::optional<Refusal> check_sending(const ipc::Advertise& request) const;
  void advertise(const ipc::Advertise& request);
  void unadvertise(std::uint32_t id);
  void note_loss(const ipc::ClientLoss& loss);
  void publish(const ipc::PublishFrame& request);
  void set_pose(const ipc::SetPose& request);
  void get_pose();
  bool operate(const ipc::Envelope& request);  // false: no operator's request
  std::string who() const;                     // for the log
  void refuse(const Refusal& refusal);
  ipc::Envelope& new_reply();  // to the request in hand
  void send_reply() { append_reply(host_.reply); }
  ipc::Envelope& new_notice();  // to no request
  void send_notice() { append_reply(host_.notice); }
  void append_reply(const ipc::Envelope& reply);

  // session_kilobot.cpp
  void begin_kilobot(const ipc::KilobotCommand& command);
  void cancel_kilobot(std::uint32_t operation_id);

  // session_output.cpp: answers and deliveries to bytes
  void wait_writable();
  void fill_output();
  void drop_old(QueuedSubscription& subscription, std::uint64_t now_ns);
  void append_delivery(QueuedSubscription& subscription);
  void put_replies_ahead();
  void forget(QueuedSubscription& subscription);
  bool write_once();  // false: the client's buffer is full, or the session is closed
  ssize_t write_some();
  void withdraw_ring();

  SessionHost& host_;
  boost::asio::posix::stream_descriptor socket_;
  ClientInput input_;
  ipc::FrameReader reader_;
  std::string replies_;  // framed, not yet in output_
  std::string output_;   // framed, being written
  std::size_t written_ = 0;
  std::size_t replies_end_ = 0;  // in output_; behind it are deliveries only
  std::unordered_map<std::uint32_t, std::unique_ptr<QueuedSubscription>> subscriptions_;
  std::unordered_map<std::uint32_t, std::unique_ptr<Publisher>> publishers_;
  std::deque<QueuedSubscription*> ready_;  // with messages queued; served in turn
  std::size_t queued_bytes_ = 0;           // payload in all queues
  TokenBucket publish_bucket_;
  int requests_left_ = 0;  // in this turn
  std::uint64_t deliveries_sent_ = 0;
  std::uint64_t lost_here_ = 0;       // of deliveries, by our queues
  std::uint64_t lost_in_client_ = 0;  // as it says
  std::uint64_t published_ = 0;
  std::uint32_t pid_ = 0;  // 0: not known
  std::uint32_t uid_ = 0;
  std::uint32_t last_id_ = 0;
  std::uint32_t request_id_ = 0;  // of the request in hand
  std::string client_name_;
  bool is_capturing_ = false;
  std::uint32_t missed_frames_ = 0;  // of the capture, since the last one told
  std::string doom_;                 // not empty: close at the next flush, for this reason
  bool is_malformed_ = false;
  bool has_greeted_ = false;
  bool is_closed_ = false;
  bool is_refused_ = false;       // as a whole
  bool is_input_closed_ = false;  // no more requests are read
  bool closes_when_written_ = false;
  bool is_told_down_ = false;  // that no link is up, since one was
  bool is_flush_scheduled_ = false;
  bool is_waiting_writable_ = false;
  Time connected_at_;
};

}  // namespace swarmtalk::daemon
