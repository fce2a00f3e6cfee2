#include "lab/wifi/medium/air.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

namespace swarmtalk::wifi {
namespace {

using nlohmann::json;

constexpr std::size_t kNone = Air::kMaxRadios;
constexpr std::size_t kHeaderBytes = 10;  // to the end of the first address
constexpr std::uint8_t kTypeMask = 0x0c;
constexpr std::uint8_t kTypeData = 0x08;
constexpr std::uint8_t kSecondAddressBit = 0x40;  // mac80211_hwsim: the only difference of the two

std::string error(const std::string& text) {
  return json{{"error", text}}.dump();
}

bool is_number(double value) {
  return std::isfinite(value);
}

}  // namespace

bool Air::add(const std::string& name, const Address& address, double x_m, double y_m) {
  if (radios_.size() == kMaxRadios || find(name) != kNone || find(address) != kNone) return false;
  Radio radio;
  radio.name = name;
  radio.address = address;
  radio.x_m = x_m;
  radio.y_m = y_m;
  radios_.push_back(radio);
  return true;
}

std::size_t Air::find(std::string_view name) const {
  for (std::size_t i = 0; i < radios_.size(); ++i) {
    if (radios_[i].name == name) return i;
  }
  return kNone;
}

std::size_t Air::find(const Address& address) const {
  Address own = address;
  own[0] |= kSecondAddressBit;
  for (std::size_t i = 0; i < radios_.size(); ++i) {
    if (radios_[i].address == own) return i;
  }
  return kNone;
}

std::string Air::command(std::string_view line) {
  std::istringstream words{std::string(line)};
  std::string verb;
  std::string name;
  words >> verb;
  if (verb == "counters") return counters_json();
  words >> name;
  const std::size_t radio = find(name);
  if (verb != "place" && verb != "power" && verb != "loss") {
    return error("no command '" + verb + "'; there are place, power, loss and counters");
  }
  if (radio == kNone) return error("no radio '" + name + "'");
  double first = 0;
  double second = 0;
  if (verb == "place" && words >> first >> second && is_number(first) && is_number(second)) {
    radios_[radio].x_m = first;
    radios_[radio].y_m = second;
    return R"({"ok":true})";
  }
  if (verb == "power" && words >> first && is_number(first)) {
    radios_[radio].power_dbm = first;
    return R"({"ok":true})";
  }
  std::string other;
  if (verb == "loss" && words >> other >> first && first >= 0 && first <= 1) {
    const std::size_t to = find(other);
    if (to == kNone) return error("no radio '" + other + "'");
    pair(radio, to).share_lost = first;
    return R"({"ok":true})";
  }
  return error("'" + verb + "' takes: place NAME X Y, power NAME DBM, loss FROM TO 0..1");
}

double Air::signal(std::size_t from, std::size_t to, std::uint32_t frequency_mhz) const {
  const double distance_m =
      std::hypot(radios_[from].x_m - radios_[to].x_m, radios_[from].y_m - radios_[to].y_m);
  return signal_dbm(radios_[from].power_dbm, distance_m, frequency_mhz);
}

bool Air::draw(double chance) {
  // Not std::bernoulli_distribution, whose numbers differ between libraries.
  return static_cast<double>(random_() >> 11) * 0x1p-53 < chance;
}

bool Air::arrives(std::size_t from, std::size_t to, Rate rate, const Frame& frame, bool& was_set) {
  was_set = draw(pair(from, to).share_lost);
  const double chance =
      chance_of_reception(signal(from, to, frame.frequency_mhz), rate, frame.bytes.size());
  return draw(chance) && !was_set;
}

void Air::count(std::size_t from, std::size_t to, bool is_data, bool arrived, bool was_set) {
  PairCounters& counters = pair(from, to).counters;
  if (!is_data) {
    ++(arrived ? counters.other_arrived : counters.other_lost);
  } else if (arrived) {
    ++counters.data_arrived;
  } else {
    ++(was_set ? counters.data_lost_set : counters.data_lost_weak);
  }
}

void Air::send_to_all(std::size_t from, const Frame& frame, Outcome& outcome) {
  const Attempt& attempt = frame.attempts[0];
  const Rate rate = rate_of(std::max(attempt.rate_index, 0), frame.frequency_mhz);
  const bool is_data = (frame.bytes[0] & kTypeMask) == kTypeData;
  outcome.used[0] = {std::max(attempt.rate_index, 0), 1};
  for (std::size_t to = 0; to < radios_.size(); ++to) {
    if (to == from) continue;
    bool was_set = false;
    const bool arrived = arrives(from, to, rate, frame, was_set);
    count(from, to, is_data, arrived, was_set);
    if (!arrived) continue;
    const double dbm = signal(from, to, frame.frequency_mhz);
    outcome.receptions.push_back(
        {to, static_cast<int>(std::lround(dbm)), outcome.used[0].rate_index});
  }
}

void Air::send_to_one(std::size_t from, std::size_t to, const Frame& frame, Outcome& outcome) {
  const bool is_data = (frame.bytes[0] & kTypeMask) == kTypeData;
  int last_index = 0;
  bool was_set = false;
  for (std::size_t i = 0; i < frame.attempts.size() && !outcome.is_acknowledged; ++i) {
    const Attempt& attempt = frame.attempts[i];
    if (attempt.rate_index < 0) break;
    last_index = attempt.rate_index;
    const Rate rate = rate_of(attempt.rate_index, frame.frequency_mhz);
    outcome.used[i] = {attempt.rate_index, 0};
    for (int n = 0; n < std::max(attempt.tries, 1) && !outcome.is_acknowledged; ++n) {
      ++outcome.used[i].tries;
      outcome.is_acknowledged = to != kNone && arrives(from, to, rate, frame, was_set);
    }
  }
  if (to != kNone) {
    count(from, to, is_data, outcome.is_acknowledged, was_set);
    if (outcome.is_acknowledged) {
      const double dbm = signal(from, to, frame.frequency_mhz);
      outcome.receptions.push_back({to, static_cast<int>(std::lround(dbm)), last_index});
    }
  }
  const Rate rate = rate_of(last_index, frame.frequency_mhz);
  for (std::size_t other = 0; other < radios_.size(); ++other) {
    bool ignored = false;
    if (other == from || other == to || !arrives(from, other, rate, frame, ignored)) continue;
    const double dbm = signal(from, other, frame.frequency_mhz);
    outcome.receptions.push_back({other, static_cast<int>(std::lround(dbm)), last_index});
  }
  if (!outcome.is_acknowledged && !frame.wants_no_ack) ++radios_[from].unacknowledged;
}

Outcome Air::transmit(const Frame& frame) {
  Outcome outcome;
  outcome.used.fill({-1, 0});
  const std::size_t from = find(frame.transmitter);
  if (from == kNone || frame.bytes.size() < kHeaderBytes) {
    ++strangers_;
    return outcome;
  }
  ++radios_[from].frames_sent;
  Address to{};
  std::copy_n(frame.bytes.begin() + 4, to.size(), to.begin());
  const bool is_for_all = (to[0] & 1) != 0;
  if (is_for_all) {
    send_to_all(from, frame, outcome);
  } else {
    send_to_one(from, find(to), frame, outcome);
  }
  return outcome;
}

std::string Air::counters_json() {
  json result = {{"refused", refused_},
                 {"overruns", overruns_},
                 {"strangers", strangers_},
                 {"radios", json::array()},
                 {"pairs", json::array()}};
  for (const Radio& radio : radios_) {
    result["radios"].push_back({{"name", radio.name},
                                {"x_m", radio.x_m},
                                {"y_m", radio.y_m},
                                {"frames_sent", radio.frames_sent},
                                {"unacknowledged", radio.unacknowledged}});
  }
  for (std::size_t from = 0; from < radios_.size(); ++from) {
    for (std::size_t to = 0; to < radios_.size(); ++to) {
      if (from == to) continue;
      const PairCounters& counters = pair(from, to).counters;
      result["pairs"].push_back({{"from", radios_[from].name},
                                 {"to", radios_[to].name},
                                 {"data_arrived", counters.data_arrived},
                                 {"data_lost_weak", counters.data_lost_weak},
                                 {"data_lost_set", counters.data_lost_set},
                                 {"other_arrived", counters.other_arrived},
                                 {"other_lost", counters.other_lost}});
    }
  }
  return result.dump();
}

}  // namespace swarmtalk::wifi
