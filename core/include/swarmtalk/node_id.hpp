// The id under which a node sends: random, changed when a neighbour is heard using it, or fixed by
// configuration. Owned by the node.
//
// How long two neighbours can share an id: until one hears a packet of the other. Without loss that
// is the other's next packet; with loss p it takes 1/(1-p) packets on average. Both may change.
#pragma once

#include <stdint.h>

#include "swarmtalk/port.hpp"
#include "swarmtalk/record_index.hpp"
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

  NodeIdentity() : id_(W::kNoNode), is_fixed_(false) { MyEpoch::set(0); }

  bool is_drawn() const { return id_ != W::kNoNode; }
  bool is_fixed() const { return is_fixed_; }
  NodeId id() const { return id_; }
  Epoch epoch() const { return MyEpoch::get(); }
  void set_epoch(Epoch epoch) { MyEpoch::set(epoch); }

  /// Takes this id for good.
  void fix(NodeId id) {
    id_ = id;
    is_fixed_ = true;
  }

  /// Draws a new id, not the present one and none that is `known` (kDraws tries, then any other).
  /// @param known  has knows_node(NodeId) -> bool: heard lately
  template <class Known>
  SWARMTALK_APART void draw(const Port& port, const Known& known) {
    NodeId id = id_;
    for (uint8_t tries = 0; tries < kDraws; ++tries) {
      const NodeId drawn = static_cast<NodeId>(port.random(port.context) & W::kNoNode);
      if (drawn == id_ || drawn >= W::kFirstGatewayId) continue;
      id = drawn;
      if (!known.knows_node(drawn)) break;
    }
    if (id == id_ && ++id >= W::kFirstGatewayId) id = 0;
    id_ = id;
  }

 private:
  static constexpr uint8_t kDraws = 8;
  NodeId id_;
  bool is_fixed_;
};

}  // namespace core
}  // namespace swarmtalk
