// A node of profile P that hears whatever comes: packets, their copies and forgeries, at any time,
// while it sends, forwards, opens and closes channels itself. What it says is checked: a packet
// that leaves has the length that was announced, a true checksum, and is the node's own or one that
// it heard, one hop further; a message delivered is no longer than one of its kind can be.
//
// The script: commands of one byte, low 3 bits what, high 5 bits how much, each with the bytes it
// asks for. Command 7 has several by its amount: messages and packets whose headers are sound, so
// that a fuzzer need not find out widths and checksums of every profile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <set>
#include <tuple>
#include <vector>

#include "swarmtalk/swarmtalk.hpp"
#include "tests/fuzz/core_exchange.hpp"

namespace swarmtalk::core::fuzz {

inline uint32_t now = 0;
inline uint32_t draws = 0;

/// Reads the fuzzer's bytes in order; zeros after the end.
class Script {
 public:
  Script(const uint8_t* bytes, size_t size) : bytes_(bytes), left_(size) {}
  bool is_done() const { return left_ == 0; }
  uint8_t next() {
    if (left_ == 0) return 0;
    --left_;
    return *bytes_++;
  }
  uint16_t next16() {
    const unsigned high = next();
    return static_cast<uint16_t>(high << 8 | next());
  }

 private:
  const uint8_t* bytes_;
  size_t left_;
};

template <class P>
class Fuzzed {
 public:
  Fuzzed()
      : node_(new Swarmtalk<P>(
            Port{[](void*) { return now; }, [](void*) { return ++draws; }, nullptr})) {
    open(1);
  }

  void run(Script script) {
    while (!script.is_done()) step(script);
    for (int i = 0; i < 1000 && pull() != 0; ++i) {
    }
  }

 private:
  using W = Wire<P>;
  using Header = typename W::Header;

  // --- what the node says ---------------------------------------------------------------------
  static void look_at(const uint8_t* bytes, uint16_t size) {
    volatile uint8_t sum = 0;
    for (uint16_t i = 0; i < size; ++i) sum = static_cast<uint8_t>(sum + bytes[i]);
  }
  static void on_message(void*, const uint8_t* bytes, uint16_t size,
                         const Reception<P>& reception) {
    require(size <= (reception.has_delay ? W::kTimedMessageBytes : W::kMessageBytes));
    look_at(bytes, size);
  }
  static void on_plain_message(unsigned char* bytes, int size, int, typename P::Sensing*) {
    require(size >= 0 && size <= W::kMessageBytes);
    look_at(bytes, static_cast<uint16_t>(size));
    for (int i = 0; i < size; ++i) bytes[i] = 0xFF;  // it is the program's
  }

  /// A packet's name: all that no robot on its way may change.
  using Name = std::tuple<uint16_t, uint32_t, uint16_t, bool, uint16_t, uint16_t>;
  static Name name_of(const Header& header) {
    return Name(header.node, header.message, header.sequence, header.end, header.channel,
                header.epoch);
  }

  uint16_t pull() {
    packet_.assign(W::kMtuBytes, 0xEE);  // of this size on the heap: a sanitizer sees the edges
    const uint16_t announced = node_->next_packet_bytes();
    require(node_->has_packet() == (announced != 0));
    const uint16_t size = node_->pull_packet(packet_.data());
    // What waited for longer than the clock counts is given up by the pull.
    require(size == announced || is_beyond_the_clock());
    if (size == 0) return 0;
    require(W::check(packet_.data(), size) == Error::kOk);
    const Header header = W::decode(packet_.data());
    own_ids_.insert(node_->node_id());
    require(own_ids_.count(header.node) != 0 || heard_.count(name_of(header)) != 0);
    return size;
  }

  bool is_beyond_the_clock() const {
    return P::kClockBits < 32 && (now - heard_at_) >> (P::kClockBits % 32) != 0;
  }

  // --- what it hears ----------------------------------------------------------------------------
  void hear(const uint8_t* bytes, uint16_t size) {
    const std::vector<uint8_t> exact(bytes, bytes + size);
    heard_at_ = now;
    if (node_->on_packet(exact.data(), size, typename P::Sensing{}) != Error::kOk) return;
    const Header header = W::decode(exact.data());
    if (header.ttl != 0) heard_.insert(name_of(header));
  }

