#include "daemon/common/daemon_counters.hpp"

#include "daemon/common/patient_sink.hpp"

namespace swarmtalk::daemon {

drivers::Counters DaemonCounters::list() const {
  return {
      {"clients_accepted", clients_accepted},
      {"clients_refused", clients_refused},
      {"clients_malformed", clients_malformed},
      {"clients_other_version", clients_other_version},
      {"clients_silent", clients_silent},
      {"clients_not_reading", clients_not_reading},
      {"requests_refused", requests_refused},
      {"requests_too_fast", requests_too_fast},
      {"shares_refused", shares_refused},
      {"messages_over_share", messages_over_share},
      {"log_lines_lost", PatientSink::lost()},
      {"messages_published", messages_published},
      {"messages_sent", messages_sent},
      {"messages_busy", messages_busy},
      {"messages_link_down", messages_link_down},
      {"messages_over_mtu", messages_over_mtu},
      {"messages_dropped_queue", messages_dropped_queue},
      {"messages_dropped_closed", messages_dropped_closed},
      {"messages_too_fast", messages_too_fast},
      {"reports_sent", reports_sent},
      {"reports_received", reports_received},
      {"reports_unreadable", reports_unreadable},
      {"reserved_too_fast", reserved_too_fast},
      {"copies_sent", copies_sent},
      {"messages_received", messages_received},
      {"messages_lost_air", messages_lost_air},
      {"messages_lost_kernel", messages_lost_kernel},
      {"messages_lost_memory", messages_lost_memory},
      {"messages_late", messages_late},
      {"beacons_not_believed", beacons_not_believed},
      {"deliveries_queued", deliveries_queued},
      {"deliveries_sent", deliveries_sent},
      {"deliveries_too_far", deliveries_too_far},
      {"deliveries_unknown_distance", deliveries_unknown_distance},
      {"deliveries_dropped_full", deliveries_dropped_full},
      {"deliveries_dropped_bytes", deliveries_dropped_bytes},
      {"deliveries_dropped_old", deliveries_dropped_old},
      {"deliveries_dropped_closed", deliveries_dropped_closed},
      {"deliveries_lost_in_client", deliveries_lost_in_client},
      {"duplicate_node_ids", duplicate_node_ids},
      {"node_id_changes", node_id_changes},
      {"duplicate_neighbours", duplicate_neighbours},
      {"poses_received", poses_received},
      {"poses_refused", poses_refused},
      {"link_duplicates", link_duplicates},
      {"gateway_sent", gateway_sent},
      {"gateway_crossed", gateway_crossed},
      {"gateway_there", gateway_there},
      {"gateway_full", gateway_full},
      {"gateway_too_long", gateway_too_long},
      {"gateway_empty", gateway_empty},
      {"gateway_link_down", gateway_link_down},
  };
}

}  // namespace swarmtalk::daemon
