// Looks for the calls of a node that take the most cycles: stories at random, and variations of
// those that came farthest. What came farthest is kept apart for each kind of call, told by the
// node's counters that it moved, so that the search does not end at the first peak.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "tests/avr/emulated_node.hpp"
#include "tests/avr/story_teller.hpp"

namespace swarmtalk::avr {

/// A story whose last call took so many cycles.
struct Find {
  Story story;
  uint32_t cycles = 0;
  EmulatedNode::State before;  // that last step
};

class Search {
 public:
  /// Told when a call takes more cycles than all of its sort before.
  using OnWorse = std::function<void(bool is_pull, uint32_t cycles, uint64_t calls)>;

  Search(EmulatedNode& node, uint64_t seed, OnWorse on_worse)
      : node_(node), teller_(seed), on_worse_(std::move(on_worse)) {}

  /// Tells a story from elsewhere, to go on from it.
  void learn(const Story& story) { tell(story); }
  /// Goes on until so many calls have been measured.
  void run(uint64_t calls);
  uint64_t calls() const { return calls_; }
  /// The story being told: if the program goes astray, up to the step in which it did.
  const Story& present() const { return story_; }

  /// The `most` worst receives or pulls of different kinds, the worst first.
  /// @param is_drawn  of a node that draws its id, not of one whose id is fixed
  std::vector<Find> worst(bool is_pull, bool is_drawn, size_t most) const;
  /// The same find by as few steps as can be found.
  Find shorten(const Find& find, bool is_pull);

 private:
  /// Receive or pull, what it counted, the kind of start, and the island.
  using Kind = std::tuple<bool, uint32_t, uint8_t, uint8_t>;
  /// The search begins so often anew; then it goes on from all that was found.
  static constexpr uint8_t kIslands = 5;

  void tell(const Story& story);
  void run_step(const Step& step);
  void probe(size_t times);
  void note(const Call& call, const EmulatedNode::State& before);
  void extend(const Find& find);
  const Find* draw_find();
  uint32_t most_of(const Story& story, bool is_pull, size_t& at);

  EmulatedNode& node_;
  StoryTeller teller_;
  OnWorse on_worse_;
  std::map<Kind, Find> finds_;
  uint32_t most_[2] = {0, 0};  // cycles of a receive, of a pull
  Story story_;                // being told
  uint8_t island_ = 0;
  uint64_t calls_ = 0;
};

}  // namespace swarmtalk::avr