  /// What several packets of a message have in common.
  struct Forged {
    Header header;
    uint16_t places;    // packets, if not the size tells
    bool right_length;  // full, or what the size leaves to the last
  };
  Forged forge(Script& script) {
    static constexpr uint8_t kChannels[] = {1, 1, 1, 1, 0, 2, 3, 6};
    Forged forged = {};
    const uint8_t names = script.next();
    const uint8_t kinds = script.next();
    const uint8_t places = script.next();
    Header& header = forged.header;
    header.node = static_cast<typename W::NodeId>(names & 3);
    header.message = static_cast<typename W::MessageNumber>(names >> 2 & 7);
    header.channel = static_cast<typename W::ChannelId>(kChannels[names >> 5] & W::kChannelMax);
    last_channel_ = static_cast<uint8_t>(header.channel);
    header.has_delay = (kinds & 1) != 0;
    forged.right_length = (kinds & 2) == 0;
    header.ttl = static_cast<uint8_t>(kinds >> 2 & 3);
    header.hops = static_cast<uint8_t>(kinds >> 4 & 3);
    header.crossed_gateway = (kinds & 0x40) != 0;
    header.epoch = static_cast<typename W::Epoch>(kinds >> 7);
    constexpr uint32_t kMost = UINT32_C(1) << P::kSequenceBits;
    forged.places = static_cast<uint16_t>(places % (kMost < 36 ? kMost : 36) + 1);
    if (P::kSizeBits != 0) {
      // In the packets that places counts, or anything.
      const uint16_t tail = script.next();
      const uint32_t size = (kinds & 2) == 0 ? (forged.places - 1u) * payload_of(header) + tail
                                             : static_cast<uint32_t>(tail << 8 | places);
      header.size = static_cast<decltype(header.size)>(size);
      forged.places = W::packets_for(header.size, payload_of(header));
    }
    return forged;
  }
  static uint16_t payload_of(const Header& header) {
    return header.has_delay && P::kTimestampBits != 0 ? W::kTimedPayloadBytes : W::kPayloadBytes;
  }
  void hear(const Forged& forged, uint16_t place, uint8_t other_length) {
    Header header = forged.header;
    header.sequence = static_cast<typename W::Sequence>(place);
    header.end = place + 1 == forged.places;
    const uint16_t payload = payload_of(header);
    uint16_t body = payload;
    if (!forged.right_length) {
      body = static_cast<uint16_t>(other_length % (payload + 1u));
    } else if (P::kSizeBits != 0 && header.end) {
      body = static_cast<uint16_t>(header.size - place * payload);
    }
    if (header.has_delay) body = static_cast<uint16_t>(body + W::kTimestampBytes);
    if (body > W::kBodyBytes) body = W::kBodyBytes;
    packet_.assign(W::kMtuBytes, static_cast<uint8_t>(place));
    W::encode(header, packet_.data());
    const size_t bare =
        P::kPadded ? size_t{W::kHeaderBytes} + W::kBodyBytes : size_t{W::kHeaderBytes} + body;
    const uint16_t size = W::seal(packet_.data(), static_cast<typename W::PacketSize>(bare));
    hear(packet_.data(), size);
  }
  /// A whole message, from any of its packets on, forth or back, perhaps with one of them of
  /// another kind at last, perhaps with its channel opened anew half-way.
  void hear_message(Script& script, bool opens, bool timestamped) {
    const Forged forged = forge(script);
    const uint8_t order = script.next();
    const uint16_t first = static_cast<uint16_t>(order % forged.places);
    for (uint16_t n = 0; n < forged.places; ++n) {
      const uint16_t step = (order & 0x80) != 0 ? static_cast<uint16_t>(forged.places - n) : n;
      const uint16_t place = static_cast<uint16_t>((first + step) % forged.places);
      const uint8_t other_length = static_cast<uint8_t>(order + n);
      if ((order & 0x40) != 0 && n + 1 == forged.places) {
        Forged other = forged;
        other.header.has_delay = !forged.header.has_delay;
        if (P::kSizeBits != 0) {
          other.places = W::packets_for(other.header.size, payload_of(other.header));
        }
        hear(other, place, other_length);
      } else {
        hear(forged, place, other_length);
      }
      if (opens && n == forged.places / 2) {
        remove(last_channel_);
        open(last_channel_, timestamped);
      }
    }
  }

