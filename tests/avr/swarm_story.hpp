// The neighbours of a made-up story: who they are, what they send, how the air treats it. Drawn
// once, then asked for one step after the other. Used by StoryTeller only.
#pragma once

#include <vector>

#include "tests/avr/random_numbers.hpp"
#include "tests/avr/story.hpp"

namespace swarmtalk::avr {

class SwarmStory {
 public:
  SwarmStory(Random& random, const Start& start);
  /// What happens next, added to `steps`: one step, or a few.
  void tell(std::vector<Step>& steps);

 private:
  struct Neighbour {
    uint8_t id;
    uint8_t message;
    uint8_t packets;
    uint8_t left;  // a bit for each packet not heard yet
    uint8_t channel;
    uint8_t ttl;
    uint8_t body;
  };
  /// How often things happen, in percent.
  struct Habits {
    unsigned in_turn;      // the next neighbour in turn, not any
    unsigned flood;        // messages that hop
    unsigned first;        // messages on the first channel,
    unsigned second;       // on the second; the rest on channels that the node does not have
    unsigned any_number;   // messages with a random number
    unsigned any_order;    // packets out of order
    unsigned lost;         // packets not heard
    unsigned unfinished;   // messages that stop half way
    unsigned copies;       // packets heard twice
    unsigned better;       // ... the second time with more TTL
    unsigned contradicts;  // packets that do not fit the others of their message
    unsigned pulls;
    unsigned sends;
    unsigned echoes;      // one's own or forwarded packets heard again
    unsigned collisions;  // packets of others under one's own id
    unsigned far;
    unsigned waits;
  };
  unsigned often() { return random_.chance(50) ? 0 : random_.below(101); }
  unsigned seldom() { return random_.chance(60) ? 0 : random_.below(20); }
  void draw_habits();
  void begin_message(Neighbour& neighbour);
  uint8_t draw_channel();
  Step packet_of(Neighbour& neighbour);
  void hear_one(std::vector<Step>& steps);
  void own_affairs(std::vector<Step>& steps);

  Random& random_;
  const Start& start_;
  Habits habits_;
  uint8_t least_packets_;
  uint8_t most_packets_;
  uint8_t most_ttl_;
  uint32_t ticks_;
  std::vector<Neighbour> neighbours_;
  size_t turn_ = 0;
};

/// Ticks that may pass between two calls: mostly few, sometimes enough for all clocks to wrap.
uint32_t draw_wait(Random& random);

}  // namespace swarmtalk::avr
