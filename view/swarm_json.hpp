// What the page is told, as JSON texts (docs/view.md lists the fields). What is not known is absent
// or null, never 0. Ages are in milliseconds at the time of the text.
#pragma once

#include <string>

#include "view/observer.hpp"

namespace swarmtalk::view {

/// Robots, where they are, and who hears whom: what changes ten times a second.
std::string state_json(const Observer& observer, Time now);
/// The same of a swarm without a daemon, for tests.
std::string swarm_state_json(const Swarm& swarm, Time now);

/// Channels, links and programs: what changes slowly.
std::string info_json(const Observer& observer, Time now);
std::string traffic_json(const Traffic& traffic, Time now);

/// All that is known of one robot; "null" for one that is not known.
std::string card_json(const Swarm& swarm, std::uint32_t robot, Time now);

std::string message_json(const HeardMessage& message);
std::string line_json(const LogLine& line, Time now);
std::string notice_json(const std::string& text);
std::string dropped_json(std::uint64_t events, std::uint64_t states);
std::string hello_json(bool may_operate);

}  // namespace swarmtalk::view