  // --- what its program does --------------------------------------------------------------------
  void open(uint8_t id) { open(id, (id & 1) != 0); }
  void open(uint8_t id, bool timestamped) {
    if (P::kTimestampedFrom != kNoTimestampedChannels) timestamped = id >= P::kTimestampedFrom;
    Channel<P>* channel = node_->new_channel(id, id & 7 & W::kTtlMax, timestamped);
    if (channel == nullptr) return;
    channel->new_subscriber(100, &on_message, nullptr);
    channel->new_subscriber(50, &on_plain_message);
    last_opened_ = id;
    publishers_[id] = channel->new_publisher(nullptr, nullptr);
  }
  Publisher<P>* publisher() const { return publishers_[last_opened_]; }
  void remove(uint8_t id) {
    if (publishers_[id] != nullptr) node_->remove_channel(publishers_[id]->channel());
    publishers_[id] = nullptr;
  }

  /// Between other nodes, and at other times.
  void exchange(Script& script, uint8_t kinds) {
    typename Exchange<P>::Plan plan = {};
    plan.size = script.next16();
    plan.timestamped = (kinds & 1) != 0;
    plan.is_reverse = (kinds & 2) != 0;
    plan.ttl = script.next() & W::kTtlMax;
    plan.waited = script.next();
    plan.first = script.next();
    uint32_t its_now = now;
    Exchange<P>(its_now, draws).run(plan);
  }

  void step(Script& script) {
    const uint8_t command = script.next();
    const uint8_t amount = static_cast<uint8_t>(command >> 3);
    switch (command & 7) {
      case 0:  // a packet from the script
      case 1:
      case 2: {
        std::vector<uint8_t> packet(W::kMtuBytes + 1u);
        const uint16_t size = (command & 1) != 0 ? P::kMtuBytes : static_cast<uint16_t>(amount + 4);
        const uint16_t scripted = static_cast<uint16_t>(size < 40 ? size : 40);
        for (uint16_t i = 0; i < scripted && i < packet.size(); ++i) packet[i] = script.next();
        const uint16_t heard = size <= P::kMtuBytes ? size : P::kMtuBytes;
        if ((command & 7) == 2 && W::kChecksumBytes != 0) {  // undamaged
          W::seal(packet.data(), static_cast<typename W::PacketSize>(heard - 1));
        }
        hear(packet.data(), heard);
        break;
      }
      case 3:
        now += UINT32_C(1) << amount;
        break;
      case 4: {
        const uint16_t size = pull();
        if (size != 0 && amount > 15) hear(packet_.data(), size);
        break;
      }
      case 5:
        if (publisher() != nullptr) {
          const std::vector<uint8_t> message(W::kMessageBytes);
          publisher()->send(message.data(), static_cast<uint16_t>(amount * W::kMessageBytes / 31));
        }
        break;
      case 6:
        open(amount);
        break;
      case 7:
        if (amount < 4) {
          exchange(script, amount);
        } else if (amount < 8) {
          remove(last_opened_);
        } else if (amount < 12) {
          // Perhaps the one that was heard last.
          const uint8_t id = (amount & 2) != 0 ? last_channel_ : script.next() & 7;
          open(id, (amount & 1) != 0);
        } else if (amount < 20) {
          const Forged forged = forge(script);
          const uint8_t place = script.next();
          hear(forged, static_cast<uint16_t>(place % (forged.places + 1u)), amount);
        } else {
          hear_message(script, amount >= 26, (amount & 1) != 0);
        }
        break;
    }
  }

  std::unique_ptr<Swarmtalk<P>> node_;
  Publisher<P>* publishers_[32] = {};  // of open channels, by their number
  uint8_t last_opened_ = 0;
  uint8_t last_channel_ = 0;  // of a forged packet
  std::vector<uint8_t> packet_;
  std::set<uint16_t> own_ids_;
  uint32_t heard_at_ = now;
  std::set<Name> heard_;
};

/// Runs the input with the profile that its first byte picks.
template <class... Profiles>
void run_one_of(const uint8_t* bytes, size_t size) {
  if (size == 0) return;
  now = 0;
  draws = 0;
  const Script script(bytes + 1, size - 1);
  const size_t picked = bytes[0] % sizeof...(Profiles);
  size_t at = 0;
  ((at++ == picked ? Fuzzed<Profiles>().run(script) : void()), ...);
}

}  // namespace swarmtalk::core::fuzz
