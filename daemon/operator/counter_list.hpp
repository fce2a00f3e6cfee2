// The one list of all counters with what each means, whoever counts them: DaemonCounters, the
// links' LinkCounters, the nodes behind them. Status shows the values; the metrics export adds the
// texts. A counter that is missing here fails a test, as does one that docs/operations.md leaves
// out.
#pragma once

#include <span>
#include <string_view>

namespace swarmtalk::daemon {

/// Who counts: the daemon once, or each of its links (their nodes included).
enum class CounterOwner { kDaemon, kLink };

struct CounterHelp {
  CounterOwner owner;
  std::string_view name;  // as in Status: "frames_received"
  std::string_view help;  // one sentence without its full stop
};

/// All of them, by owner.
std::span<const CounterHelp> counter_list();

/// Whether a link's counter rises when something received is dropped.
bool tells_a_drop(std::string_view name);

/// @return nullptr: no such counter
const CounterHelp* find_counter(CounterOwner owner, std::string_view name);

}  // namespace swarmtalk::daemon
