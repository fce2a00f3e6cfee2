// Ghosts: a simulated swarm on the air of real robots, in real time. The simulation's own radio is
// off: what its robots send leaves as marked air frames, what others send comes to them from there.
// Single-threaded; owns the simulation, and the air for as long as it runs.
#pragma once

#include <sched.h>
#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <ctime>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <stdexcept>
#include <vector>

#include "frame/air_frame.hpp"
#include "lab/radio/lateness.hpp"
#include "suite/sim/ghost_air.hpp"
#include "suite/sim/simulated_run.hpp"

namespace swarmtalk::suite {

struct GhostSettings {
  std::string target;        // as join_air() takes it
  uint16_t first_id = 100;   // node id of the first ghost
  bool tells_misses = true;  // on standard error, every 10 s in which there were any
};

/// What became of packets and frames of ghosts.
struct GhostCounters {
  uint64_t frames_sent = 0;
  uint64_t frames_refused = 0;        // the air did not take them
  uint64_t frames_heard = 0;          // by each ghost
  uint64_t frames_unreadable = 0;     // sealed, damaged, of another version
  uint64_t frames_other_profile = 0;  // than the 9-byte packets that ghosts speak
  uint64_t packets_heard = 0;
  uint64_t packets_of_ghosts = 0;  // of those
};

template <class Robot, class Program>
class Ghosts {
 public:
  using Profile = typename Robot::Profile;

  Ghosts(const Scenario& scenario, sim::WorldConfig config, const GhostSettings& settings,
         std::FILE* log)
      : settings_(settings),
        air_(join_air(settings.target, config.radio.range_mm)),
        simulation_(scenario, without_radio(config), log, settings.first_id),
        seconds_(scenario.seconds),
        frames_(scenario.robots.size(), 0),
        places_(scenario.robots.size()),
        epoll_(epoll_create1(EPOLL_CLOEXEC)),
        timer_(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)) {
    std::random_device random;
    for (const Placement& place : scenario.robots) {
      air_->add(place.x_mm, place.y_mm);
      epochs_.push_back(random());
    }
    watch(air_->descriptor());
    watch(timer_);
  }
  ~Ghosts() {
    close(epoll_);
    close(timer_);
  }
  Ghosts(const Ghosts&) = delete;
  Ghosts& operator=(const Ghosts&) = delete;

