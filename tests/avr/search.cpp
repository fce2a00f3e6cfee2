#include "tests/avr/search.hpp"

#include <algorithm>

namespace swarmtalk::avr {
namespace {

constexpr size_t kProbes = 8;
constexpr unsigned kProbedPercent = 6;  // of all steps

uint8_t kind_of(const Start& start) {
  return static_cast<uint8_t>((start.fixed_id == kDrawnId ? 1 : 0) |
                              (start.channels[1].id >= 8 ? 2 : 0));
}

}  // namespace

void Search::note(const Call& call, const EmulatedNode::State& before) {
  ++calls_;
  Find& find = finds_[{call.is_pull, call.counted, kind_of(story_.start), island_}];
  if (call.cycles < find.cycles) return;
  const bool is_worse = call.cycles > find.cycles;
  // Another way to the same: variations of it may come farther.
  if (!is_worse && story_.steps.size() > find.story.steps.size()) return;
  find.cycles = call.cycles;
  find.story = story_;
  find.before = before;
  uint32_t& most = most_[call.is_pull];
  if (call.cycles <= most) return;
  most = call.cycles;
  if (on_worse_) on_worse_(call.is_pull, call.cycles, calls_);
}

void Search::run_step(const Step& step) {
  EmulatedNode::State before = node_.save();
  story_.steps.push_back(step);
  node_.run(step, [&](const Call& call) { note(call, before); });
}

void Search::probe(size_t times) {
  const EmulatedNode::State here = node_.save();
  for (size_t n = 0; n < times; ++n) {
    run_step(teller_.next_of(story_));
    story_.steps.pop_back();
    node_.restore(here);
  }
}

void Search::tell(const Story& story) {
  node_.start(story.start);
  story_ = Story();
  story_.start = story.start;
  for (const Step& step : story.steps) {
    run_step(step);
    if (teller_.random().chance(kProbedPercent)) probe(kProbes);
  }
  probe(kProbes);
}

/// Goes on from the state before a find's last step.
void Search::extend(const Find& find) {
  node_.restore(find.before);
  story_ = find.story;
  story_.steps.pop_back();
  probe(2 * kProbes);
  if (teller_.random().chance(50)) run_step(find.story.steps.back());
  const size_t known = story_.steps.size();
  Story longer = story_;
  teller_.go_on(longer, 1 + teller_.random().low_below(60));
  for (size_t i = known; i < longer.steps.size(); ++i) {
    run_step(longer.steps[i]);
    if (teller_.random().chance(4 * kProbedPercent)) probe(kProbes);
  }
}

/// One of those to go on from, or null.
const Find* Search::draw_find() {
  const bool is_pull = teller_.random().chance(40);
  std::vector<const Find*> finds;
  for (const auto& [kind, find] : finds_) {
    const bool is_here = island_ == kIslands || std::get<3>(kind) == island_;
    if (std::get<0>(kind) == is_pull && is_here) finds.push_back(&find);
  }
  if (finds.empty()) return nullptr;
  std::stable_sort(finds.begin(), finds.end(),
                   [](const Find* a, const Find* b) { return a->cycles > b->cycles; });
  Random& random = teller_.random();
  const size_t most = random.chance(50) ? std::min<size_t>(finds.size(), 5) : finds.size();
  return finds[random.low_below(most)];
}

void Search::run(uint64_t calls) {
  Random& random = teller_.random();
  const uint64_t stay = (calls - std::min(calls, calls_)) * 3 / (4 * kIslands) + 1;
  const uint64_t from = calls_;
  while (calls_ < calls) {
    island_ = static_cast<uint8_t>(std::min<uint64_t>((calls_ - from) / stay, kIslands));
    const Find* const drawn = draw_find();
    const Find* const other = draw_find();
    if (drawn == nullptr || other == nullptr || random.chance(20)) {
      tell(teller_.tell());
    } else if (random.chance(40)) {
      extend(Find(*drawn));  // a copy: the finds change meanwhile
    } else {
      tell(teller_.vary(drawn->story, other->story));
    }
  }
}

std::vector<Find> Search::worst(bool is_pull, bool is_drawn, size_t most) const {
  std::map<uint32_t, const Find*> kinds;  // by what they counted, of all islands
  for (const auto& [kind, find] : finds_) {
    const bool find_is_drawn = find.story.start.fixed_id == kDrawnId;
    if (std::get<0>(kind) != is_pull || find_is_drawn != is_drawn) continue;
    const Find*& worst = kinds[std::get<1>(kind)];
    if (worst == nullptr || find.cycles > worst->cycles) worst = &find;
  }
  std::vector<Find> finds;
  for (const auto& [kind, find] : kinds) finds.push_back(*find);
  std::stable_sort(finds.begin(), finds.end(),
                   [](const Find& a, const Find& b) { return a.cycles > b.cycles; });
  if (finds.size() > most) finds.resize(most);
  return finds;
}

/// @param at  gets the step of the worst call
uint32_t Search::most_of(const Story& story, bool is_pull, size_t& at) {
  uint32_t most = 0;
  node_.start(story.start);
  for (size_t i = 0; i < story.steps.size(); ++i) {
    node_.run(story.steps[i], [&](const Call& call) {
      ++calls_;
      if (call.is_pull == is_pull && call.cycles > most) {
        most = call.cycles;
        at = i;
      }
    });
  }
  return most;
}

Find Search::shorten(const Find& find, bool is_pull) {
  Find shortest = find;
  size_t at = 0;
  for (size_t part = find.story.steps.size() / 2; part != 0;
       part = part == 1 ? 0 : (part + 1) / 2) {
    for (size_t from = 0; from + 1 < shortest.story.steps.size();) {
      Story shorter = shortest.story;
      std::vector<Step>& steps = shorter.steps;
      const size_t to = std::min(from + part, steps.size() - 1);
      steps.erase(steps.begin() + static_cast<std::ptrdiff_t>(from),
                  steps.begin() + static_cast<std::ptrdiff_t>(to));
      const uint32_t cycles = most_of(shorter, is_pull, at);
      if (cycles >= shortest.cycles) {
        steps.resize(at + 1);
        shortest.story = shorter;
        shortest.cycles = cycles;
      } else {
        from += part;
      }
    }
  }
  return shortest;
}

}  // namespace swarmtalk::avr
