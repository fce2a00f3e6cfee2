#include "daemon/config/kilobot_config.hpp"

#include "daemon/config/profiles.hpp"
#include "daemon/config/table_reader.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr IntegerLimits kBaudLimits{1200, 1'000'000};
constexpr IntegerLimits kCopiesLimits{1, 100};
constexpr IntegerLimits kSettleMsLimits{0, 60'000};
constexpr double kLeastTimeScale = 0.001;
constexpr double kMostTimeScale = 1000;
constexpr std::size_t kMostPathBytes = 4095;

void read_device(const TableReader& table, const std::string& key, std::string& path) {
  table.read_text(key, path);
  if (!table.has(key)) return;
  if (path.empty() || path.front() != '/' || path.size() > kMostPathBytes) {
    table.fail(key,
               "is not the full path of a serial device; write it as listed by "
               "`ls /dev/serial/by-id/*`");
  }
}

void read_text_uplink(const TableReader& table, KilobotConfig& config) {
  config.is_text = table.read_choice("uplink_form", {"frames", "text"}) == 1;
  table.read_integer("text_channel", kChannelLimits, config.text_channel);
  if (!config.is_text && table.has("text_channel")) {
    table.fail("text_channel", "means nothing without uplink_form = \"text\"");
  }
  if (!config.is_text) return;
  if (config.uplink.empty()) {
    table.fail_missing("uplink", "uplink_form = \"text\" needs the device that prints");
  }
  if (!table.has("text_channel")) {
    table.fail_missing("text_channel",
                       "uplink_form = \"text\" needs the number of the channel on which its lines "
                       "are published");
  }
}

}  // namespace

std::vector<std::string> kilobot_keys() {
  return {"type",         "profile",         "node_id",
          "downlink",     "uplink",          "uplink_form",
          "text_channel", "ohc_single",      "baud",
          "copies",       "settle_ms",       "time_scale",
          "forward",      "max_forward_ttl", "max_forward_wait_ms"};
}

void read_kilobot(const TableReader& table, KilobotConfig& config, frame::ProfileId& profile) {
  table.expect_keys(kilobot_keys());
  const char* const classic = profile_entry(frame::ProfileId::kClassic2020).name.text;
  const char* const kilobot = profile_entry(frame::ProfileId::kKilobot).name.text;
  const bool is_classic = table.read_choice("profile", {kilobot, classic}) == 1;
  profile = is_classic ? frame::ProfileId::kClassic2020 : frame::ProfileId::kKilobot;
  read_device(table, "downlink", config.downlink);
  read_device(table, "uplink", config.uplink);
  if (config.downlink.empty() && config.uplink.empty()) {
    table.fail_missing("downlink",
                       "add downlink = \"/dev/serial/by-id/...\" (the overhead controller), "
                       "uplink = ... (a gateway Kilobot), or both");
  }
  read_text_uplink(table, config);
  table.read_bool("ohc_single", config.ohc_single);
  table.read_integer("baud", kBaudLimits, config.baud);
  table.read_integer("copies", kCopiesLimits, config.copies);
  table.read_integer("settle_ms", kSettleMsLimits, config.settle_ms);
  table.read_number("time_scale", kLeastTimeScale, kMostTimeScale, config.time_scale);
}

}  // namespace swarmtalk::daemon
