// A program joined with a robot in ARGoS, at compile time: what a module consists of. The program
// is a template over Robot and takes the robot, or the robot and its role (an enum), or both and
// its number.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>

#include "platforms/argos/argos_robot.hpp"
#include "platforms/argos/outbox.hpp"
#include "platforms/argos/stepped_robot.hpp"
#include "platforms/observed_robot.hpp"

namespace swarmtalk::platforms::in_argos {

/// A file in memory that is read and emptied again and again.
class LineBuffer {
 public:
  LineBuffer() = default;
  LineBuffer(const LineBuffer&) = delete;
  LineBuffer& operator=(const LineBuffer&) = delete;
  ~LineBuffer() {
    if (file_ != nullptr) std::fclose(file_);
    std::free(text_);
  }

  std::FILE* open() {
    file_ = open_memstream(&text_, &size_);
    return file_;
  }
  std::string take() {
    if (file_ == nullptr) return "";
    const long size = std::ftell(file_);
    if (size <= 0) return "";
    std::fflush(file_);
    std::string lines(text_, static_cast<size_t>(size));
    std::rewind(file_);
    return lines;
  }

 private:
  char* text_ = nullptr;
  size_t size_ = 0;
  std::FILE* file_ = nullptr;
};

/// Becomes whatever enum a program has for its role.
struct AnyRole {
  int number;
  template <class Role, class = std::enable_if_t<std::is_enum_v<Role>>>
  operator Role() const {
    return static_cast<Role>(number);
  }
};

template <class Model, template <class> class Program>
class Joined final : public SteppedRobot {
 public:
  using Plain = ArgosRobot<Model>;
  using Robot = ObservedRobot<Plain>;

  explicit Joined(const Settings& settings)
      : settings_(settings),
        recorder_(nullptr),
        robot_(recorder_, settings),
        outbox_(robot_.Plain::swarmtalk(), robot_.first_step(), robot_.generator()) {}

  const char* platform() const override { return Model::kPlatform; }
  uint32_t index() const override { return settings_.index; }

  void begin(uint64_t step, bool was_sent) override {
    step_ = step;
    robot_.poll(step);
    if (was_sent) outbox_.sent(step);
    if (!program_ && is_on()) {
      make();
      program_->setup();
      recorder_.event(robot_.time_us(), index(), "\"event\":\"start\",\"node\":%u", node_id());
    }
  }
  void hear(const uint8_t* bytes, uint16_t size, double distance_mm, double bearing_rad) override {
    if (is_on())
      node().on_packet(bytes, size, Model::sensing(clamped_mm(distance_mm), bearing_rad));
  }
  void run() override {
    if (!is_on()) return;
    program_->loop();
    outbox_.step(step_);
  }

  const Wheels& wheels() const override { return robot_.wheels(); }
  Colour colour() const override { return robot_.colour(); }
  uint16_t packet_bytes() const override { return outbox_.size(); }
  const uint8_t* packet() const override { return outbox_.bytes(); }

  void start_log() override { recorder_ = Recorder(lines_.open()); }
  std::string take_log() override { return lines_.take(); }
  void log_pose(double x_mm, double y_mm, double theta_rad) override {
    recorder_.pose(robot_.time_us(), index(), x_mm, y_mm, theta_rad);
  }
  void log_end(uint64_t contacts) override {
    const auto& counters = node().counters();
    recorder_.event(robot_.time_us(), index(),
                    "\"event\":\"end\",\"node\":%u,\"contacts\":%llu,\"packets_sent\":%lu,"
                    "\"packets_received\":%lu,\"bad\":%lu,\"no_memory\":%lu,\"aged_out\":%lu",
                    node_id(), static_cast<unsigned long long>(contacts),
                    static_cast<unsigned long>(counters.packets_sent),
                    static_cast<unsigned long>(counters.packets_received),
                    static_cast<unsigned long>(counters.bad_packets + counters.bad_checksums),
                    static_cast<unsigned long>(counters.no_memory),
                    static_cast<unsigned long>(counters.aged_out));
  }

 private:
  using Made = Program<Robot>;

  bool is_on() const { return step_ >= robot_.first_step(); }
  typename Plain::Node& node() { return robot_.Plain::swarmtalk(); }
  unsigned node_id() { return static_cast<unsigned>(node().node_id()); }

  void make() {
    const AnyRole role{settings_.role};
    const auto number = static_cast<uint8_t>(settings_.index % 255);
    if constexpr (std::is_constructible_v<Made, Robot&, AnyRole, uint8_t>) {
      program_.emplace(robot_, role, number);
    } else if constexpr (std::is_constructible_v<Made, Robot&, AnyRole>) {
      program_.emplace(robot_, role);
    } else {
      static_assert(std::is_constructible_v<Made, Robot&>,
                    "a program is made from its robot; or robot and role, an enum; or robot, role "
                    "and number, a uint8_t");
      program_.emplace(robot_);
    }
  }

  Settings settings_;
  LineBuffer lines_;
  Recorder recorder_;
  Robot robot_;
  Outbox<typename Model::Profile> outbox_;
  uint64_t step_ = 0;
  std::optional<Made> program_;
};

/// A module's MakeRobot.
template <class Model, template <class> class Program>
std::unique_ptr<SteppedRobot> make_joined(const Settings& settings) {
  return std::make_unique<Joined<Model, Program>>(settings);
}

}  // namespace swarmtalk::platforms::in_argos
