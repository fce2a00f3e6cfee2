// News: a few robots tell something new from time to time, and all that the TTL reaches are to hear
// of it. What a swarm's settings do to flooded messages (sizes, memory, TTL, copies) is seen here
// and in none of the paper's programs, whose messages go one hop. Who hears checks every byte, so
// a message that was put together from two is noticed.
#pragma once

#include <stdint.h>

#include "platforms/robot.hpp"

namespace swarmtalk {
namespace suite {

enum class NewsRole : uint8_t { kListener, kTeller };

constexpr uint8_t kMostNewsBytes = 64;

struct NewsSettings {
  uint8_t bytes = 5;            // of a message, 3 to kMostNewsBytes
  uint8_t ttl = 15;             // what the profile's field holds
  uint8_t copies = 0;           // a teller sends each message so often again
  uint16_t period_ticks = 153;  // 5 s between two news of a teller
};

template <class Robot>
class News {
  static_assert(platforms::CheckedRobot<Robot>::kIsSound, "");

 public:
  static constexpr uint8_t kChannel = 0;

  /// @param number  the robot's own; stands in what it tells
  News(Robot& robot, NewsRole role, uint16_t number)
      : robot_(robot), role_(role), number_(number) {}

  /// Before setup().
  void set(const NewsSettings& settings) { settings_ = settings; }

  void setup() {
    auto* channel = robot_.swarmtalk().new_channel(kChannel, settings_.ttl, false);
    publisher_ = channel->new_publisher(&on_sent, this);
    channel->new_subscriber(Robot::distance(kAnywhereMm), &on_message, this);
    due_ = static_cast<uint16_t>(now() + robot_.random() % settings_.period_ticks);
  }

  void loop() {
    if (role_ != NewsRole::kTeller || static_cast<uint16_t>(now() - due_) >= 0x8000) return;
    due_ = static_cast<uint16_t>(due_ + settings_.period_ticks);
    ++story_;
    copies_left_ = settings_.copies;
    robot_.log("told", key(number_, story_));
    tell();
  }

 private:
  using Profile = typename Robot::Profile;
  static constexpr int32_t kAnywhereMm = 30000;

  uint16_t now() { return static_cast<uint16_t>(robot_.clock()); }
  static int32_t key(uint16_t number, uint8_t story) {
    return static_cast<int32_t>(number) * 256 + story;
  }
  /// What byte `i` of a message has to be.
  static uint8_t byte(uint16_t number, uint8_t story, uint8_t i) {
    if (i == 0) return story;
    if (i == 1) return static_cast<uint8_t>(number);
    if (i == 2) return static_cast<uint8_t>(number >> 8);
    return static_cast<uint8_t>(story * 31 + number * 7 + i * 13);
  }

  void tell() {
    uint8_t message[kMostNewsBytes];
    for (uint8_t i = 0; i < settings_.bytes; ++i) message[i] = byte(number_, story_, i);
    // Busy: the news before has not left, so this one is never heard of, and counts as that.
    if (publisher_->send(message, settings_.bytes) != core::Error::kOk) {
      copies_left_ = 0;
      robot_.log("unsent", key(number_, story_));
    }
  }

  static void on_sent(void* self) {
    News& me = *static_cast<News*>(self);
    if (me.copies_left_ == 0) return;
    --me.copies_left_;
    me.tell();
  }

  static void on_message(void* self, const uint8_t* bytes, uint16_t size,
                         const core::Reception<Profile>&) {
    News& me = *static_cast<News*>(self);
    const uint16_t number =
        size < 3 ? 0 : static_cast<uint16_t>(bytes[1] | static_cast<uint16_t>(bytes[2]) << 8);
    bool is_right = size >= me.settings_.bytes;
    for (uint8_t i = 3; is_right && i < me.settings_.bytes; ++i) {
      is_right = bytes[i] == byte(number, bytes[0], i);
    }
    if (is_right) {
      me.robot_.log("heard", key(number, bytes[0]));
    } else {
      me.robot_.log("spliced", ++me.spliced_);
    }
  }

  Robot& robot_;
  platforms::PublisherPointer<Robot> publisher_;
  NewsSettings settings_;
  NewsRole role_;
  uint16_t number_;
  uint16_t due_;
  uint16_t spliced_ = 0;
  uint8_t story_ = 0;
  uint8_t copies_left_ = 0;
};

}  // namespace suite
}  // namespace swarmtalk
