// One run of LossyCell, for benchmarks/redundancy.py: options NAME=VALUE, one line of JSON.
//   redundancy_cell loss=0.2 message_bytes=24 repairs=1
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>

#include "tests/swarm/lossy_cell.hpp"

namespace {

using swarmtalk::testing::CellConfig;
using swarmtalk::testing::CellResult;
using swarmtalk::testing::LossyCell;

/// @return false if there is no such option
bool set(CellConfig& config, const std::string& name, double value) {
  const std::map<std::string, std::function<void()>> setters{
      {"robots", [&] { config.robots = static_cast<uint32_t>(value); }},
      {"talkers", [&] { config.talkers = static_cast<uint32_t>(value); }},
      {"message_bytes", [&] { config.message_bytes = static_cast<uint32_t>(value); }},
      {"rate_hz", [&] { config.rate_hz = value; }},
      {"seconds", [&] { config.seconds = value; }},
      {"loss", [&] { config.loss = value; }},
      {"copies", [&] { config.copies = static_cast<unsigned>(value); }},
      {"repairs", [&] { config.repairs = static_cast<unsigned>(value); }},
      {"auto", [&] { config.is_automatic = value != 0; }},
      {"copy_wait_ms",
       [&] {
         config.copy_wait_us = value < 0 ? UINT64_MAX / 2 : static_cast<uint64_t>(value * 1e3);
       }},
      {"ttl", [&] { config.ttl = static_cast<uint8_t>(value); }},
      {"line_reach", [&] { config.line_reach = static_cast<uint32_t>(value); }},
      {"old_robots_from", [&] { config.old_robots_from = static_cast<uint32_t>(value); }},
      {"timestamped", [&] { config.is_timestamped = value != 0; }},
      {"seed", [&] { config.seed = static_cast<uint64_t>(value); }},
  };
  const auto found = setters.find(name);
  if (found == setters.end()) return false;
  found->second();
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  CellConfig config;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const std::size_t at = word.find('=');
    if (at == std::string::npos ||
        !set(config, word.substr(0, at), std::atof(word.substr(at + 1).c_str()))) {
      std::fprintf(stderr, "redundancy_cell: no option %s\n", word.c_str());
      return 2;
    }
  }
  const CellResult result = LossyCell(config).run();
  std::printf(
      "{\"sent\": %llu, \"delivery\": %.6f, \"duplicates\": %llu, \"damaged\": %llu, "
      "\"out_of_order\": %llu, \"packets_per_message\": %.4f, \"air_us_per_message\": %.3f, "
      "\"late_ms\": %.3f, \"recovered\": %llu, \"shared\": %llu, \"resent\": %llu, "
      "\"forwarded\": %llu, \"delivered_at\": [",
      static_cast<unsigned long long>(result.sent), result.delivery(),
      static_cast<unsigned long long>(result.duplicates),
      static_cast<unsigned long long>(result.damaged),
      static_cast<unsigned long long>(result.out_of_order), result.packets_per_message(),
      result.air_us_per_message(), result.late_ms(),
      static_cast<unsigned long long>(result.recovered),
      static_cast<unsigned long long>(result.shared),
      static_cast<unsigned long long>(result.resent),
      static_cast<unsigned long long>(result.forwarded));
  for (std::size_t i = 0; i < result.delivered_at.size(); ++i) {
    std::printf("%s%llu", i == 0 ? "" : ", ",
                static_cast<unsigned long long>(result.delivered_at[i]));
  }
  std::printf("]}\n");
  return 0;
}
