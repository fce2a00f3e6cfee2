// Station: one link and the protocol node that speaks on it, as the hub sees them. What a station
// hands up are whole messages; packets never leave it. NodeStation (node_station.hpp) is the
// implementation; tests bring their own.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/config/profiles.hpp"
#include "daemon/message/loss.hpp"
#include "daemon/message/message.hpp"
#include "daemon/station/neighbours.hpp"
#include "daemon/station/node_identity.hpp"
#include "drivers/link/link.hpp"

namespace swarmtalk::daemon {

class Station;

/// Upper end of a station: the hub. Called while a link pulls or hands up a packet.
class StationUser {
 public:
  virtual ~StationUser() = default;

  /// `payload` is valid during the call only.
  virtual void on_message(Station& station, const MessageHead& head,
                          std::span<const std::uint8_t> payload) = 0;

  /// The last packet of the message in flight on this channel has been pulled. May send() the next:
  /// the link is filling a frame, and takes it along if there is room.
  virtual void on_sent(Station& station, std::uint16_t channel) = 0;

  /// Somebody else is heard under our node id. Called after the packet has been dealt with.
  virtual void on_namesake(Station& station) = 0;

  /// A beacon says that this robot has sent messages up to this number.
  virtual void on_last_message(Station& /*station*/, const MessageHead& /*head*/) {}

  /// Its link has gone up or down.
  virtual void on_link_state(Station& /*station*/) {}

  /// Two other robots are heard under one node id. Once for each pair.
  virtual void on_duplicate(Station& /*station*/, const Neighbour& /*older*/,
                            const Neighbour& /*younger*/) {}

  /// Another robot is heard from the address of this station's own interface. Once for each.
  virtual void on_double_address(Station& /*station*/, const Neighbour& /*other*/) {}
};

enum class SendResult : std::uint8_t { kSent, kBusy, kRefused };

class Station {
 public:
  virtual ~Station() = default;

  /// Begins to receive and transmit. After every privilege is dropped.
  virtual void start() = 0;

  virtual const std::string& name() const = 0;  // of its [links.NAME]
  virtual const char* profile() const = 0;      // "wifi"
  /// Under which id it speaks: the daemon's, or the link's own.
  virtual NodeIdentity& identity() = 0;
  virtual const StationLimits& limits() const = 0;
  virtual bool is_up() const = 0;
  /// Longest message that the link carries now: less than limits() when the MTU of its interface
  /// is too small for the profile's packets.
  virtual std::size_t message_bytes_that_fit(bool is_timestamped) const = 0;
  virtual drivers::Link& link() = 0;
  virtual drivers::Counters counters() const = 0;  // the node's
  /// Robots heard within Neighbours::kForgetAfter, by node id.
  virtual std::vector<Neighbour> neighbours(Neighbour::Time now) const = 0;

  /// Makes room for a channel. @pre limits().carries() it. @return false: every slot is taken
  virtual bool open_channel(std::uint16_t channel, bool is_timestamped) = 0;
  /// @pre opened. A message in flight is given up without on_sent().
  virtual void close_channel(std::uint16_t channel) = 0;
  /// Whether messages of an opened channel are put together and handed up.
  virtual void set_listening(std::uint16_t channel, bool is_listening) = 0;

  /// Hands one message to the node, which copies it. @pre opened; size and TTL within limits()
  /// @param origin  of one that crosses a gateway here; null: our own
  /// @param waited_us  on a timestamped channel since its program sent it: its delay counts from
  ///   there
  /// @param number  the message's number, where the profile has room for it and it has not come yet
  ///   (0: any): the same on several links, so that who hears both takes it once. Set to the
  ///   number it has when sent
  virtual SendResult send(std::uint16_t channel, std::span<const std::uint8_t> payload,
                          std::uint8_t ttl, const GatewayOrigin* origin, std::uint64_t waited_us,
                          std::uint32_t& number) = 0;
  /// Whether messages can have repair packets here (docs/redundancy.md).
  virtual bool has_redundancy() const { return false; }
  /// The message that send() is given next gets so many, at most 12, or as many as the loss around
  /// demands (kAutoRedundancy). Where it cannot have them it goes without.
  virtual void protect_next(std::uint8_t /*redundancy*/) {}
  /// Sends the message that has left last on this channel once more; on_sent() follows. @pre there
  /// was one since the channel was opened. @return false: it cannot
  virtual bool send_again(std::uint16_t channel) = 0;
  /// Gives up the message in flight, if any, without on_sent().
  virtual void cancel(std::uint16_t channel) = 0;

  /// From now on packets from beyond are dropped, like those of a radio that does not reach so far:
  /// neither heard nor forwarded, and counted.
  virtual void set_virtual_range(const VirtualRange& range) = 0;

  /// Whether packets of simulated robots are taken.
  virtual void set_ghosts(bool are_heard) = 0;

  /// From now on packets of others are sent on within these limits only.
  virtual void set_forwarding(const Forwarding& /*forwarding*/) {}

  /// The id of identity() has changed.
  virtual void adopt_node_id() = 0;
};

}  // namespace swarmtalk::daemon
