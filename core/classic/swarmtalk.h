// For programs written against the open-source SwarmTalk of 2020: its names, shapes and return
// codes on today's core, with the same packets on the air. A program includes this, defines setup()
// and loop(), and is compiled unchanged; a driver (or several instances in one process) uses
// SwarmTalk::Swarmtalk as below. Macros of a config.h are honoured if defined before (config.hpp).
//
// One translation unit per program defines the globals: the one that does not define
// SWARMTALK_CLASSIC_NO_GLOBALS.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "core/classic/controls.hpp"
#include "core/classic/profile.hpp"

namespace SwarmTalk {

enum Send_result { SUCCESS = 0, ERROR_NOT_READY = 1, ERROR_TOO_LONG = 2 };

/// Clock, random and lock hooks of the platform. Without them time stands still and random numbers
/// come from a small generator that differs per instance.
class Common_system {
 public:
  void set_common_sys_get_clock(unsigned int (*clock)()) { clock_ = clock; }
  void set_common_sys_random_func(unsigned int (*random)()) { random_ = random; }
  void set_common_sys_lock(void (*function)()) { lock_ = function; }
  void set_common_sys_unlock(void (*function)()) { unlock_ = function; }

  unsigned int get_clock() const { return clock_ == nullptr ? 0u : clock_(); }
  unsigned int random_func() {
    if (random_ != nullptr) return random_();
    state_ = state_ * UINT32_C(1664525) + UINT32_C(1013904223) +
             static_cast<uint32_t>(reinterpret_cast<uintptr_t>(this));
    return static_cast<unsigned int>(state_ >> 16);
  }
  void lock() const {
    if (lock_ != nullptr) lock_();
  }
  void unlock() const {
    if (unlock_ != nullptr) unlock_();
  }

 private:
  unsigned int (*clock_)() = nullptr;
  unsigned int (*random_)() = nullptr;
  void (*lock_)() = nullptr;
  void (*unlock_)() = nullptr;
  uint32_t state_ = 1;
};

using Receive_callback = void (*)(unsigned char* message, int size, int ttl, Meta_t* meta);

class Publisher {
 public:
  /// @return 0 queued, 1 busy, 2 longer than the channel carries, or of no length
  int send(unsigned char* message, int size) {
    if (core_ == nullptr || size <= 0 || static_cast<uint32_t>(size) > 65535) return ERROR_TOO_LONG;
    sys_->lock();
    const swarmtalk::core::Error error = core_->send(message, static_cast<uint16_t>(size));
    sys_->unlock();
    return error == swarmtalk::core::Error::kOk     ? SUCCESS
           : error == swarmtalk::core::Error::kBusy ? ERROR_NOT_READY
                                                    : ERROR_TOO_LONG;
  }
  bool available() const { return core_ != nullptr && core_->available(); }

 private:
  friend class Channel;
  swarmtalk::core::Publisher<Profile>* core_ = nullptr;
  Common_system* sys_ = nullptr;
};

class Subscriber {
 private:
  friend class Channel;
  static void on_message(void* self, const uint8_t* bytes, uint16_t size,
                         const swarmtalk::core::Reception<Profile>& reception) {
    Meta_t meta = reception.sensing.meta;
    meta.msg_delay = static_cast<int>(reception.delay_ticks & UINT32_C(0x7FFFFFFF));
    swarmtalk::core::with_aligned<Profile>(bytes, size, [&](unsigned char* message) {
      static_cast<Subscriber*>(self)->receive_(message, static_cast<int>(size), reception.ttl,
                                               &meta);
    });
  }
  Receive_callback receive_ = nullptr;
};

class Channel {
 public:
  /// @return NULL if MAX_PUB_PER_CHAN are taken; a NULL callback is allowed
  Publisher* new_publisher(void (*sent)()) {
    swarmtalk::core::Publisher<Profile>* core = core_->new_publisher(sent);
    if (core == nullptr) return nullptr;
    Publisher& publisher = publishers_[publisher_count_++];
    publisher.core_ = core;
    publisher.sys_ = sys_;
    return &publisher;
  }
  /// @param distance  messages from as far or farther are not delivered
  Subscriber* new_subscriber(int distance, Receive_callback receive) {
    if (subscriber_count_ == MAX_SUB_PER_CHAN) return nullptr;
    Subscriber& subscriber = subscribers_[subscriber_count_];
    subscriber.receive_ = receive;
    if (core_->new_subscriber(distance, receive == nullptr ? nullptr : &Subscriber::on_message,
                              &subscriber) == nullptr) {
      return nullptr;
    }
    ++subscriber_count_;
    return &subscriber;
  }

