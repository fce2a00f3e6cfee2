#include "lab/radio/radio_server.hpp"

#include <sched.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "lab/radio/radio_control.hpp"

namespace swarmtalk::lab::radio {
namespace {

constexpr std::uint64_t kLookAheadUs = 20000;
// A process that slept is woken within about this time of a frame.
constexpr std::uint64_t kWakeUs = 200;
constexpr int kFramesPerTurn = 64;
constexpr int kNice = -10;
// Where a ghost is that has gone, or has not told its place: out of everybody's reach.
constexpr double kNowhereMm = 1e9;

std::uint64_t monotonic_us() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::uint64_t>(now.tv_sec) * 1000000 +
         static_cast<std::uint64_t>(now.tv_nsec) / 1000;
}

/// Before all programs of the lab, where this user may; a child would not inherit it.
std::string come_first() {
  prctl(PR_SET_TIMERSLACK, 1);
  sched_param parameter{};
  parameter.sched_priority = sched_get_priority_min(SCHED_RR);
  if (sched_setscheduler(0, SCHED_RR | SCHED_RESET_ON_FORK, &parameter) == 0) return "real time";
  if (setpriority(PRIO_PROCESS, 0, kNice) == 0) return "nice " + std::to_string(kNice);
  return "as others";
}

int next_signal(int signal_fd) {
  signalfd_siginfo signal{};
  return read(signal_fd, &signal, sizeof signal) > 0 ? static_cast<int>(signal.ssi_signo) : 0;
}

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * 1e-6;
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

RadioServer::RadioServer(const sim::WifiAirConfig& air, const std::string& control_path,
                         std::uint64_t seed)
    : start_us_(monotonic_us()),
      epoll_(epoll_create1(EPOLL_CLOEXEC)),
      timer_(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)),
      control_(control_path),
      door_(ghost_door_of(control_path)),
      air_(air, seed,
           {[this](std::uint32_t, std::uint32_t to, std::span<const std::uint8_t> frame) {
              return ports_[to] != nullptr && ports_[to]->write(frame);
            },
            [this](std::uint32_t, std::uint64_t at_us) { lateness_.add(at_us, clock_us()); }}),
      random_(seed + 1) {
  if (epoll_ < 0 || timer_ < 0) throw std::runtime_error("the medium is out of descriptors");
  watch(timer_, kTimer);
  watch(control_.descriptor(), kControl);
  watch(door_.descriptor(), kDoor);
}

RadioServer::~RadioServer() {
  close(epoll_);
  close(timer_);
}

std::uint64_t RadioServer::clock_us() const {
  return monotonic_us() - start_us_;
}

void RadioServer::watch(int fd, std::uint32_t tag) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.u32 = tag;
  if (epoll_ctl(epoll_, EPOLL_CTL_ADD, fd, &event) != 0) {
    throw std::runtime_error("the medium is out of descriptors");
  }
}

void RadioServer::add(std::unique_ptr<Port> port, double x_m, double y_m) {
  const std::uint32_t station = air_.add(x_m * 1000, y_m * 1000);
  watch(port->descriptor(), kFirstPort + station);
  ports_.push_back(std::move(port));
  robots_ = air_.size();
}

void RadioServer::let_ghosts_in() {
  while (std::unique_ptr<GhostPort> port = door_.accept()) {
    if (free_.empty() && air_.size() - robots_ >= kMostGhosts) continue;  // turned away
    std::uint32_t station = air_.size();
    if (free_.empty()) {
      air_.add(kNowhereMm, kNowhereMm);
      ports_.push_back(nullptr);
      is_placed_.push_back(false);
    } else {
      station = free_.back();
      free_.pop_back();
    }
    watch(port->descriptor(), kFirstPort + station);
    ports_[station] = std::move(port);
  }
}

void RadioServer::place_ghost(std::uint32_t station, std::span<const std::uint8_t> packet) {
  const auto place =
      read_ghost_place({reinterpret_cast<const char*>(packet.data()), packet.size()});
  if (!place) return let_ghost_out(station);
  air_.move(station, place->x_m * 1000, place->y_m * 1000);
  if (is_placed_[station - robots_]) return;
  is_placed_[station - robots_] = true;
  const std::string told =
      nlohmann::json{{"robot", station + 1}, {"header_bytes", air_.config().header_bytes}}.dump();
  ports_[station]->write({reinterpret_cast<const std::uint8_t*>(told.data()), told.size()});
}

// Its station stays for the next one: who it was is in the counters of others.
void RadioServer::let_ghost_out(std::uint32_t station) {
  epoll_ctl(epoll_, EPOLL_CTL_DEL, ports_[station]->descriptor(), nullptr);
  air_.move(station, kNowhereMm, kNowhereMm);
  is_placed_[station - robots_] = false;
  ports_[station].reset();
  free_.push_back(station);
}

