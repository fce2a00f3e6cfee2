#include "tests/virtual/check/shorten.hpp"

#include <algorithm>
#include <cstddef>

namespace swarmtalk::test {

// Halves, quarters, and so on down to single events.
Story shortened(Story story, const std::function<bool(const Story&)>& is_broken, int tries) {
  for (std::size_t piece = story.events.size() / 2; piece > 0; piece /= 2) {
    for (std::size_t at = 0; at < story.events.size();) {
      if (tries-- <= 0) return story;
      Story without = story;
      const auto begin = without.events.begin() + static_cast<std::ptrdiff_t>(at);
      const auto end =
          begin + static_cast<std::ptrdiff_t>(std::min(piece, without.events.size() - at));
      without.events.erase(begin, end);
      if (is_broken(without)) {
        story = std::move(without);
      } else {
        at += piece;
      }
    }
  }
  return story;
}

}  // namespace swarmtalk::test
