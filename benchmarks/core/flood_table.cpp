// Prints how floods fare at the link's own rate, over several hops, and when everybody floods.
// core_flood_table [PART...]: fast, hops, room, small, conditions; all if none is named.
// The last three are everybody's floods: with memory for all, with a Kilobot's, and under other
// loads, lengths, clocks and ids.
#include <cstdio>
#include <cstring>

#include "tests/support/profiles.hpp"
#include "tests/swarm/everybody_floods.hpp"
#include "tests/swarm/fast_flood.hpp"
#include "tests/swarm/ideal_robot.hpp"

namespace {

using namespace swarmtalk::core;
using namespace swarmtalk::core::testing;

unsigned long long whole(uint64_t count) {
  return count;
}

constexpr uint32_t kSeeds = 4;  // of each row: as many starting phases

// --- the link's own rate ----------------------------------------------------------------------

void fast_head(const char* what) {
  std::printf(
      "\n### Fast floods, one place, %s\n\n"
      "Delivered %% of all (of what all packets of arrived), duplicates, own messages back, "
      "spliced, "
      "id collisions and changes, transmissions over ideal.\n\n"
      "| packets per message | receivers | senders | ticks of sender, relays | loss | delivered | "
      "duplicates | own back | spliced | collisions, changes | transmissions |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n",
      what);
}

template <class P>
void fast_row(const FastFloodConfig& config) {
  const Counts counts = fast_flood<CoreRobot<P>>(config, kSeeds);
  std::printf(
      "| %u | %u | %s | %.0f, %.0f | %.0f %% | %.2f (%.2f) | %llu | %llu | %llu | %llu, %llu | "
      "%.2f "
      "|\n",
      config.packets, config.robots - 1, config.all_send ? "all" : "1", config.sender_ticks,
      config.relay_ticks, 100 * config.loss, 100 * counts.delivered_of_all(),
      100 * counts.delivered_of_possible(), whole(counts.duplicates), whole(counts.own_back),
      whole(counts.spliced), whole(counts.id_collisions), whole(counts.id_changes),
      counts.transmissions_of_ideal(config.robots));
  std::fflush(stdout);
}

/// Of each sender, so that it sends for so long.
uint32_t messages_for(double ticks, const FastFloodConfig& config) {
  const double needed = ticks / (config.sender_ticks * config.packets);
  return needed < 100 ? 100 : static_cast<uint32_t>(needed);
}

template <class P>
void fast_floods(const char* what, double sender_ticks) {
  fast_head(what);
  FastFloodConfig config;
  config.sender_ticks = sender_ticks;
  config.ids = Ids::kDistinct;
  for (uint8_t packets : {uint8_t{1}, uint8_t{2}, uint8_t{4}, uint8_t{8}}) {
    config.packets = packets;
    for (uint32_t receivers : {1u, 5u, 20u}) {
      config.robots = receivers + 1;
      for (double relay_ticks : {2.0, 16.0}) {
        config.relay_ticks = relay_ticks;
        for (bool all : {false, true}) {
          config.all_send = all;
          config.messages = messages_for(all && receivers == 20 ? 400 : 4000, config);
          fast_row<P>(config);
        }
        config.all_send = false;
        config.messages = messages_for(4000, config);
        for (double loss : {0.05, 0.2}) {
          config.loss = loss;
          fast_row<P>(config);
        }
        config.loss = 0;
      }
    }
  }
}

/// How fast one sender may be before floods stop.
template <class P>
void rates(const char* what, std::initializer_list<double> ticks) {
  fast_head(what);
  for (double sender_ticks : ticks) {
    FastFloodConfig config;
    config.sender_ticks = sender_ticks;
    config.relay_ticks = 16;
    config.ids = Ids::kDistinct;
    config.messages = messages_for(8000, config);
    fast_row<P>(config);
  }
}

// --- several hops -----------------------------------------------------------------------------

template <class P>
void hops_row(const FastFloodConfig& config) {
  const Counts counts = fast_flood<CoreRobot<P>>(config, kSeeds);
  std::printf("| %s | %u | %.0f, %.0f | %.0f %% | %.2f | %.2f | %.2f | %llu | %llu | %llu |\n",
              config.place == Place::kLine ? "line of 6" : "grid 6 x 6", config.packets,
              config.sender_ticks, config.relay_ticks, 100 * config.jitter,
              100 * counts.delivered_of_all(), 100 * counts.possible_of_all(),
              100 * counts.delivered_of_possible(), whole(counts.duplicates),
              whole(counts.own_back), whole(counts.spliced));
  std::fflush(stdout);
}

template <class P>
void several_hops(const char* what) {
  std::printf(
      "\n### Fast floods over several hops, TTL 15, %s\n\n"
      "| place | packets per message | ticks of sender, relays | jitter | delivered %% of all | "
      "heard "
      "whole %% of all | delivered %% of heard | duplicates | own back | spliced |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n",
      what);
  FastFloodConfig config;
  config.ttl = 15;
  for (Place place : {Place::kLine, Place::kGrid}) {
    config.place = place;
    config.robots = place == Place::kLine ? 6 : 36;
    for (uint8_t packets : {uint8_t{1}, uint8_t{4}}) {
      config.packets = packets;
      for (double jitter : {0.0, 0.1}) {
        config.jitter = jitter;
        for (auto [sender, relay] : {std::pair{2.0, 2.0}, {16.0, 16.0}, {2.0, 16.0}}) {
          config.sender_ticks = sender;
          config.relay_ticks = relay;
          config.messages = messages_for(6000, config);
          hops_row<P>(config);
        }
      }
    }
  }
}

// --- everybody floods -------------------------------------------------------------------------

void everybody_head(const char* what) {
  std::printf(
      "\n### 36 robots, everybody floods, no loss, %s\n\n"
      "| packets per message | load | timing | node | delivered %% of all | heard whole %% of all "
      "| "
      "duplicates per delivery | own back per message | transmissions / ideal | spliced |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n",
      what);
}
const char* timing_name(Timing timing) {
  return timing == Timing::kBursts ? "bursts" : timing == Timing::kSpread ? "spread" : "random";
}
void everybody_row(const EverybodyConfig& config, const char* node, const Counts& counts) {
  std::printf("| %u | %.0f %% | %s | %s | %.2f | %.2f | %.4f | %.4f | %.3f | %llu |\n",
              config.packets, 100 * config.load, timing_name(config.timing), node,
              100 * counts.delivered_of_all(), 100 * counts.possible_of_all(),
              counts.duplicates_per_delivery(), counts.own_back_per_message(),
              counts.transmissions_of_ideal(config.side * config.side), whole(counts.spliced));
  std::fflush(stdout);
}

template <class P>
Counts ideal(const EverybodyConfig& config, const IdealMemory& memory, uint32_t seeds) {
  typename IdealRobot<P>::Settings settings;
  settings.memory = memory;
  return everybody_floods<IdealRobot<P>>(config, seeds, settings);
}
/// The best of the policies by what it delivers, of those with so many duplicates at most.
template <class P>
Counts best_ideal(const EverybodyConfig& config, double duplicates_per_delivery, uint32_t seeds) {
  Counts best;
  for (const IdealMemory& memory : memories_of<P>()) {
    const Counts counts = ideal<P>(config, memory, seeds);
    if (counts.duplicates_per_delivery() <= duplicates_per_delivery &&
        counts.delivered > best.delivered) {
      best = counts;
    }
  }
  return best;
}

template <class P, class Other>
void everybody(const char* what, const char* other, bool is_limited) {
  constexpr uint32_t kFew = 2;
  everybody_head(what);
  EverybodyConfig config;
  for (Timing timing : {Timing::kBursts, Timing::kRandom, Timing::kSpread}) {
    config.timing = timing;
    for (double load : {0.5, 1.0}) {
      config.load = load;
      for (uint8_t packets : {uint8_t{1}, uint8_t{2}, uint8_t{4}, uint8_t{8}}) {
        config.packets = packets;
        everybody_row(config, "core", everybody_floods<CoreRobot<P>>(config, kFew));
        if (other != nullptr) {
          everybody_row(config, other, everybody_floods<CoreRobot<Other>>(config, kFew));
        }
        everybody_row(config, "ideal", ideal<P>(config, unlimited_memory<P>(), kFew));
        if (is_limited) {
          everybody_row(config, "ideal, same memory", best_ideal<P>(config, 1e9, kFew));
          everybody_row(config, "the same, 0.01 duplicates", best_ideal<P>(config, 0.01, kFew));
        }
      }
    }
  }
}

// --- loads and conditions ---------------------------------------------------------------------

void condition_head(const char* what) {
  std::printf(
      "\n### %s\n\n"
      "Half load, random times and no loss where nothing else is said.\n\n"
      "| node | condition | packets per message | load | delivered %% of all | heard whole %% of "
      "all | "
      "duplicates per delivery | own back per message | spliced | collisions, changes of id |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n",
      what);
}
template <class P>
void condition_row(const char* node, const char* condition, const EverybodyConfig& config,
                   uint32_t seeds) {
  const Counts counts = everybody_floods<CoreRobot<P>>(config, seeds);
  char packets[16] = "1 to 8";
  if (!config.mixed_lengths) std::snprintf(packets, sizeof packets, "%u", config.packets);
  std::printf("| %s | %s | %s | %.0f %% | %.2f | %.2f | %.4f | %.4f | %llu | %llu, %llu |\n", node,
              condition, packets, 100 * config.load, 100 * counts.delivered_of_all(),
              100 * counts.possible_of_all(), counts.duplicates_per_delivery(),
              counts.own_back_per_message(), whole(counts.spliced), whole(counts.id_collisions),
              whole(counts.id_changes));
  std::fflush(stdout);
}

EverybodyConfig usual_condition() {
  EverybodyConfig config;
  config.timing = Timing::kRandom;
  return config;
}

template <class P>
void loads(const char* node) {
  EverybodyConfig config = usual_condition();
  for (uint8_t packets : {uint8_t{1}, uint8_t{4}}) {
    config.packets = packets;
    for (double load : {0.25, 0.5, 0.75, 1.0}) {
      config.load = load;
      condition_row<P>(node, "36 robots", config, 2);
    }
  }
}

template <class P>
void conditions(const char* node) {
  EverybodyConfig config = usual_condition();
  config.mixed_lengths = true;
  condition_row<P>(node, "mixed lengths", config, 2);
  config.loss = 0.2;
  condition_row<P>(node, "mixed lengths, 20 % loss", config, 2);
  config.loss = 0;
  config.channels = 2;
  condition_row<P>(node, "two channels", config, 2);
  config.channels = 1;
  config.drift = 0.02;
  condition_row<P>(node, "clocks 2 % fast or slow", config, 2);
  config.channels = 2;
  config.loss = 0.2;
  condition_row<P>(node, "all of these", config, 2);
}

/// Twins are certain: 400 robots draw from 248 ids. A flood of TTL 3 makes some 42 robots send.
template <class P>
void many_robots(const char* node) {
  EverybodyConfig config = usual_condition();
  config.side = 20;
  config.ids = Ids::kRandom;
  for (uint8_t ttl : {uint8_t{0}, uint8_t{3}}) {
    config.ttl = ttl;
    config.reached = ttl == 0 ? 1 : 42;
    config.periods = ttl == 0 ? 200 : 20;
    for (uint8_t packets : {uint8_t{1}, uint8_t{4}}) {
      config.packets = packets;
      condition_row<P>(node, ttl == 0 ? "400 robots, random ids, TTL 0" : "the same, TTL 3", config,
                       1);
    }
  }
}

template <class P>
void all_conditions(const char* node) {
  loads<P>(node);
  conditions<P>(node);
  many_robots<P>(node);
}

bool is_wanted(int argc, char** argv, const char* part) {
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], part) == 0) return true;
  }
  return argc == 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (is_wanted(argc, argv, "fast")) {
    rates<Kilobot>("Kilobot, by rate", {2, 4, 8, 11, 12, 16});
    rates<Footbot>("Foot-bot, by rate", {1, 2, 4, 5, 6, 16});
    fast_floods<Kilobot>("Kilobot", 2);
    fast_floods<Footbot>("Foot-bot", 1);
  }
  if (is_wanted(argc, argv, "hops")) {
    several_hops<Kilobot>("Kilobot");
    several_hops<Footbot>("Foot-bot");
  }
  if (is_wanted(argc, argv, "room")) {
    everybody<FloodRoom, PatientFloodRoom>("memory for all", "core, assembly 2,000 ticks", false);
    everybody<RoomForAll, RoomForAll>("RoomForAll", nullptr, false);
  }
  if (is_wanted(argc, argv, "small")) {
    everybody<Kilobot, Kilobot>("Kilobot", nullptr, true);
  }
  if (is_wanted(argc, argv, "conditions")) {
    condition_head("Everybody floods, under several conditions");
    all_conditions<FloodRoom>("memory for all");
    all_conditions<RoomForAll>("RoomForAll");
    all_conditions<Kilobot>("Kilobot");
  }
  return 0;
}
