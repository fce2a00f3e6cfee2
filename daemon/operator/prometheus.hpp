// The daemon's status as Prometheus text (exposition format 0.0.4), for `swarmtalk-cli metrics` and
// for the file that node_exporter's textfile collector reads.
#pragma once

#include <string>

#include "ipc/ipc.pb.h"

namespace swarmtalk::daemon {

/// Counters are "swarmtalk_NAME_total", those of a link "swarmtalk_link_NAME_total{link="wifi"}"
/// ("swarmtalk_node_NAME_total" for its protocol node); the rest are gauges. One HELP and one TYPE
/// line for each name.
std::string prometheus_text(const ipc::Status& status);

}  // namespace swarmtalk::daemon