void RadioServer::arm_timer() {
  itimerspec when{};
  if (const auto next = air_.next_event_us(air_.now_us() + kLookAheadUs)) {
    const std::uint64_t at_us = start_us_ + *next;
    when.it_value.tv_sec = static_cast<time_t>(at_us / 1000000);
    when.it_value.tv_nsec = static_cast<long>(at_us % 1000000) * 1000;
  }
  // Setting it also takes back that it was readable.
  timerfd_settime(timer_, TFD_TIMER_ABSTIME, &when, nullptr);  // all 0: switched off
}

int RadioServer::run(const sigset_t& signals) {
  const int signal_fd = signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
  if (signal_fd < 0) throw std::runtime_error("the medium is out of descriptors");
  watch(signal_fd, kSignal);
  scheduling_ = come_first();
  std::array<epoll_event, 64> events{};
  int ended_by = 0;
  while (ended_by == 0) {
    arm_timer();
    const std::uint64_t asleep_us = clock_us();
    const int count = epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), -1);
    const std::uint64_t now_us = clock_us();
    // While this process slept no frame waited for it; while it worked any may have come.
    const bool has_slept = now_us - asleep_us > kWakeUs;
    const std::uint64_t since_us = has_slept ? now_us - kWakeUs : air_.now_us();
    bool is_asked = false;
    for (int i = 0; i < count; ++i) {
      const std::uint32_t tag = events[static_cast<std::size_t>(i)].data.u32;
      if (tag >= kFirstPort) read_port(tag - kFirstPort, since_us, now_us);
      if (tag == kSignal) ended_by = next_signal(signal_fd);
      is_asked |= tag == kControl;
      if (tag == kDoor) let_ghosts_in();
    }
    offer_arrivals();
    air_.run(std::max(now_us, air_.now_us()));
    if (is_asked) answer_requests();
  }
  close(signal_fd);
  return ended_by;
}

void RadioServer::read_port(std::uint32_t station, std::uint64_t since_us, std::uint64_t now_us) {
  std::array<std::uint8_t, kMaxFrameBytes> buffer;
  const std::size_t first = arrivals_.size();
  const bool is_ghost = station >= robots_;
  for (int frames = 0; frames < kFramesPerTurn && ports_[station] != nullptr; ++frames) {
    const std::size_t size = ports_[station]->read(buffer);
    if (size == 0) break;
    if (is_ghost && buffer[0] == '{') {
      place_ghost(station, std::span(buffer).first(size));
      continue;
    }
    if (is_ghost && !is_placed_[station - robots_]) continue;
    const double share = random_.uniform();
    const auto at_us =
        since_us + static_cast<std::uint64_t>(share * static_cast<double>(now_us - since_us));
    arrivals_.push_back({at_us, station, {buffer.begin(), buffer.begin() + size}});
  }
  if (is_ghost && ports_[station] != nullptr && ports_[station]->is_gone()) let_ghost_out(station);
  // One robot's frames keep their order.
  std::vector<std::uint64_t> moments;
  for (std::size_t i = first; i < arrivals_.size(); ++i) moments.push_back(arrivals_[i].at_us);
  std::sort(moments.begin(), moments.end());
  for (std::size_t i = first; i < arrivals_.size(); ++i) arrivals_[i].at_us = moments[i - first];
}

void RadioServer::offer_arrivals() {
  std::stable_sort(arrivals_.begin(), arrivals_.end(),
                   [](const Arrival& a, const Arrival& b) { return a.at_us < b.at_us; });
  for (const Arrival& arrival : arrivals_) {
    air_.offer(arrival.station, arrival.frame, std::max(arrival.at_us, air_.now_us()));
  }
  arrivals_.clear();
}

void RadioServer::answer_requests() {
  control_.serve([this](std::string_view request) {
    std::uint64_t before = 0;
    for (const auto& port : ports_) before += port != nullptr ? port->dropped_frames() : 0;
    nlohmann::json ghosts = nlohmann::json::array();
    for (std::uint32_t station = robots_; station < air_.size(); ++station) {
      if (is_placed_[station - robots_]) ghosts.push_back(station + 1);
    }
    const nlohmann::json status = {{"pid", getpid()},
                                   {"real", robots_},
                                   {"ghosts", ghosts},
                                   {"scheduling", scheduling_},
                                   {"cpu_s", cpu_seconds()},
                                   {"late",
                                    {{"limit_us", Lateness::kLateUs},
                                     {"events", lateness_.events()},
                                     {"late", lateness_.late()},
                                     {"p50_us", lateness_.within_us(0.5)},
                                     {"p99_us", lateness_.within_us(0.99)},
                                     {"worst_us", lateness_.worst_us()}}},
                                   {"lost", {{"interface", before}}}};
    return answer(air_, status, request);
  });
}

}  // namespace swarmtalk::lab::radio
