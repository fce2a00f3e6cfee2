#include "client_lib/sender.hpp"

#include "client_lib/wakeup.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::client {
namespace {

constexpr std::size_t kOutgoingMaxBytes = std::size_t{1} << 20;  // then send() answers kBusy
constexpr std::size_t kAnswersMax = 4096;  // the daemon cuts off who leaves 256 KiB unread
constexpr std::size_t kUnreadMax = 64;  // answers more than the queue is long, until it is looked

}  // namespace

Status Sender::check_publication(const PublisherState& publisher, std::size_t size_bytes,
                                 std::optional<std::uint32_t> ttl) const {
  if (publisher.id == 0) return publisher.status;
  if (connection_.is_lost()) return Status(StatusCode::kDisconnected);
  if (size_bytes > publisher.max_message_bytes) {
    return Status(StatusCode::kTooLong, "the message has " + std::to_string(size_bytes) +
                                            " bytes; " + publisher.key->label +
                                            " carries at most " +
                                            std::to_string(publisher.max_message_bytes));
  }
  if (ttl && *ttl > publisher.max_ttl) {
    return Status(StatusCode::kBadTtl, "a TTL of " + std::to_string(*ttl) + "; " +
                                           publisher.key->label + " carries at most " +
                                           std::to_string(publisher.max_ttl));
  }
  return check_room(publisher);
}

/// Whether another message may be on its way.
Status Sender::check_room(const PublisherState& publisher) const {
  if (connection_.outgoing_bytes() > kOutgoingMaxBytes) {
    return Status(StatusCode::kBusy,
                  "swarmtalkd does not read what this program sends: call run() or process(), and "
                  "send more slowly");
  }
  const Sending& sending = publisher.sending;
  const std::size_t waiting = publisher.in_flight.size();
  if (sending.drop_oldest && sending.queue > 0) {  // the daemon makes room
    if (waiting < kAnswersMax) return Status();
    return Status(StatusCode::kBusy,
                  std::to_string(waiting) +
                      " messages are not confirmed yet: call run() or process(), and send more "
                      "slowly");
  }
  if (waiting <= sending.queue) return Status();
  return Status(StatusCode::kBusy,
                std::to_string(waiting) + (waiting == 1 ? " message is" : " messages are") +
                    " not confirmed yet: call run() or process() between sends, send more slowly, "
                    "or advertise with a longer queue, or one that drops the oldest");
}

/// Whether answers may wait that make room, or that pile up at the daemon. Those of a callback are
/// not read before it can run: they would pile up here.
bool Sender::needs_answers(const PublisherState& publisher) const {
  if (publisher.id == 0 || publisher.sent) return false;
  const Sending& sending = publisher.sending;
  const bool drops = sending.drop_oldest && sending.queue > 0;
  return publisher.in_flight.size() > sending.queue + (drops ? kUnreadMax : 0);
}

bool Sender::is_busy(const PublisherState& publisher) {
  std::unique_lock lock(gate_);
  if (needs_answers(publisher)) {
    lock.unlock();
    hooks_.look_for_answers();
    lock.lock();
  }
  return publisher.id != 0 && check_room(publisher).code() == StatusCode::kBusy;
}

/// Any thread: all that is used here is behind the gate. What only the owner can do, such as
/// waiting for a socket that is full or reading why it has died, it is rung for.
Status Sender::publish(PublisherState& publisher, std::string_view payload,
                       std::optional<std::uint32_t> ttl, bool is_inside) {
  std::unique_lock lock(gate_);
  has_sent_.store(true);
  if (!is_inside && needs_answers(publisher)) {
    lock.unlock();
    hooks_.look_for_answers();
    lock.lock();
  }
  Status status = check_publication(publisher, payload.size(), ttl);
  if (status) status = append_publication(publisher, payload, ttl);
  const bool tells_refusals = status.code() == StatusCode::kBusy && note_refusal(publisher);
  const bool is_silent =
      status.code() != StatusCode::kTooLong && status.code() != StatusCode::kBadTtl;
  if (!is_silent) reports_.add(status);
  bool needs_owner = !is_silent;
  if (status) {
    const bool is_written = connection_.flush().ok();
    needs_owner = !is_written || connection_.has_outgoing();
    if (!is_written) {
      publisher.in_flight.pop_back();
      status = Status(StatusCode::kDisconnected);
    }
  }
  if (tells_refusals) {
    needs_owner = !connection_.flush().ok() || connection_.has_outgoing();
  }
  lock.unlock();
  if (needs_owner && !is_inside) hooks_.wake();
  return status;
}

Status Sender::append_publication(PublisherState& publisher, std::string_view payload,
                                  std::optional<std::uint32_t> ttl) {
  ipc::PublishFrame frame;
  frame.publisher_id = publisher.id;
  frame.publish_number = publisher.publish_number + 1;
  frame.payload = payload;
  frame.ttl = ttl;
  if (publisher.tells_time) {
    const auto now = loop::now().time_since_epoch();
    frame.sent_at_ns = static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
  }
  if (!connection_.append(frame)) {
    return Status(StatusCode::kTooLong, "the message is longer than the local protocol carries");
  }
  publisher.in_flight.push_back(++publisher.publish_number);
  return Status();
}

/// The daemon counts what is refused here. It is told in process(), and at most once a second here,
/// for a program that only sends. @return whether that waits to be written
bool Sender::note_refusal(PublisherState& publisher) {
  ++publisher.untold_refusals;
  const auto now = loop::now();
  const bool is_early =
      publisher.refusals_told_at && now - *publisher.refusals_told_at < std::chrono::seconds(1);
  if (is_early || connection_.outgoing_bytes() > kOutgoingMaxBytes) {
    has_refused_.store(true);
    return false;
  }
  publisher.refusals_told_at = now;
  ipc::Envelope envelope;
  fill_refusals(publisher, *envelope.mutable_client_loss());
  return connection_.append(envelope);
}

void fill_refusals(PublisherState& publisher, ipc::ClientLoss& loss) {
  loss.set_publisher_id(publisher.id);
  loss.set_refused(std::exchange(publisher.untold_refusals, 0));
}

}  // namespace swarmtalk::client
