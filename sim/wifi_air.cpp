#include "sim/wifi_air.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace swarmtalk::sim {
namespace {

constexpr uint32_t kPreambleUs = 20;  // with the header that tells rate and length
constexpr uint32_t kSymbolUs = 4;
constexpr std::size_t kServiceAndTailBits = 16 + 6;
constexpr std::size_t kMacHeaderBytes = 24 + 8 + 4;  // MAC, LLC and SNAP, FCS
constexpr std::size_t kAnswerBytes = 14;             // of an ACK, by which EIFS is reckoned

uint32_t time_of_us(const WifiRate& rate, std::size_t bytes) {
  const std::size_t bits = kServiceAndTailBits + 8 * bytes;
  const std::size_t symbols = (bits + rate.bits_per_symbol - 1) / rate.bits_per_symbol;
  return kPreambleUs + kSymbolUs * static_cast<uint32_t>(symbols);
}

const WifiRate& rate_of(uint32_t mbps) {
  for (const WifiRate& rate : wifi_rates()) {
    if (rate.mbps == mbps) return rate;
  }
  throw std::invalid_argument("no rate of " + std::to_string(mbps) + " Mb/s");
}

WifiSpaces spaces_of(const WifiAirConfig& config) {
  const uint32_t difs_us = config.sifs_us + 2 * config.slot_us;
  const uint32_t answer_us = time_of_us(wifi_rates().front(), kAnswerBytes);
  return {config.slot_us, difs_us, config.sifs_us + answer_us + difs_us};
}

}  // namespace

const std::vector<WifiRate>& wifi_rates() {
  static const std::vector<WifiRate> rates{{6, 24, 0},    {9, 36, 1},   {12, 48, 3},
                                           {18, 72, 5},   {24, 96, 8},  {36, 144, 12},
                                           {48, 192, 16}, {54, 216, 17}};
  return rates;
}

const std::vector<WifiAirLoss>& wifi_air_losses() {
  using C = WifiAirCounters;
  static const std::vector<WifiAirLoss> losses{
      {"range", &C::lost_range, "too far away"},
      {"collision", &C::lost_collision, "another frame was on the air at the receiver"},
      {"sending", &C::lost_sending, "half duplex: the receiver was sending itself"},
      {"loss", &C::lost_noise, "the loss of the whole medium (--loss)"},
      {"link", &C::lost_link, "the loss of this link alone (link A B --loss)"},
      {"jam", &C::lost_jam, "the receiver was in a jammer's circle"},
      {"partition", &C::lost_partition, "the two are parted"},
      {"receiver", &C::lost_receiver, "the receiver's interface was down or did not take it"}};
  return losses;
}

uint32_t wifi_air_time_us(const WifiRate& rate, std::size_t payload_bytes) {
  return time_of_us(rate, payload_bytes + kMacHeaderBytes);
}

WifiAir::WifiAir(const WifiAirConfig& config, uint64_t seed, Hooks hooks)
    : config_(config),
      rate_(rate_of(config.rate_mbps)),
      hooks_(std::move(hooks)),
      random_(seed),
      power_(config, rate_),
      spaces_(spaces_of(config)),
      grid_(power_.reach_mm()) {}

uint32_t WifiAir::add(double x_mm, double y_mm) {
  const uint32_t index = size();
  Station& station = stations_.emplace_back();
  station.body.x_mm = x_mm;
  station.body.y_mm = y_mm;
  grid_.add(index, x_mm, y_mm);
  return index;
}

void WifiAir::move(uint32_t station, double x_mm, double y_mm) {
  Body& body = stations_[station].body;
  body.x_mm = x_mm;
  body.y_mm = y_mm;
  grid_.move(station, x_mm, y_mm);
}

void WifiAir::set_link_loss(uint32_t from, uint32_t to, std::optional<double> loss) {
  if (loss) {
    link_loss_[{from, to}] = *loss;
  } else {
    link_loss_.erase({from, to});
  }
}

std::optional<double> WifiAir::link_loss(uint32_t from, uint32_t to) const {
  const auto found = link_loss_.find({from, to});
  if (found == link_loss_.end()) return std::nullopt;
  return found->second;
}

bool WifiAir::is_in_range(uint32_t from, uint32_t to) const {
  return power_.is_received(power_.between(stations_[from].body, stations_[to].body));
}

double WifiAir::margin_db(uint32_t from, uint32_t to) const {
  return power_.margin_db(power_.between(stations_[from].body, stations_[to].body));
}

bool WifiAir::are_parted(const Station& a, const Station& b) const {
  return a.group != b.group || interference_.parts(a.body, b.body, now_us_);
}