  /// Runs until the scenario's end, or until `is_stopped` says so. @return seconds done
  template <class IsStopped>
  double run(IsStopped is_stopped) {
    come_first();
    start_us_ = monotonic_us();
    simulation_.start(
        [this](uint32_t ghost, std::span<const uint8_t> packet) { transmit(ghost, packet); });
    const uint64_t end_us = static_cast<uint64_t>(seconds_ * 1e6);
    std::array<epoll_event, 4> events{};
    while (clock_us() < end_us && !is_stopped()) {
      arm_timer();
      epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), kLongestWaitMs);
      simulation_.world().run_until(clock_us());
      air_->receive([this](uint32_t ghost, std::span<const uint8_t> bytes) { hear(ghost, bytes); });
      tell_places();
      tell_misses();
    }
    simulation_.finish();
    return static_cast<double>(clock_us()) / 1e6;
  }

  nlohmann::json report(double seconds) const {
    return {{"ghosts", frames_.size()},
            {"seconds", seconds},
            {"frames_sent", counters_.frames_sent},
            {"frames_refused", counters_.frames_refused},
            {"frames_heard", counters_.frames_heard},
            {"frames_unreadable", counters_.frames_unreadable},
            {"frames_other_profile", counters_.frames_other_profile},
            {"packets_heard", counters_.packets_heard},
            {"packets_of_ghosts", counters_.packets_of_ghosts},
            {"late",
             {{"limit_us", lab::radio::Lateness::kLateUs},
              {"events", lateness_.events()},
              {"late", lateness_.late()},
              {"p50_us", lateness_.within_us(0.5)},
              {"p99_us", lateness_.within_us(0.99)},
              {"worst_us", lateness_.worst_us()}}}};
  }

 private:
  static constexpr int kLongestWaitMs = 20;
  static constexpr uint64_t kLookAheadUs = 20000;
  static constexpr uint64_t kTellEveryUs = 10'000'000;
  static constexpr double kMovedMm = 1;

  static sim::WorldConfig without_radio(sim::WorldConfig config) {
    config.radio.range_mm = -1;
    config.radio.asymmetry = 0;
    return config;
  }

  static uint64_t monotonic_us() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return static_cast<uint64_t>(now.tv_sec) * 1000000 + static_cast<uint64_t>(now.tv_nsec) / 1000;
  }
  /// Before all other programs, where this user may: others' robots have a processor each.
  static void come_first() {
    sched_param parameter{};
    parameter.sched_priority = sched_get_priority_min(SCHED_RR);
    sched_setscheduler(0, SCHED_RR | SCHED_RESET_ON_FORK, &parameter);  // else as others, and late
  }

  uint64_t clock_us() const { return monotonic_us() - start_us_; }

  void watch(int fd) {
    epoll_event event{};
    event.events = EPOLLIN;
    if (epoll_ctl(epoll_, EPOLL_CTL_ADD, fd, &event) != 0) {
      throw std::runtime_error("out of descriptors");
    }
  }

  void arm_timer() {
    itimerspec when{};
    if (const auto next = simulation_.world().next_us(clock_us() + kLookAheadUs)) {
      const uint64_t at_us = start_us_ + *next;
      when.it_value.tv_sec = static_cast<time_t>(at_us / 1000000);
      when.it_value.tv_nsec = static_cast<long>(at_us % 1000000) * 1000;
    }
    timerfd_settime(timer_, TFD_TIMER_ABSTIME, &when, nullptr);
  }

  void transmit(uint32_t ghost, std::span<const uint8_t> packet) {
    lateness_.add(simulation_.world().now_us(), clock_us());
    const sim::Body& body = simulation_.world().body(ghost);
    frame::FrameHeader header;
    header.profile = frame::ProfileId::kKilobot;
    header.node = static_cast<uint16_t>(simulation_.world().node(ghost).node_id());
    header.epoch = epochs_[ghost];
    header.counter = ++frames_[ghost];
    header.pose =
        frame::FramePose::from_metres(body.x_mm / 1000, body.y_mm / 1000, body.theta_rad, 0);
    header.is_ghost = true;
    std::array<uint8_t, 128> buffer;
    frame::FrameWriter writer(buffer, header, buffer.size());
    writer.append(packet);
    ++(air_->send(ghost, writer.finish()) ? counters_.frames_sent : counters_.frames_refused);
  }

  void hear(uint32_t ghost, std::span<const uint8_t> bytes) {
    frame::Frame frame;
    ++counters_.frames_heard;
    if (frame::parse(bytes, frame) != frame::ParseResult::kOk) {
      ++counters_.frames_unreadable;
      return;
    }
    if (frame.header.profile != frame::ProfileId::kKilobot) {
      ++counters_.frames_other_profile;
      return;
    }
    const typename Profile::Sensing sensing = sense_transmitter(ghost, frame.header.pose);
    frame::PacketReader reader(frame.packets);
    for (std::span<const uint8_t> packet; reader.next(packet);) {
      ++counters_.packets_heard;
      counters_.packets_of_ghosts += frame.header.is_ghost;
      simulation_.world().hear(ghost, packet.data(), static_cast<uint16_t>(packet.size()), sensing);
    }
  }

  /// As a daemon takes it from the poses; unknown where there is none.
  typename Profile::Sensing sense_transmitter(uint32_t ghost,
                                              const std::optional<frame::FramePose>& pose) {
    typename Profile::Sensing sensing{};
    if (!pose || pose->is_stale()) {
      sensing.distance = -1;  // unknown
      return sensing;
    }
    const sim::Body& body = simulation_.world().body(ghost);
    sim::sense(sensing, std::hypot(pose->x_mm - body.x_mm, pose->y_mm - body.y_mm), 0);
    return sensing;
  }

  void tell_places() {
    for (uint32_t ghost = 0; ghost < places_.size(); ++ghost) {
      const sim::Body& body = simulation_.world().body(ghost);
      auto& [x_mm, y_mm] = places_[ghost];
      if (std::fabs(body.x_mm - x_mm) < kMovedMm && std::fabs(body.y_mm - y_mm) < kMovedMm) {
        continue;
      }
      x_mm = body.x_mm;
      y_mm = body.y_mm;
      air_->move(ghost, x_mm, y_mm);
    }
  }

  /// Missed deadlines are never hidden: whoever watches sees them while they happen.
  void tell_misses() {
    if (!settings_.tells_misses || clock_us() < tell_next_us_) return;
    tell_next_us_ = clock_us() + kTellEveryUs;
    const uint64_t late = lateness_.late();
    const uint64_t refused = counters_.frames_refused;
    if (late == told_late_ && refused == told_refused_) return;
    std::fprintf(stderr,
                 "swarmtalk-sim: %llu of %llu transmissions were more than %llu us late, the worst "
                 "by %llu us; %llu were refused\n",
                 static_cast<unsigned long long>(late),
                 static_cast<unsigned long long>(lateness_.events()),
                 static_cast<unsigned long long>(lab::radio::Lateness::kLateUs),
                 static_cast<unsigned long long>(lateness_.worst_us()),
                 static_cast<unsigned long long>(refused));
    told_late_ = late;
    told_refused_ = refused;
  }

  GhostSettings settings_;
  std::unique_ptr<GhostAir> air_;
  Simulation<Robot, Program> simulation_;
  double seconds_;
  std::vector<uint32_t> epochs_;
  std::vector<uint32_t> frames_;                   // sent, by ghost
  std::vector<std::pair<double, double>> places_;  // as the air was told, mm
  GhostCounters counters_;
  lab::radio::Lateness lateness_;
  uint64_t start_us_ = 0;
  uint64_t tell_next_us_ = kTellEveryUs;
  uint64_t told_late_ = 0;
  uint64_t told_refused_ = 0;
  int epoll_;
  int timer_;
};

}  // namespace swarmtalk::suite
