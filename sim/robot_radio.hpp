// RobotRadio: what the radio of a simulated robot does at a time: it sends, or hears a carrier, or
// receives one packet, which another or its own sending may damage. A value.
#pragma once

#include <algorithm>
#include <cstdint>

namespace swarmtalk::sim {

class RobotRadio {
 public:
  /// What keeps a packet from being received.
  enum class Damage : uint8_t { kNone, kCollision, kSending };

  /// Whether a robot that wants to send waits. @param turnaround_us  to notice a carrier
  bool is_taken(uint64_t now_us, uint32_t turnaround_us) const {
    const bool senses_carrier =
        hears_until_us_ > now_us && now_us - hears_since_us_ >= turnaround_us;
    return senses_carrier || sends_until_us_ > now_us;
  }

  /// A packet of its own goes on the air. @return when it has left
  uint64_t send(uint64_t now_us, uint32_t air_us) {
    sends_until_us_ = now_us + air_us;
    if (is_receiving() && damage_ == Damage::kNone) damage_ = Damage::kSending;
    return sends_until_us_;
  }

  /// A packet of another begins here. @return kNone: it is the one that is received
  Damage begin(uint32_t from, uint64_t now_us, uint32_t air_us) {
    if (hears_until_us_ <= now_us) hears_since_us_ = now_us;
    hears_until_us_ = std::max(hears_until_us_, now_us + air_us);
    if (sends_until_us_ > now_us) return Damage::kSending;
    if (is_receiving() || hears_since_us_ != now_us) {
      if (damage_ == Damage::kNone) damage_ = Damage::kCollision;
      return Damage::kCollision;
    }
    from_ = from;
    damage_ = Damage::kNone;
    return Damage::kNone;
  }

  bool is_receiving() const { return from_ != kNobody; }
  bool is_receiving(uint32_t from) const { return from_ == from; }

  /// What is received ends. @return what happened to it
  Damage end() {
    from_ = kNobody;
    return damage_;
  }

 private:
  static constexpr uint32_t kNobody = UINT32_MAX;

  uint64_t sends_until_us_ = 0;
  uint64_t hears_since_us_ = 0;  // the carrier that is there, or was there last
  uint64_t hears_until_us_ = 0;
  uint32_t from_ = kNobody;        // who is being received
  Damage damage_ = Damage::kNone;  // of that reception
};

}  // namespace swarmtalk::sim