void WifiAir::count(uint32_t station, Loss what, uint64_t by) {
  total_.*what += by;
  stations_[station].counters.*what += by;
}

void WifiAir::push(uint64_t at_us, uint32_t station, Kind kind) {
  queue_.push(at_us, station << kKindBits | kind);
  ++waiting_events_;
}

void WifiAir::run(uint64_t end_us) {
  Event event{};
  while (queue_.pop(end_us, event)) {
    --waiting_events_;
    now_us_ = event.at_us;
    const uint32_t index = event.what >> kKindBits;
    switch (event.what & ((1U << kKindBits) - 1)) {
      case kAccess:
        access(index);
        break;
      case kDetect:
        detect(index);
        break;
      default:
        end_transmission(index);
        break;
    }
  }
  now_us_ = end_us;
}

std::optional<uint64_t> WifiAir::next_event_us(uint64_t end_us) {
  if (waiting_events_ == 0) return std::nullopt;
  return queue_.next_us(end_us);
}

bool WifiAir::offer(uint32_t index, std::span<const uint8_t> frame, uint64_t at_us) {
  run(at_us);
  Station& station = stations_[index];
  count(index, &WifiAirCounters::offered);
  if (station.queue.size() >= config_.queue_frames) {
    count(index, &WifiAirCounters::lost_queue_full);
    return false;
  }
  station.queue.emplace_back(frame.begin(), frame.end());
  if (station.is_busy) count(index, &WifiAirCounters::deferred);
  if (station.queue.size() > 1) return true;  // whoever is first has its turn planned
  if (!station.is_busy) {
    plan_access(index);
  } else if (station.backoff.is_done()) {
    // Else all who find the air taken would begin the moment it is free.
    station.backoff.set(random_.below(config_.window_slots + 1));
  }
  return true;
}

/// Of a station that has a frame and finds the air idle.
void WifiAir::plan_access(uint32_t index) {
  Station& station = stations_[index];
  station.access_us = std::max(now_us_, station.backoff.end_us(spaces_));
  push(station.access_us, index, kAccess);
}

void WifiAir::access(uint32_t index) {
  Station& station = stations_[index];
  // A plan that was given up is still in the queue of events.
  if (station.access_us != now_us_ || station.is_busy || station.queue.empty()) return;
  station.access_us = kNever;
  station.backoff.set(0);
  transmit(index);
}

void WifiAir::transmit(uint32_t index) {
  Station& station = stations_[index];
  const std::size_t bytes = station.queue.front().size();
  const uint32_t air_us =
      wifi_air_time_us(rate_, bytes - std::min<std::size_t>(bytes, config_.header_bytes));
  count(index, &WifiAirCounters::sent);
  count(index, &WifiAirCounters::air_us, air_us);
  station.is_sending = true;
  look_at_carrier(index);
  station.reached.clear();
  grid_.for_near(station.body.x_mm, station.body.y_mm, [&](uint32_t other) {
    if (other == index) return;
    const double arriving = power_.between(station.body, stations_[other].body);
    if (power_.disturbs(arriving)) station.reached.push_back(other);
  });
  // The order of the grid's cells depends on who moved when; what happens must not.
  std::sort(station.reached.begin(), station.reached.end());
  for (uint32_t to = 0; to < size(); ++to) {
    if (to != index) count(to, &WifiAirCounters::expected);
  }
  std::size_t near = 0;
  for (uint32_t to = 0; to < size(); ++to) {
    if (to == index) continue;
    const bool is_reached = near < station.reached.size() && station.reached[near] == to;
    const double arriving = is_reached ? power_.between(station.body, stations_[to].body) : 0;
    near += is_reached;
    if (!power_.is_received(arriving)) count(to, &WifiAirCounters::lost_range);
    if (is_reached) begin_signal(index, to, arriving, power_.is_received(arriving));
  }
  push(now_us_ + air_us, index, kEnd);
}

void WifiAir::begin_signal(uint32_t from, uint32_t to, double arriving, bool is_near) {
  Station& receiver = stations_[to];
  if (are_parted(stations_[from], receiver)) {
    if (is_near) count(to, &WifiAirCounters::lost_partition);
    return;
  }
  receiver.signals.push_back({from, is_near, arriving, now_us_, nullptr});
  if (receiver.is_sending) receiver.signals.back().loss = &WifiAirCounters::lost_sending;
  for (Signal& signal : receiver.signals) {
    if (signal.from == receiver.locked_on && signal.loss == nullptr &&
        !power_.is_readable(signal_to_noise(receiver, signal))) {
      signal.loss = &WifiAirCounters::lost_collision;
    }
  }
  push(now_us_ + config_.detection_us, to, kDetect);
}

