// What happens to a node, as a list of calls that any version of the library understands: packets
// heard, pulls, messages sent, time. A story can be told again from a reset, and is written as
// text, a line for each step:
//
//   story NAME
//   start id=250 random=5 channels=0/0,1/5    id=drawn: no fixed id; NUMBER/TTL of both channels
//   as WHAT                                   what the calls from here on are called in a table
//   hear FROM MESSAGE SEQUENCE[e] CHANNEL TTL BODY [own] [far] [damaged]
//                                             e: the message's last packet; BODY: two hex digits;
//                                             own: from the node's own id in place of FROM
//   echo BACK TTL                             hear a packet pulled before again, with this TTL
//   (BACK 0:
//                                             the last one)
//   pull COUNT TICKS                          that often, that many ticks before each
//   send PLACE LENGTH TTL                     on the first or second channel (PLACE 0 or 1)
//   wait TICKS
//
// A line that begins with # is a comment.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "tests/avr/mailbox.hpp"

namespace swarmtalk::avr {

struct Step {
  enum class Kind : uint8_t { kHear, kEcho, kPull, kSend, kWait };
  enum Flag : uint8_t { kEnd = 1, kOwn = 2, kFar = 4, kDamaged = 8 };

  Kind kind = Kind::kPull;
  uint8_t flags = 0;
  uint8_t from = 0;
  uint8_t message = 0;
  uint8_t sequence = 0;
  uint8_t channel = 0;  // number of a packet's channel; place of the one to send on
  uint8_t ttl = 0;
  uint8_t body = 0;   // its high digit fills the payload but the last byte, its low digit that
  uint8_t count = 1;  // pulls; how many pulls back; bytes of a message
  uint32_t ticks = 0;
  uint16_t label = 0;  // place in Story::labels

  bool operator==(const Step&) const = default;
};

struct Start {
  uint8_t fixed_id = 250;  // or kDrawnId
  uint32_t random = 5;
  ChannelSetting channels[2] = {{0, 0}, {1, 5}};
};

struct Story {
  std::string name;
  Start start;
  std::vector<std::string> labels = {""};
  std::vector<Step> steps;
};

std::string to_text(const Step& step);
void write(std::ostream& out, const Story& story);

/// All stories of a file. Throws std::runtime_error that names the line which is wrong.
std::vector<Story> read_stories(std::istream& in);
std::vector<Story> read_stories(const std::string& path);

}  // namespace swarmtalk::avr
