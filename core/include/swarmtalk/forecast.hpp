// What a node makes of the messages it is putting together when another one begins: whether memory
// will do for it, and which of them to give up. Filled in by the cache's walk over the records.
#pragma once

#include <stdint.h>

#include "swarmtalk/record.hpp"
#include "swarmtalk/types.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

/// The messages being put together, and the one that begins.
template <class P>
struct OpenMessages {
  using Packets =
      UintFor<bits_for(UINT32_C(1) * P::kRecords * Wire<P>::kMaxPackets + P::kFragmentSlots)>;
  Record<P>* least = nullptr;  // worth least. Null: there is none but the one that begins
  uint8_t worth = 255;         // what that is worth
  uint8_t most = 2;            // packets the farthest will have when its next one comes
  Packets messages = 1;
  Packets held = 1;  // packets
  /// @param its_worth  packets held and 1; 0: it cannot become whole any more
  SWARMTALK_AVR_INLINED void add(Record<P>* record, uint8_t its_worth) {
    if (its_worth < worth) {
      least = record;
      worth = its_worth;
    }
    if (its_worth > most) most = its_worth;
    ++messages;
    held = static_cast<Packets>(held + its_worth - 1u);
  }
};

/// Whether memory will do for the message that begins, if all that are begun go on at one pace and
/// have as many packets as the last one that was put together. Where nothing is lost, up to a fifth
/// more messages become whole than if each were begun for which there is a slot. Where one of those
/// begun has lost packets, others will end early too: then there is room (has_room_). Kept where a
/// new message looks at all records anyway.
template <class P, bool kPresent>
class Forecast {
 protected:
  SWARMTALK_PART(Forecast)
  void start() {
    set_zero(usual_packets_);
    set_zero(least_);
    has_room_ = true;
    worth_ = 255;
  }
  void set_usual_packets(uint8_t packets) { usual_packets_ = packets; }
  void look_ahead(const OpenMessages<P>& open) {
    least_ = open.least;
    worth_ = open.worth;
    const uint8_t packets = usual_packets_;
    // When the farthest is about to end, each has grown by as much as it.
    has_room_ = open.worth == 0 || open.most >= packets ||
                static_cast<typename OpenMessages<P>::Packets>(
                    open.messages * static_cast<uint8_t>(packets - open.most) + open.held) <=
                    P::kFragmentSlots;
  }
  /// REQUIRES knows_length()
  bool has_room() const { return has_room_; }
  bool knows_length() const { return usual_packets_ >= 2; }
  /// The open message that was worth least at the last look, if that is less than `limit`: once.
  Record<P>* take_least_under(uint8_t limit) {
    if (worth_ >= limit) return nullptr;
    worth_ = 255;
    return least_;
  }

 private:
  uint8_t usual_packets_;  // 0: unknown
  bool has_room_;
  uint8_t worth_;
  Record<P>* least_;
};
template <class P>
class Forecast<P, false> {
 protected:
  void start() {}
  void set_usual_packets(uint8_t) {}
  void look_ahead(const OpenMessages<P>&) {}
  bool has_room() const { return true; }
  bool knows_length() const { return false; }
  Record<P>* take_least_under(uint8_t) { return nullptr; }
};

}  // namespace core
}  // namespace swarmtalk
