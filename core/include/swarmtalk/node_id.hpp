// The id under which a node sends: random, changed when a neighbour is heard using it, or fixed by
// configuration. Owned by the node.
//
// How long two neighbours can share an id: until one hears a packet of the other. Without loss that
// is the other's next packet; with loss p it takes 1/(1-p) packets on average. Both may change.
#pragma once

#include <stdint.h>

#include "swarmtalk/port.hpp"
#include "swarmtalk/record.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

template <class P>
class NodeIdentity : private KeyEpoch<typename Wire<P>::Epoch, (P::kEpochBits > 0)> {
  using MyEpoch = KeyEpoch<typename Wire<P>::Epoch, (P::kEpochBits > 0)>;

 public:
  using W = Wire<P>;
  using NodeId = typename W::NodeId;
  using Epoch = typename W::Epoch;
  using MessageNumber = typename W::MessageNumber;

  SWARMTALK_PART(NodeIdentity)
  void start() {
    id_ = W::kNoNode;
    set_zero(is_fixed_);
    set_zero(first_number_);
    if (P::kEpochBits > 0) MyEpoch::set(0);
  }

  bool is_drawn() const { return id_ != W::kNoNode; }
  bool is_fixed() const { return is_fixed_; }
  NodeId id() const { return id_; }
  Epoch epoch() const { return MyEpoch::get(); }
  /// Both are cut to their fields' width, as on the wire: a packet of ours has to be known again.
  void set_epoch(Epoch epoch) { MyEpoch::set(static_cast<Epoch>(epoch & low_bits(P::kEpochBits))); }

  /// Takes this id for good. kNoNode: the next one is drawn.
  void fix(NodeId id, const Port& port) {
    if (id_ == W::kNoNode) draw_number(port.random(port.context));
    id_ = static_cast<NodeId>(id & W::kNoNode);
    is_fixed_ = id_ != W::kNoNode;
  }
  /// What this start of the program adds to its message numbers. After a restart under the same id
  /// nobody takes them for the old ones: where there is an epoch that tells, and this is 0.
  MessageNumber first_number() const { return first_number_; }

  /// Draws a new id, not the present one and none that is `known` (kDraws tries, then any other: it
  /// is drawn within a pull, which has to end soon, and a collision is noticed later all the same).
  /// @param known  has knows_node(NodeId) -> bool: heard lately
  template <class Known>
  SWARMTALK_AVR_CALLED void draw(const Port& port, const Known& known) {
    NodeId id = id_;
    for (uint8_t tries = 0; tries < kDraws; ++tries) {
      const uint32_t random = port.random(port.context);
      const NodeId drawn = static_cast<NodeId>(random & W::kNoNode);
      draw_number(random);
      if (drawn == id_ || drawn >= W::kFirstGatewayId) continue;
      id = drawn;
      if (tries == kDraws - 1 || !known.knows_node(drawn)) break;  // the last one is taken anyway
    }
    if (id == id_ && ++id >= W::kFirstGatewayId) id = 0;
    id_ = id;
  }

 private:
  static constexpr uint8_t kDraws = 2;
  /// From the upper half of what was drawn for the id.
  void draw_number(uint32_t random) {
    if (P::kEpochBits == 0) first_number_ = static_cast<MessageNumber>(random >> 16);
  }

  NodeId id_;
  bool is_fixed_;
  MessageNumber first_number_;
};

}  // namespace core
}  // namespace swarmtalk
