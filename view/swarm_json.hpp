// What the page is told, as JSON texts (docs/view.md lists the fields). What is not known is absent
// or null, never 0. Ages are in milliseconds at the time of the text.
#pragma once

#include <deque>
#include <string>

#include "view/source.hpp"

namespace swarmtalk::view {

/// Robots, where they are, and who hears whom: what changes ten times a second.
std::string state_json(Source& source);
/// The same of a swarm without a daemon, for tests.
std::string swarm_state_json(const Swarm& swarm, Time now);

/// Channels, links and programs: what changes slowly.
std::string info_json(const Source& source);

/// All that is known of one robot; "null" for one that is not known.
std::string card_json(const Swarm& swarm, std::uint32_t robot, Time now);

std::string message_json(const HeardMessage& message);
/// All that a window shows of its channel at first.
std::string messages_json(const std::deque<HeardMessage>& messages);
std::string line_json(const LogLine& line, Time now);
std::string notice_json(const std::string& text);
std::string dropped_json(std::uint64_t events, std::uint64_t states);
/// With what there is to say of a recording.
std::string hello_json(Source& source, bool may_operate);
/// The recording's time has jumped: what was told of messages and lines does not count any more.
/// With the places that led to the new time.
std::string jump_json(Source& source);

}  // namespace swarmtalk::view