double WifiAir::signal_to_noise(const Station& station, const Signal& signal) const {
  double others = power_.noise();
  for (const Signal& other : station.signals) {
    if (other.from != signal.from) others += other.power;
  }
  return signal.power / others;
}

/// Time enough has passed to notice a carrier that began at this station: the strongest of those
/// that are that young is read, if it can be.
void WifiAir::detect(uint32_t index) {
  Station& station = stations_[index];
  const Signal* strongest = nullptr;
  for (const Signal& signal : station.signals) {
    const bool is_young = signal.start_us + config_.detection_us >= now_us_;
    if (is_young && (strongest == nullptr || signal.power > strongest->power)) strongest = &signal;
  }
  const bool is_jammed = interference_.jams(station.body, now_us_);
  for (Signal& signal : station.signals) {
    if (signal.start_us + config_.detection_us != now_us_ || signal.loss != nullptr) continue;
    if (is_jammed) {
      signal.loss = &WifiAirCounters::lost_jam;
    } else if (station.is_sending) {
      signal.loss = &WifiAirCounters::lost_sending;
    } else if (&signal == strongest && station.locked_on == kNobody && signal.is_in_range &&
               power_.is_detected(signal_to_noise(station, signal))) {
      station.locked_on = signal.from;
    } else if (signal.from != station.locked_on) {
      signal.loss = &WifiAirCounters::lost_collision;
    }
  }
  look_at_carrier(index);
}

void WifiAir::end_transmission(uint32_t index) {
  // By number: who gets the frame is asked for no more stations, but a hook may take its time.
  for (const uint32_t to : stations_[index].reached) end_signal(index, to);
  Station& station = stations_[index];
  station.queue.pop_front();
  station.is_sending = false;
  station.backoff.set(random_.below(config_.window_slots + 1));
  look_at_carrier(index);
  if (hooks_.ended) hooks_.ended(index, now_us_);
}

void WifiAir::end_signal(uint32_t from, uint32_t to) {
  Station& receiver = stations_[to];
  const auto found = std::find_if(receiver.signals.begin(), receiver.signals.end(),
                                  [from](const Signal& signal) { return signal.from == from; });
  if (found == receiver.signals.end()) return;  // they were parted when it began
  const Signal signal = *found;
  receiver.signals.erase(found);
  Loss loss = signal.loss;
  if (receiver.locked_on == from) {
    receiver.locked_on = kNobody;
    loss = loss_of_read(from, receiver, to, signal);
    if (loss != nullptr) receiver.backoff.note_bad_frame(now_us_);
  }
  if (loss != nullptr) {
    if (signal.is_in_range) count(to, loss);
  } else if (hooks_.deliver(from, to, stations_[from].queue.front())) {
    count(to, &WifiAirCounters::received);
  } else {
    count(to, &WifiAirCounters::lost_receiver);
  }
  look_at_carrier(to);
}

/// Why a frame that was read to its end has not arrived; nullptr: it has.
WifiAir::Loss WifiAir::loss_of_read(uint32_t from, const Station& receiver, uint32_t to,
                                    const Signal& signal) {
  if (signal.loss != nullptr) return signal.loss;
  if (interference_.jams(receiver.body, now_us_)) return &WifiAirCounters::lost_jam;
  if (const auto own = link_loss(from, to)) {
    return random_.uniform() < *own ? &WifiAirCounters::lost_link : nullptr;
  }
  const bool is_lost = config_.loss > 0 && random_.uniform() < config_.loss;
  return is_lost ? &WifiAirCounters::lost_noise : nullptr;
}

/// Whether the air is taken may have changed for a station: it stops counting its backoff, or
/// begins to.
void WifiAir::look_at_carrier(uint32_t index) {
  Station& station = stations_[index];
  double energy = 0;
  for (const Signal& signal : station.signals) {
    if (signal.start_us + config_.detection_us <= now_us_) energy += signal.power;
  }
  const bool is_busy = station.is_sending || station.locked_on != kNobody || power_.is_busy(energy);
  if (is_busy == station.is_busy) return;
  station.is_busy = is_busy;
  if (is_busy) {
    station.access_us = kNever;
    return station.backoff.stop(now_us_, spaces_);
  }
  station.backoff.begin(now_us_, spaces_);
  if (!station.queue.empty()) plan_access(index);
}

}  // namespace swarmtalk::sim
