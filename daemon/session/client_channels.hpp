// ClientChannels: one client's subscriptions and publishers: its requests about them, and its end
// of the hub's ways. On the daemon's thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>

#include "daemon/common/daemon_counters.hpp"
#include "daemon/common/token_bucket.hpp"
#include "daemon/config/config.hpp"
#include "daemon/hub/hub.hpp"
#include "daemon/session/client_answers.hpp"
#include "daemon/session/client_output.hpp"
#include "ipc/message_frames.hpp"

namespace swarmtalk::daemon {

class ClientChannels final : public HubClient {
 public:
  /// All references must outlive it.
  ClientChannels(Hub& hub, const LimitsConfig& limits, DaemonCounters& counters,
                 ClientOutput& output, ClientAnswers& answers);

  /// Removes the client from the hub. Before the destructor.
  void leave();

  // Requests (ipc.proto); each answers for itself, but for publish() and note_loss(), which are
  // answered by what becomes of the message, and not at all.
  void subscribe(const ipc::Subscribe& request);
  void unsubscribe(std::uint32_t id);
  void advertise(const ipc::Advertise& request);
  void unadvertise(std::uint32_t id);
  void publish(const ipc::PublishFrame& request);
  void note_loss(const ipc::ClientLoss& loss);

  void fill(ipc::ClientStatus& status) const;

  void on_message(Subscription& subscription, const MessageRef& message) override;
  void on_sent(Publisher& publisher, std::uint64_t publish_number) override;
  void on_unsent(std::uint32_t publisher_id, std::uint64_t publish_number,
                 const Refusal& refusal) override;
  void on_links_down(const Refusal& why) override;

 private:
  std::optional<Refusal> check_sending(const ipc::Advertise& request) const;
  void note_refused(const Publisher& publisher, std::uint32_t messages);

  Hub& hub_;
  const LimitsConfig& limits_;
  DaemonCounters& counters_;
  ClientOutput& output_;
  ClientAnswers& answers_;
  std::unordered_map<std::uint32_t, std::unique_ptr<QueuedSubscription>> subscriptions_;
  std::unordered_map<std::uint32_t, std::unique_ptr<Publisher>> publishers_;
  TokenBucket publish_bucket_;
  std::uint32_t last_id_ = 0;
  std::uint64_t lost_in_client_ = 0;  // as it says
  std::uint64_t published_ = 0;
  std::uint64_t refused_ = 0;  // messages that were not taken, here or, as it says, there
  bool is_told_down_ = false;  // that no link is up, since one was
};

}  // namespace swarmtalk::daemon
