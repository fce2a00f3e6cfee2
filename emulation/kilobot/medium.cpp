#include "emulation/kilobot/medium.hpp"

#include <cmath>

namespace swarmtalk::emulator {
namespace {

// The overhead controller shines from above with many LEDs; its distance means nothing.
constexpr SignalStrength kFromAbove{1000, 800};
constexpr SignalStrength kOwnLight{kConverterMax, kConverterMax};

}  // namespace

Medium::Medium(const MediumSettings& settings)
    : settings_(settings), chance_(settings.seed, 1), stray_chance_(settings.seed, 2) {}

unsigned Medium::add_station(const Placement& placement, LightSink* sink) {
  Station station;
  station.placement = placement;
  station.sink = sink;
  if (sink != nullptr && settings_.stray_pulses_per_s > 0) station.next_stray_ns = stray_gap_ns();
  stations_.push_back(std::move(station));
  for (Station& other : stations_) other.is_stale = true;
  return static_cast<unsigned>(stations_.size() - 1);
}

void Medium::move(unsigned station, double x_mm, double y_mm) {
  stations_[station].placement.x_mm = x_mm;
  stations_[station].placement.y_mm = y_mm;
  for (Station& other : stations_) other.is_stale = true;
}

void Medium::find_paths(unsigned sender) {
  Station& from = stations_[sender];
  const std::vector<Path> before = std::move(from.paths);
  from.paths.clear();
  const bool is_above = from.placement.reach_mm > 0;
  const double reach_mm = is_above ? from.placement.reach_mm : settings_.range_mm;
  for (unsigned to = 0; to < stations_.size(); ++to) {
    const Station& receiver = stations_[to];
    if (receiver.sink == nullptr || (to == sender && !settings_.hears_itself)) continue;
    const double distance_mm = std::hypot(from.placement.x_mm - receiver.placement.x_mm,
                                          from.placement.y_mm - receiver.placement.y_mm);
    if (distance_mm > reach_mm) continue;
    Path path;
    path.to = to;
    path.strength = to == sender ? kOwnLight : is_above ? kFromAbove : signal_at(distance_mm);
    for (const Path& old : before)
      if (old.to == to) path.loses_frame = old.loses_frame;
    from.paths.push_back(path);
  }
  from.is_stale = false;
}

void Medium::follow_frame(unsigned sender, std::uint64_t time_ns) {
  Station& from = stations_[sender];
  switch (from.decoder.on_pulse(time_ns)) {
    case FrameDecoder::Event::kFrameStart:
      ++from.counters.started;
      from.frame_start_ns = time_ns;
      for (Path& path : from.paths) {
        path.loses_frame = path.to != sender && chance_.happens(settings_.loss);
        from.counters.lost += path.loses_frame ? 1 : 0;
      }
      break;
    case FrameDecoder::Event::kMessage:
      ++from.counters.frames;
      if (on_message) on_message(sender, from.frame_start_ns, from.decoder.message());
      break;
    case FrameDecoder::Event::kNone:
    case FrameDecoder::Event::kBroken:
      break;
  }
}

void Medium::switch_light(unsigned sender, std::uint64_t time_ns, bool is_on) {
  Station& from = stations_[sender];
  if (from.is_on == is_on) return;
  from.is_on = is_on;
  if (is_on) {
    if (from.is_stale) find_paths(sender);
    follow_frame(sender, time_ns);
  }
  const std::uint64_t arrival_ns = time_ns + settings_.delay_ns;
  for (Path& path : from.paths) {
    if (is_on) {
      if (path.loses_frame || chance_.happens(settings_.pulse_loss)) continue;
      path.lit_with = path.strength;
    } else if (!path.is_lit) {
      continue;
    }
    path.is_lit = is_on;
    stations_[path.to].sink->on_light(arrival_ns, path.lit_with, is_on);
  }
}

std::uint64_t Medium::stray_gap_ns() {
  return static_cast<std::uint64_t>(-std::log(1.0 - stray_chance_.unit()) * 1e9 /
                                    settings_.stray_pulses_per_s) +
         kIrPulseNs;
}

void Medium::advance(std::uint64_t until_ns) {
  if (settings_.stray_pulses_per_s <= 0) return;
  for (Station& station : stations_)
    while (station.next_stray_ns < until_ns) {
      const std::uint64_t arrival_ns = station.next_stray_ns + settings_.delay_ns;
      const SignalStrength strength = signal_at(kRobotDiameterMm + stray_chance_.below(60));
      station.sink->on_light(arrival_ns, strength, true);
      station.sink->on_light(arrival_ns + kIrPulseNs, strength, false);
      station.next_stray_ns += stray_gap_ns();
    }
}

}  // namespace swarmtalk::emulator