 private:
  friend class Swarmtalk;
  swarmtalk::core::Channel<Profile>* core_ = nullptr;
  Common_system* sys_ = nullptr;
  Publisher publishers_[MAX_PUB_PER_CHAN];
  Subscriber subscribers_[MAX_SUB_PER_CHAN];
  uint8_t publisher_count_ = 0;
  uint8_t subscriber_count_ = 0;
};

class Swarmtalk {
 public:
  Swarmtalk() : node_(swarmtalk::core::Port{&read_clock, &draw, this}) {}

  Common_system sys;

  /// Draws the node's id. (Ids are drawn when first needed, so forgetting it does no harm.)
  void init() { node_.node_id(); }
  Common_system* get_common_sys() { return &sys; }

  /// @return NULL if the number does not fit, is taken, or TOTAL_CHAN_NUM are in use; or if a
  /// timestamp would leave no room in a packet
  Channel* new_channel(int type, int hops, bool time_chan) {
    if (type < 0 || type > CHAN_TYPE_MAX || hops < 0) return nullptr;
    swarmtalk::core::Channel<Profile>* core =
        node_.new_channel(static_cast<uint32_t>(type), static_cast<uint32_t>(hops), time_chan);
    if (core == nullptr) return nullptr;
    Channel& channel = channels_[channel_count_++];
    channel.core_ = core;
    channel.sys_ = &sys;
    return &channel;
  }

  /// @return PKT_SIZE, or 0 if nothing waits
  int next_pkt(unsigned char* packet) { return node_.pull_packet(packet); }
  void receive(unsigned char* packet, int size, Meta_t* meta) {
    if (size < 0 || static_cast<uint32_t>(size) > 65535) return;
    Meta_t unknown = {};
    unknown.dist = -1;
    const Meta_sensing sensing = {*(meta == nullptr ? &unknown : meta)};
    node_.on_packet(packet, static_cast<uint16_t>(size), sensing);
  }

  void register_user_loop(void (*loop)()) { loop_ = loop; }
  void register_control_factory(void* controls) { controls_ = controls; }
  void* control_factory() const { return controls_; }
  /// One turn: the controls' timers, then the program's loop().
  void execute_loop() {
    led.update();
    motor.update();
    if (loop_ != nullptr) loop_();
  }

  Led_control led;
  Motor_control motor;

 private:
  static uint32_t read_clock(void* self) { return static_cast<Swarmtalk*>(self)->sys.get_clock(); }
  /// Two draws, because a platform's are often of 15 or 16 bits.
  static uint32_t draw(void* self) {
    Common_system& sys = static_cast<Swarmtalk*>(self)->sys;
    const uint32_t high = sys.random_func();
    return high << 16 ^ sys.random_func();
  }

  swarmtalk::core::Swarmtalk<Profile> node_;
  Channel channels_[TOTAL_CHAN_NUM];
  swarmtalk::core::UintFor<swarmtalk::core::bits_for(TOTAL_CHAN_NUM)> channel_count_ = 0;
  void (*loop_)() = nullptr;
  void* controls_ = nullptr;
};

/// With macros that differ (PKT_SIZE, TOTAL_CHAN_NUM ...) program and home would have two classes
/// of one name, and the linker would keep either. The program defines this, the home calls it by
/// the next function, the linker compares.
template <class Meta, unsigned kBytes, uint64_t kPackets, uint64_t kMemory>
void program_and_home_were_given_different_macros();

}  // namespace SwarmTalk

using namespace SwarmTalk;

void setup();
void loop();

#ifdef SWARMTALK_CLASSIC_NO_GLOBALS
namespace SwarmTalk {
inline void compare_macros_with_the_program() {
  program_and_home_were_given_different_macros<Meta_t, sizeof(Swarmtalk), kPacketFormat,
                                               kMemoryFormat>();
}
}  // namespace SwarmTalk
extern SwarmTalk::Swarmtalk swarmtalk_instance;
extern SwarmTalk::Led_control* LED_control;
extern SwarmTalk::Motor_control* motor_control;
#else
namespace SwarmTalk {
template <>
void program_and_home_were_given_different_macros<Meta_t, sizeof(Swarmtalk), kPacketFormat,
                                                  kMemoryFormat>() {}
}  // namespace SwarmTalk
SwarmTalk::Swarmtalk swarmtalk_instance;
SwarmTalk::Led_control* LED_control = &swarmtalk_instance.led;
SwarmTalk::Motor_control* motor_control = &swarmtalk_instance.motor;
#endif

// Programs say `swarmtalk.new_channel(...)`, which is also the name of the core's namespace. From
// here on the word means the object; the core's headers have all been included above.
#define swarmtalk swarmtalk_instance
