#include "cli/common/quiet_watch.hpp"

#include <algorithm>
#include <cctype>

#include "text/nearest.hpp"

namespace swarmtalk::cli {
namespace {

/// Whether a program publishes the channel, or something was heard on it.
bool is_in_use(const std::string& name, const DaemonStatus& daemon) {
  return std::any_of(daemon.channels.begin(), daemon.channels.end(), [&](const auto& channel) {
    const bool is_it = channel.name == name || std::to_string(channel.number) == name;
    return is_it && (channel.publishers > 0 || channel.received > 0);
  });
}

/// Names that the daemon knows: of channels in use, and of those that programs here listen to.
std::vector<std::string> names_in_use(const std::vector<std::string>& silent,
                                      const DaemonStatus& daemon) {
  std::vector<std::string> names;
  for (const ChannelStatus& channel : daemon.channels) {
    const bool is_ours = std::find(silent.begin(), silent.end(), channel.name) != silent.end();
    if (!channel.name.empty() && !is_ours) names.push_back(channel.name);
  }
  return names;
}

bool is_number(const std::string& word) {
  return word.find_first_not_of("0123456789") == std::string::npos;
}

}  // namespace

bool has_just_begun(const DaemonStatus& daemon) {
  constexpr std::chrono::seconds kUntilHeard{3};  // beacons of others come once a second
  return daemon.uptime < kUntilHeard;
}

std::string wildcard_hint(const std::vector<std::string>& channels) {
  for (const std::string& channel : channels) {
    if (channel.find_first_of("#*?+") == std::string::npos) continue;
    return "'" + channel +
           "' is heard as the name of one channel: there are no wildcards; all channels are "
           "heard with: swarmtalk-cli sub --all";
  }
  return {};
}

std::string misspelt_text(const std::string& published, const DaemonStatus& daemon) {
  const bool is_used = std::any_of(
      daemon.channels.begin(), daemon.channels.end(), [&](const ChannelStatus& channel) {
        return channel.name == published &&
               (channel.publishers > 1 || channel.subscribers > 0 || channel.received > 0);
      });
  if (is_number(published) || is_used) return {};
  const std::string near = text::nearest_channel(published, names_in_use({published}, daemon));
  if (near.empty()) return {};
  return "no other program of this robot uses channel '" + published + "'; did you mean '" + near +
         "'?";
}

std::string unheard_text(const std::string& published, const DaemonStatus& daemon,
                         const std::vector<Neighbour>& neighbours) {
  const auto is_up = [](const LinkStatus& link) { return link.up; };
  const auto has_controller = [](const LinkStatus& link) { return link.type == "kilobot"; };
  const auto is_heard_here = [&](const ChannelStatus& channel) {
    const bool is_it = channel.name == published || std::to_string(channel.number) == published;
    return is_it && channel.subscribers > 0;
  };
  const auto& links = daemon.links;
  if (!neighbours.empty() || has_just_begun(daemon) ||
      std::none_of(links.begin(), links.end(), is_up) ||
      std::any_of(links.begin(), links.end(), has_controller) ||
      std::any_of(daemon.channels.begin(), daemon.channels.end(), is_heard_here)) {
    return {};
  }
  return "perhaps nobody gets this: no robot was heard in the last 10 s, and one that sends "
         "nothing is heard only with beacon_ms in its configuration; see swarmtalk-cli doctor";
}

std::string silence_text(const std::vector<std::string>& silent, const DaemonStatus& daemon,
                         const std::vector<Neighbour>& neighbours) {
  const bool is_alone = std::none_of(neighbours.begin(), neighbours.end(),
                                     [](const Neighbour& each) { return !each.out_of_range; });
  std::string text;
  for (const std::string& name : silent) {
    if (is_in_use(name, daemon)) continue;
    const std::string near =
        is_number(name) ? "" : text::nearest_channel(name, names_in_use(silent, daemon));
    if (!near.empty()) {
      text += "nobody publishes '" + name + "' as far as this robot knows; did you mean '" + near +
              "'? ";
    } else if (!is_alone && text.empty()) {
      text = "robots are around, and none of them has sent on '" + name +
             "' so far; swarmtalk-cli channels shows what is on the air ";
    }
  }
  const bool has_link = std::any_of(daemon.links.begin(), daemon.links.end(),
                                    [](const LinkStatus& link) { return link.up; });
  if (is_alone && has_link) {
    const std::size_t begin = text.size();
    text += neighbours.empty()
                ? "no other robot was heard in the last 10 s, and a program does not hear itself; "
                  "swarmtalk-cli neighbours shows who is around"
                : "all robots around are beyond virtual_range_m of the configuration";
    if (begin > 0) text[begin] = static_cast<char>(std::toupper(text[begin]));  // after a question
  }
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

}  // namespace swarmtalk::cli
