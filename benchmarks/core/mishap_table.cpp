// Prints what nodes make of mishaps: lost packets of mixed lengths, restarts, senders that draw
// their message numbers, paused robots.
// core_mishap_table [PART...]: splices, restart, old, pauses; all if none is named.
#include <cstdarg>
#include <cstdio>
#include <cstring>

#include "swarmtalk/profiles/classic2020.hpp"
#include "tests/support/profiles.hpp"
#include "tests/swarm/everybody_floods.hpp"
#include "tests/swarm/fast_flood.hpp"
#include "tests/swarm/old_sender.hpp"
#include "tests/swarm/pauses.hpp"
#include "tests/swarm/restart.hpp"

namespace {

using namespace swarmtalk::core;
using namespace swarmtalk::core::testing;

/// One line of a table, seen at once: the next takes a while.
__attribute__((format(printf, 1, 2))) void print_row(const char* format, ...) {
  std::va_list values;
  va_start(values, format);
  std::vprintf(format, values);
  va_end(values);
  std::fflush(stdout);
}

unsigned long long whole(uint64_t count) {
  return count;
}

// --- splices with distinct ids ----------------------------------------------------------------

const char* timing_name(Timing timing) {
  return timing == Timing::kBursts ? "bursts" : timing == Timing::kSpread ? "spread" : "random";
}

template <class P>
void splice_rows(const char* profile) {
  for (Timing timing : {Timing::kBursts, Timing::kRandom}) {
    for (double load : {0.5, 1.0}) {
      EverybodyConfig config;
      config.mixed_lengths = true;
      config.loss = 0.2;
      config.load = load;
      config.timing = timing;
      config.periods = 6;
      config.ids = Ids::kFixed;
      const Counts counts = everybody_floods<CoreRobot<P>>(config, 60);
      print_row(
          "| %s | everybody, 1 to 8 packets, %s, load %.0f %% | 20 %% | %llu | %llu | %.2f | %.4f "
          "|\n",
          profile, timing_name(timing), 100 * load, whole(counts.delivered), whole(counts.spliced),
          100 * counts.delivered_of_possible(), counts.duplicates_per_delivery());
    }
  }
  for (uint8_t packets : {uint8_t{2}, uint8_t{4}, uint8_t{8}}) {
    for (double loss : {0.05, 0.2}) {
      FastFloodConfig config;
      config.packets = packets;
      config.loss = loss;
      config.relay_ticks = 16;
      config.messages = 1000;
      Counts counts;
      for (uint32_t robots : {2u, 6u, 21u}) {
        config.robots = robots;
        counts += fast_flood<CoreRobot<P>>(config, 4);
      }
      print_row("| %s | one floods, %u packets, 2 ticks | %.0f %% | %llu | %llu | %.2f | %.4f |\n",
                profile, packets, 100 * loss, whole(counts.delivered), whole(counts.spliced),
                100 * counts.delivered_of_possible(), counts.duplicates_per_delivery());
    }
  }
}

void splices() {
  std::printf(
      "\n### Splices with distinct ids, no restart\n\n"
      "| node | floods | loss | delivered | spliced | delivered %% of heard whole | duplicates per "
      "delivery |\n|---|---|---|---|---|---|---|\n");
  splice_rows<FloodRoom>("memory for all");
  splice_rows<PatientFloodRoom>("the same, assembly 2,000 ticks");
  splice_rows<Kilobot>("Kilobot");
  splice_rows<Footbot>("Foot-bot");
}

// --- restarts ---------------------------------------------------------------------------------

template <class P>
void restart_rows(const char* profile) {
  for (double slot_ticks : {16.0, 2.0}) {
    for (uint32_t receivers : {1u, 3u}) {
      for (uint8_t packets : {uint8_t{1}, uint8_t{2}, uint8_t{4}, uint8_t{8}}) {
        RestartConfig config;
        config.slot_ticks = slot_ticks;
        config.receivers = receivers;
        config.packets = packets;
        config.restarts = 400;
        const RestartResult result = Restart<P>(config).run();
        print_row("| %s | %.0f | %u | %u | %.2f | %.2f | %llu | %.1f | %llu |\n", profile,
                  slot_ticks, receivers, packets, 100 * result.share_heard(),
                  100 * result.counts.delivered_of_all(), whole(result.counts.spliced),
                  result.splices_predicted, whole(result.counts.duplicates));
      }
    }
  }
}

void restarts() {
  std::printf(
      "\n### 400 restarts with a fixed id, no loss\n\n"
      "Splices predicted: see tests/swarm/restart.hpp.\n\n"
      "| node | ticks per packet | receivers in a line | packets per message | first 16 heard %% | "
      "all heard %% | spliced | predicted | duplicates |\n|---|---|---|---|---|---|---|---|---|\n");
  restart_rows<Kilobot>("Kilobot");
  restart_rows<Footbot>("Foot-bot");
  restart_rows<FloodRoom>("memory for all");
}

// --- senders that draw their numbers ----------------------------------------------------------

template <class P>
void old_rows(const char* profile) {
  for (double sender_ticks : {16.0, 64.0}) {
    for (uint32_t receivers : {1u, 5u}) {
      OldSenderConfig config;
      config.sender_ticks = sender_ticks;
      config.receivers = receivers;
      config.messages = 4000;
      const Counts counts = old_sender<P>(config);
      print_row("| %s | %.0f | %u | %.2f | %.4f | %.3f |\n", profile, sender_ticks, receivers,
                100 * counts.delivered_of_all(), counts.duplicates_per_delivery(),
                counts.transmissions_of_ideal(receivers + 1));
    }
  }
}

void old_senders() {
  std::printf(
      "\n### A sender of the 2020 code that floods, TTL 3\n\n"
      "| node | ticks per message | receivers | heard %% | duplicates per delivery | transmissions "
      "/ "
      "ideal |\n|---|---|---|---|---|---|\n");
  old_rows<Kilobot>("Kilobot");
  old_rows<Classic2020>("Classic2020");
  old_rows<FloodRoom>("memory for all");
}

// --- pauses -----------------------------------------------------------------------------------

template <class P>
void pause_row(const char* profile, const PauseConfig& config) {
  const Counts counts = pauses<P>(config);
  print_row("| %s | %.0f, %.0f | %u | %u | %u | %.0f | %u | %llu | %llu |\n", profile,
            config.pause_ticks, config.awake_ticks, config.packets, config.senders, config.ttl,
            config.slot_ticks, config.pauses, whole(counts.spliced), whole(counts.duplicates));
}

template <class P>
void pause_rows(const char* profile) {
  for (uint8_t ttl : {uint8_t{0}, uint8_t{3}}) {
    for (double slot_ticks : {2.0, 16.0}) {
      PauseConfig config;
      config.ttl = ttl;
      config.senders = ttl == 0 ? 3 : 1;
      config.slot_ticks = slot_ticks;
      for (double pause_ticks : {0.0, 100.0, 300.0, 65560.0, 70000.0, 1e6}) {
        config.pause_ticks = pause_ticks;
        config.pauses = pause_ticks < 1000 ? 1000 : pause_ticks < 100000 ? 200 : 40;
        pause_row<P>(profile, config);
      }
      config.pause_ticks = 84;  // hardly ever called, and again when numbers come back
      config.awake_ticks = slot_ticks;
      config.packets = 2;
      config.pauses = 2000;
      pause_row<P>(profile, config);
    }
  }
}

void pause_table() {
  std::printf(
      "\n### A robot that is paused while its neighbours send without a break\n\n"
      "| node | ticks paused, awake | packets per message | senders | TTL | ticks per packet | "
      "pauses | spliced | duplicates |\n|---|---|---|---|---|---|---|---|---|\n");
  pause_rows<Kilobot>("Kilobot");
  pause_rows<FloodRoom>("memory for all");
  pause_rows<Footbot>("Foot-bot");
}

bool is_wanted(int argc, char** argv, const char* part) {
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], part) == 0) return true;
  }
  return argc == 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (is_wanted(argc, argv, "splices")) splices();
  if (is_wanted(argc, argv, "restart")) restarts();
  if (is_wanted(argc, argv, "old")) old_senders();
  if (is_wanted(argc, argv, "pauses")) pause_table();
  return 0;
}
