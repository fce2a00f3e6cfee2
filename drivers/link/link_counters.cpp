#include "drivers/link/link_counters.hpp"

namespace swarmtalk::drivers {

Counters LinkCounters::list() const {
  return {
      {"frames_sent", frames_sent},
      {"frames_received", frames_received},
      {"packets_sent", packets_sent},
      {"packets_received", packets_received},
      {"bytes_sent", bytes_sent},
      {"bytes_received", bytes_received},
      {"frames_truncated", frames_truncated},
      {"frames_other_version", frames_other_version},
      {"frames_other_profile", frames_other_profile},
      {"frames_unknown_flags", frames_unknown_flags},
      {"frames_bad_packet_length", frames_bad_packet_length},
      {"frames_not_ours", frames_not_ours},
      {"frames_sealed", frames_sealed},
      {"frames_without_key", frames_without_key},
      {"frames_other_key", frames_other_key},
      {"frames_not_fresh", frames_not_fresh},
      {"frames_replayed", frames_replayed},
      {"frames_not_proven", frames_not_proven},
      {"frames_proven_later", frames_proven_later},
      {"frames_too_old", frames_too_old},
      {"frames_not_authentic", frames_not_authentic},
      {"frames_tagged", frames_tagged},
      {"own_echoes", own_echoes},
      {"send_retries", send_retries},
      {"send_errors", send_errors},
      {"packets_over_mtu", packets_over_mtu},
      {"kernel_drops", kernel_drops},
      {"link_down_events", link_down_events},
      {"beacons_sent", beacons_sent},
      {"airtime_us_sent", airtime_us_sent},
      {"airtime_us_received", airtime_us_received},
  };
}

}  // namespace swarmtalk::drivers
