// A robot whose radio belongs to swarmtalkd, as programs see it (platforms/robot.hpp): the node is
// the daemon's, reached through the client library; LED and wheels are reached at a socket. Who
// tracks the robot tells the daemon its pose. One per process; main thread.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <deque>
#include <memory>
#include <string>
#include <swarmtalk/client.hpp>

#include "platforms/coachbot/body_port.hpp"
#include "platforms/robot.hpp"
#include "platforms/sim/world_robot.hpp"

namespace swarmtalk::platforms {

class DaemonRobot {
 public:
  using Profile = ComparedProfile;
  using Distance = Profile::Sensing::Distance;
  using Model = CoachbotModel;
  class Node;
  static constexpr uint16_t kBodyMm = Model::kBodyMm;
  static constexpr uint16_t kSpeedMmPerS = Model::kSpeedMmPerS;
  static constexpr uint16_t kTurnDegPerS = Model::kTurnDegPerS;
  static constexpr uint32_t kTicksPerSecond = 31;

  /// @param seed  of the program's random numbers
  inline DaemonRobot(Client& client, BodyPort& body, uint32_t index, uint64_t seed);
  DaemonRobot(const DaemonRobot&) = delete;
  DaemonRobot& operator=(const DaemonRobot&) = delete;
  ~DaemonRobot();

  Node& swarmtalk() { return *node_; }
  uint32_t clock() const { return static_cast<uint32_t>(time_us() / sim::kTickUs); }
  uint32_t random() { return static_cast<uint32_t>(random_.bits() >> 32); }
  static Distance distance(int32_t mm) { return static_cast<Distance>(mm); }
  inline void led(Colour colour);
  void forward(uint32_t ticks) { move(1, 1, ticks); }
  void left(uint32_t ticks) { move(Model::kTurnBack, 1, ticks); }
  void right(uint32_t ticks) { move(1, Model::kTurnBack, ticks); }
  void stop() { move(0, 0, 0); }
  bool is_moving() const { return left_ != 0 || right_ != 0; }
  void log(const char*, int32_t) {}

  /// Ends timed moves, and repeats the others before the body stops by itself. Call it before each
  /// loop() of the program.
  inline void poll();

  uint32_t index() const { return index_; }
  /// Of the system's monotonic clock, which all robots of one machine share.
  static uint64_t time_us() {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    return static_cast<uint64_t>(
        std::chrono::duration_cast<std::chrono::microseconds>(now).count());
  }
  /// Messages that were lost on the way to this robot's program, by place.
  const Loss& lost() const { return lost_; }

 private:
  inline void move(double left, double right, uint32_t ticks);

  static constexpr uint64_t kRepeatUs = kBodyStopsUs / 4;

  Client& client_;
  BodyPort& body_;
  uint32_t index_;
  sim::Random random_;
  Colour shown_ = kOff;
  double left_ = 0;
  double right_ = 0;
  uint64_t driven_us_ = 0;  // when the body was told last
  uint32_t since_ = 0;
  uint32_t for_ticks_ = 0;
  Loss lost_;
  std::unique_ptr<Node> node_;
};

/// Stands for the node in the daemon: channels, publishers and subscribers as the core has them.
class DaemonRobot::Node {
 public:
  class Publisher {
   public:
    /// kBusy for whatever the core has no word for; Client::on_error tells what it was.
    core::Error send(const uint8_t* bytes, uint16_t size) {
      const Status status = inner_.send(Bytes(bytes, size));
      if (status) return core::Error::kOk;
      return status.code() == StatusCode::kTooLong ? core::Error::kTooLong : core::Error::kBusy;
    }
    bool available() const { return !inner_.busy(); }

   private:
    friend class Node;
    swarmtalk::Publisher inner_;
  };

  class Channel {
   public:
    Channel(DaemonRobot& robot, swarmtalk::Channel inner)
        : robot_(robot), inner_(std::move(inner)) {}
    Publisher* new_publisher(core::SentFn sent, void* context) {
      publishers_.emplace_back();
      const auto tell = [sent, context](const Status&) {
        if (sent != nullptr) sent(context);
      };
      publishers_.back().inner_ = inner_.publisher(tell, Sending::one_at_a_time());
      return &publishers_.back();
    }
    Subscriber* new_subscriber(Distance max_distance_mm, core::ReceiveFn<Profile> receive,
                               void* context) {
      DaemonRobot& robot = robot_;
      subscribers_.push_back(inner_.subscriber(
          [&robot, receive, context](const Message& message) {
            robot.node_->deliver(message, receive, context);
          },
          Policy::last(64).within(static_cast<float>(max_distance_mm) / 1000)));
      return &subscribers_.back();
    }

   private:
    DaemonRobot& robot_;
    swarmtalk::Channel inner_;
    std::deque<Publisher> publishers_;
    std::deque<Subscriber> subscribers_;
  };

  explicit Node(DaemonRobot& robot) : robot_(robot) {}
  Channel* new_channel(uint32_t id, uint32_t ttl, bool timestamped) {
    channels_.emplace_back(
        robot_, robot_.client_.channel(static_cast<int>(id), ChannelOptions{ttl, timestamped}));
    return &channels_.back();
  }

 private:
  void deliver(const Message& message, core::ReceiveFn<Profile> receive, void* context) {
    robot_.lost_ += message.lost_before;
    if (message.local) return;
    using Wire = core::Wire<Profile>;
    core::Reception<Profile> reception{};
    reception.node = static_cast<Wire::NodeId>(message.sender);
    reception.message = static_cast<Wire::MessageNumber>(message.message_number);
    reception.ttl = static_cast<uint8_t>(message.ttl);
    reception.sensing.distance =
        message.has_distance() ? static_cast<Distance>(std::lround(message.distance_m * 1000)) : -1;
    if (message.buffering_delay) {
      reception.has_delay = true;
      const auto ticks = message.buffering_delay->count() / sim::kTickUs;
      reception.delay_ticks =
          static_cast<Wire::Timestamp>(std::min<int64_t>(ticks, Wire::kTimestampMax));
    }
    receive(context, message.bytes().data(), static_cast<uint16_t>(message.payload.size()),
            reception);
  }

  DaemonRobot& robot_;
  std::deque<Channel> channels_;
};

inline DaemonRobot::DaemonRobot(Client& client, BodyPort& body, uint32_t index, uint64_t seed)
    : client_(client),
      body_(body),
      index_(index),
      random_(sim::mix(seed) + index),
      node_(std::make_unique<Node>(*this)) {
  body_.led(shown_);
}

inline DaemonRobot::~DaemonRobot() {
  body_.drive(0, 0);
}

inline void DaemonRobot::led(Colour colour) {
  if (std::memcmp(&colour, &shown_, sizeof colour) == 0) return;
  shown_ = colour;
  body_.led(colour);
}

inline void DaemonRobot::move(double left, double right, uint32_t ticks) {
  left_ = left;
  right_ = right;
  since_ = clock();
  for_ticks_ = ticks;
  driven_us_ = time_us();
  body_.drive(left, right);
}

inline void DaemonRobot::poll() {
  if (!is_moving()) return;
  if (for_ticks_ != 0 && clock() - since_ >= for_ticks_) {
    stop();
  } else if (time_us() - driven_us_ >= kRepeatUs) {
    driven_us_ = time_us();
    body_.drive(left_, right_);
  }
}

}  // namespace swarmtalk::platforms
