// Delivery: hands messages to the subscriptions of a channel, once each, and tells them what was
// lost before: gaps in the numbers of what other robots send. On the daemon's thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "daemon/common/daemon_counters.hpp"
#include "daemon/hub/channel.hpp"
#include "daemon/hub/loss_tracker.hpp"
#include "daemon/message/message.hpp"

namespace swarmtalk::daemon {

class Delivery {
 public:
  /// The counters must outlive it. @param tracked_senders  senders and channels followed for losses
  Delivery(std::size_t tracked_senders, DaemonCounters& counters)
      : counters_(counters), losses_(tracked_senders) {}

  /// One of another robot's messages has come. Its channel's losses are noted, if its numbers tell.
  void note_losses(Channel& channel, std::size_t station, const MessageHead& head);
  /// A beacon has told the last message that a robot has sent.
  void note_last(Channel& channel, std::size_t station, const MessageHead& head);
  /// Nobody subscribes to the channel any more.
  void forget(std::uint16_t channel) { losses_.forget(channel); }

  /// To every subscription that wants it. @param payload  copied
  void deliver(Channel& channel, const MessageHead& head, std::span<const std::uint8_t> payload);
  /// The same for one of this robot's own. @param publisher  the serial of who hears nothing of it
  void deliver_own(Channel& channel, const MessageHead& head, std::span<const std::uint8_t> payload,
                   std::uint64_t publisher);

 private:
  void note_drops(std::size_t station, const DropTotals& drops);
  void add_loss(Channel& channel, const Loss& lost);
  void hand_out(Channel& channel, const MessageRef& message, std::uint64_t except);

  DaemonCounters& counters_;
  MessagePool pool_;
  LossTracker losses_;
  std::vector<DropTotals> station_drops_;  // by station, as of its message before
  DropTotals drops_;                       // their sums
};

}  // namespace swarmtalk::daemon
