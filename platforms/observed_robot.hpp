// Any platform's robot with a Recorder between it and the program: the program is the same, and
// what it shows, logs, sends and receives is written down. Called on the robot's thread.
#pragma once

#include <cstdint>
#include <cstring>
#include <deque>

#include "platforms/recorder.hpp"

namespace swarmtalk::platforms {

template <class Inner>
class ObservedRobot : public Inner {
 public:
  using Profile = typename Inner::Profile;
  using Distance = typename Inner::Distance;
  class Node;

  /// @param inner...  what the platform's robot takes. It must offer time_us() and index().
  template <class... Arguments>
  explicit ObservedRobot(Recorder& recorder, Arguments&&... inner)
      : Inner(inner...), recorder_(recorder), node_(*this) {}
  ObservedRobot(const ObservedRobot&) = delete;
  ObservedRobot& operator=(const ObservedRobot&) = delete;

  Node& swarmtalk() { return node_; }

  void led(Colour colour) {
    if (!has_shown_ || std::memcmp(&colour, &shown_, sizeof colour) != 0) {
      recorder_.led(Inner::time_us(), Inner::index(), colour);
      shown_ = colour;
      has_shown_ = true;
    }
    Inner::led(colour);
  }

  /// Writes values down when they change.
  void log(const char* name, int32_t number) {
    for (Value& value : values_) {
      if (std::strcmp(value.name, name) != 0) continue;
      if (value.number == number) return;
      value.number = number;
      recorder_.value(Inner::time_us(), Inner::index(), name, number);
      return;
    }
    values_.push_back({name, number});
    recorder_.value(Inner::time_us(), Inner::index(), name, number);
  }

  /// The program starts anew.
  void forget() {
    node_.forget();
    values_.clear();
    has_shown_ = false;
  }

 private:
  struct Value {
    const char* name;
    int32_t number;
  };
  Recorder& recorder_;
  Node node_;
  Colour shown_ = kOff;
  bool has_shown_ = false;
  std::deque<Value> values_;
};

/// Stands for the node: hands out channels that tell the recorder.
template <class Inner>
class ObservedRobot<Inner>::Node {
  using InnerChannel =
      std::remove_reference_t<decltype(*any<Inner>().swarmtalk().new_channel(0, 0, false))>;
  using InnerPublisher = std::remove_reference_t<decltype(*any<InnerChannel>().new_publisher(
      static_cast<core::SentFn>(nullptr), nullptr))>;

 public:
  class Publisher {
   public:
    Publisher(ObservedRobot& robot, InnerPublisher* inner, uint32_t channel)
        : robot_(robot), inner_(inner), channel_(channel) {}
    core::Error send(const uint8_t* bytes, uint16_t size) {
      const core::Error error = inner_->send(bytes, size);
      if (error == core::Error::kOk) {
        robot_.recorder_.sent(robot_.time_us(), robot_.index(), channel_, size);
      }
      return error;
    }
    bool available() const { return inner_->available(); }

   private:
    ObservedRobot& robot_;
    InnerPublisher* inner_;
    uint32_t channel_;
  };

  class Channel {
   public:
    Channel(ObservedRobot& robot, InnerChannel* inner, uint32_t id)
        : robot_(robot), inner_(inner), id_(id) {}
    Publisher* new_publisher(core::SentFn sent, void* context) {
      publishers_.emplace_back(robot_, inner_->new_publisher(sent, context), id_);
      return &publishers_.back();
    }
    auto* new_subscriber(Distance max_distance, core::ReceiveFn<Profile> receive, void* context) {
      receive_ = receive;
      context_ = context;
      return inner_->new_subscriber(max_distance, &on_message, this);
    }

   private:
    static void on_message(void* self, const uint8_t* bytes, uint16_t size,
                           const core::Reception<Profile>& reception) {
      Channel& channel = *static_cast<Channel*>(self);
      ObservedRobot& robot = channel.robot_;
      robot.recorder_.received(robot.time_us(), robot.index(), channel.id_, reception.node,
                               reception.message, reception.sensing.distance);
      channel.receive_(channel.context_, bytes, size, reception);
    }
    ObservedRobot& robot_;
    InnerChannel* inner_;
    uint32_t id_;
    core::ReceiveFn<Profile> receive_ = nullptr;
    void* context_ = nullptr;
    std::deque<Publisher> publishers_;
  };

  explicit Node(ObservedRobot& robot) : robot_(robot) {}
  Channel* new_channel(uint32_t id, uint32_t ttl, bool timestamped) {
    Inner& inner = robot_;
    auto* channel = inner.swarmtalk().new_channel(id, ttl, timestamped);
    if (channel == nullptr) return nullptr;
    channels_.emplace_back(robot_, channel, id);
    return &channels_.back();
  }
  void forget() { channels_.clear(); }

 private:
  ObservedRobot& robot_;
  std::deque<Channel> channels_;
};

}  // namespace swarmtalk::platforms
