#include "client_lib/hints.hpp"

#include <cstdio>

namespace swarmtalk::client {

void print_hint(const std::string& text) {
  std::fprintf(stderr, "swarmtalk: %s\n", text.c_str());
}

void Hints::note_name(const ChannelKey& key) {
  note_digits(key.name);
  note_wildcard(key.name);
}

/// swarmtalk-cli takes digits for a number, so that the two would never meet.
void Hints::note_digits(const std::string& name) {
  const bool is_digits = !name.empty() && name.find_first_not_of("0123456789") == std::string::npos;
  if (!is_digits || std::exchange(has_told_digits_, true)) return;
  tell("channel \"" + name + "\" is a name here, and not channel number " + name +
       "; for the number leave out the quotes");
}

void Hints::note_wildcard(const std::string& name) {
  if (name.find_first_of("#*?+") == std::string::npos) return;
  if (std::exchange(has_told_wildcard_, true)) return;
  tell("'" + name +
       "' is the name of one channel: there are no wildcards; use each channel by its name, "
       "swarmtalk-cli status lists those of this robot's programs");
}

void Hints::note_nobody_around() {
  if (std::exchange(has_told_nobody_, true)) return;
  tell(
      "no robot was heard within the last 10 s: one whose programs send nothing is heard only with "
      "beacon_ms in its configuration");
}

void Hints::note_end(const std::string& label) const {
  if (has_run_) return;
  tell(label +
       " was subscribed to and nothing was heard: keep what subscribe() returns, and call run() "
       "or process(): callbacks run only inside those");
}

}  // namespace swarmtalk::client
