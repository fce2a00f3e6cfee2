// Makes up stories for the cycle search: swarms of neighbours with messages under way, floods,
// copies, losses, one's own messages, time; and variations of stories that are there. All from one
// seeded source of random numbers; knows the library from outside only.
#pragma once

#include <cstddef>

#include "tests/avr/random_numbers.hpp"
#include "tests/avr/story.hpp"

namespace swarmtalk::avr {

class StoryTeller {
 public:
  explicit StoryTeller(uint64_t seed) : random_(seed) {}

  /// A new story: some swarms, one after the other, that the node gets into.
  Story tell();
  /// The same with about `steps` more, of a swarm drawn anew.
  void go_on(Story& story, size_t steps);
  /// One step more that has to do with what came before.
  Step next_of(const Story& story);
  /// A story like `story`, with parts of `other`.
  Story vary(const Story& story, const Story& other);
  Random& random() { return random_; }

  static constexpr size_t kMostSteps = 500;

 private:
  Start draw_start();
  uint32_t draw_ticks();
  uint8_t draw_channel(const Start& start);
  void change(Step& step, const Start& start);
  void change_many(Story& story);
  void vary_once(Story& story, const Story& other);

  Random random_;
};

}  // namespace swarmtalk::avr
