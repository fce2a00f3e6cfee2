// A node of each profile that hears whatever comes: packets, their copies and forgeries, at any
// time, while it sends, forwards, opens and closes channels itself.
//
// Input: byte 0 picks the profile; then commands of one byte: low 3 bits what, high 5 bits how
// much.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>

#include "swarmtalk/profiles/classic2020.hpp"
#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace {

using namespace swarmtalk::core;

uint32_t now = 0;
uint32_t draws = 0;

/// Reads the fuzzer's bytes in order; zeros after the end.
class Script {
 public:
  Script(const uint8_t* data, size_t size) : data_(data), left_(size) {}
  bool is_done() const { return left_ == 0; }
  uint8_t next() {
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }

 private:
  const uint8_t* data_;
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
    uint8_t packet[P::kMtuBytes];
    for (int i = 0; i < 1000 && node_->pull_packet(packet) != 0; ++i) {
    }
  }

 private:
  static void on_message(void*, const uint8_t* bytes, uint16_t size, const Reception<P>&) {
    if (size > Wire<P>::kMessageBytes) abort();
    volatile uint8_t sum = 0;
    for (uint16_t i = 0; i < size; ++i) sum = static_cast<uint8_t>(sum + bytes[i]);
  }
  void open(uint8_t id) {
    const bool timestamped =
        P::kTimestampedFrom != kNoTimestampedChannels ? id >= P::kTimestampedFrom : (id & 1) != 0;
    Channel<P>* channel = node_->new_channel(id, id & 7, timestamped);
    if (channel == nullptr) return;
    channel->new_subscriber(100, &on_message, nullptr);
    publisher_ = channel->new_publisher(nullptr, nullptr);
  }
  void step(Script& script) {
    const uint8_t command = script.next();
    const uint8_t amount = static_cast<uint8_t>(command >> 3);
    switch (command & 7) {
      case 0:  // a packet from the script
      case 1:
      case 2: {
        uint8_t packet[P::kMtuBytes + 1] = {};
        const uint16_t size = (command & 1) != 0 ? P::kMtuBytes : static_cast<uint16_t>(amount + 4);
        const uint16_t scripted = static_cast<uint16_t>(size < 40 ? size : 40);
        for (uint16_t i = 0; i < scripted && i < sizeof packet; ++i) packet[i] = script.next();
        const uint16_t heard = size <= P::kMtuBytes ? size : P::kMtuBytes;
        if ((command & 7) == 2 && Wire<P>::kChecksumBytes != 0) {  // undamaged
          Wire<P>::seal(packet, static_cast<typename Wire<P>::PacketSize>(heard - 1));
        }
        typename P::Sensing sensing{};
        node_->on_packet(packet, heard, sensing);
        break;
      }
      case 3:
        now += UINT32_C(1) << amount;
        break;
      case 4: {
        uint8_t packet[P::kMtuBytes];
        const uint16_t size = node_->pull_packet(packet);
        if (size > P::kMtuBytes) abort();
        if (size != 0 && amount > 15) node_->on_packet(packet, size, typename P::Sensing{});
        break;
      }
      case 5: {
        uint8_t message[Wire<P>::kMessageBytes] = {};
        if (publisher_ != nullptr) {
          publisher_->send(message, static_cast<uint16_t>(amount * Wire<P>::kMessageBytes / 31));
        }
        break;
      }
      case 6:
        open(amount);
        break;
      case 7:
        if (publisher_ != nullptr) node_->remove_channel(publisher_->channel());
        publisher_ = nullptr;
        break;
    }
  }

  std::unique_ptr<Swarmtalk<P>> node_;
  Publisher<P>* publisher_ = nullptr;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  now = 0;
  draws = 0;
  const Script script(data + 1, size - 1);
  switch (data[0] % 4) {
    case 0:
      Fuzzed<Kilobot>().run(script);
      break;
    case 1:
      Fuzzed<Classic2020>().run(script);
      break;
    case 2:
      Fuzzed<Footbot>().run(script);
      break;
    case 3:
      Fuzzed<Wifi>().run(script);
      break;
  }
  return 0;
}
