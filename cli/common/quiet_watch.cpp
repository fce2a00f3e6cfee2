#include "cli/common/quiet_watch.hpp"
#include "cli/common/commands.hpp"

namespace swarmtalk::cli {

void QuietWatch::heard(const std::string& channel) {
  std::erase(silent_, channel);
  if (silent_.empty()) stop();
}

void QuietWatch::look() {
  if (Clock::now() < next_) return;
  stop();
  DaemonStatus daemon;
  std::vector<Neighbour> neighbours;
  if (!client_.get_status(daemon) || !client_.get_neighbours(neighbours)) return;
  const std::string text = silence_text(silent_, daemon, neighbours);
  if (!text.empty()) fail("nothing was heard yet: " + text);
}

}  // namespace swarmtalk::cli
