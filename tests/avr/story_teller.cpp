#include "tests/avr/story_teller.hpp"

#include <algorithm>

#include "tests/avr/swarm_story.hpp"

namespace swarmtalk::avr {
namespace {

/// Calls that a step makes of a loop without anything heard, at most.
constexpr uint8_t kMostPulls = 40;

}  // namespace

Start StoryTeller::draw_start() {
  Start start;
  start.fixed_id = random_.chance(70) ? uint8_t{250} : kDrawnId;
  start.random = static_cast<uint32_t>(random_.next());
  start.channels[0].id = random_.between(0, 7);
  start.channels[0].ttl = random_.chance(50) ? uint8_t{0} : random_.between(1, 15);
  start.channels[1].id = random_.between(8, 15);
  if (random_.chance(60)) start.channels[1].id = (start.channels[0].id + 1) & 7;
  start.channels[1].ttl = random_.between(0, 15);
  return start;
}

Story StoryTeller::tell() {
  Story story;
  story.start = draw_start();
  const unsigned swarms = 1 + random_.low_below(4);
  for (unsigned i = 0; i < swarms; ++i) go_on(story, 20 + random_.below(180));
  return story;
}

void StoryTeller::go_on(Story& story, size_t steps) {
  if (random_.chance(20)) {  // calls go on while nothing is heard
    Step step;
    step.count = random_.between(1, kMostPulls);
    step.ticks = draw_wait(random_);
    story.steps.push_back(step);
  }
  SwarmStory swarm(random_, story.start);
  const size_t enough = std::min(story.steps.size() + steps, kMostSteps);
  for (size_t n = 0; n < 4 * steps && story.steps.size() < enough; ++n) swarm.tell(story.steps);
}

uint8_t StoryTeller::draw_channel(const Start& start) {
  const uint32_t draw = random_.below(8);
  return draw < 7 ? start.channels[draw % 2].id : random_.between(0, 15);
}

Step StoryTeller::next_of(const Story& story) {
  Step step;
  if (random_.chance(15) || story.steps.empty()) return step;  // a pull
  const size_t back = random_.low_below(story.steps.size());
  step = story.steps[story.steps.size() - 1 - back];
  if (step.kind != Step::Kind::kHear) {
    change(step, story.start);
    return step;
  }
  switch (random_.below(6)) {
    case 0:  // goes on
      step.sequence = (step.sequence + 1) & 7;
      if (random_.chance(40)) step.flags ^= Step::kEnd;
      break;
    case 1:  // a copy
      step.ttl = random_.between(step.ttl, 15);
      break;
    case 2:  // its sender's next message
      step.message = (step.message + 1) & 15;
      step.sequence = 0;
      if (random_.chance(50)) step.flags ^= Step::kEnd;
      break;
    case 3:  // another robot
      step.from = random_.between(0, 254);
      step.sequence = random_.chance(80) ? uint8_t{0} : random_.between(0, 7);
      break;
    default:
      change(step, story.start);
  }
  return step;
}

void StoryTeller::change(Step& step, const Start& start) {
  if (step.kind == Step::Kind::kPull) {
    step.count = random_.between(1, kMostPulls);
    step.ticks = random_.chance(50) ? 0 : draw_wait(random_);
  }
  if (step.kind == Step::Kind::kWait) step.ticks = draw_wait(random_);
  if (step.kind == Step::Kind::kEcho) {
    step.count = static_cast<uint8_t>(random_.below(16));
    step.ttl = random_.between(0, 15);
  }
  if (step.kind == Step::Kind::kSend) {
    step.channel = random_.between(0, 1);
    step.count = random_.between(1, start.channels[step.channel].id >= 8 ? 24 : 40);
    step.ttl = random_.between(0, 15);
  }
  if (step.kind != Step::Kind::kHear) return;
  switch (random_.below(7)) {
    case 0:
      step.from = random_.between(0, 254);
      break;
    case 1:
      step.message = random_.between(0, 15);
      break;
    case 2:
      step.sequence = random_.between(0, 7);
      break;
    case 3:
      step.channel = draw_channel(start);
      break;
    case 4:
      step.ttl = random_.chance(30) ? uint8_t{0} : random_.between(0, 15);
      break;
    case 5:
      step.body = random_.between(0, 255);
      break;
    default:
      step.flags ^= random_.chance(70) ? Step::kEnd : random_.chance(50) ? Step::kOwn : Step::kFar;
  }
}

/// Changes one thing in all packets that have it alike.
void StoryTeller::change_many(Story& story) {
  Step& like = story.steps[random_.below(story.steps.size())];
  if (like.kind != Step::Kind::kHear) return change(like, story.start);
  const Step old = like;
  const uint32_t what = random_.below(4);
  const uint8_t channel = draw_channel(story.start);
  const uint8_t ttl = random_.chance(40) ? uint8_t{0} : random_.between(0, 15);
  const uint8_t from = random_.between(0, 254);
  const uint8_t message = random_.between(0, 15);
  for (Step& step : story.steps) {
    if (step.kind != Step::Kind::kHear) continue;
    if (what == 0 && step.channel == old.channel) step.channel = channel;
    if (what == 1 && step.ttl == old.ttl) step.ttl = ttl;
    if (what == 2 && step.from == old.from) step.from = from;
    if (what == 3 && step.from == old.from && step.message == old.message) step.message = message;
  }
}

void StoryTeller::vary_once(Story& story, const Story& other) {
  std::vector<Step>& steps = story.steps;
  const auto at = [&](size_t place) { return steps.begin() + static_cast<std::ptrdiff_t>(place); };
  if (steps.empty()) return go_on(story, 20);
  const size_t from = random_.below(steps.size());
  const size_t length = std::min<size_t>(steps.size() - from, 1 + random_.low_below(40));
  switch (random_.below(9)) {
    case 0:
      steps.erase(at(from), at(from + length));
      return;
    case 1: {  // once more, elsewhere
      const std::vector<Step> part(at(from), at(from + length));
      steps.insert(at(random_.below(steps.size() + 1)), part.begin(), part.end());
      return;
    }
    case 2: {  // something else happens in between
      Story between;
      between.start = story.start;
      go_on(between, length);
      steps.insert(at(from), between.steps.begin(), between.steps.end());
      return;
    }
    case 3: {  // the other's end
      if (other.steps.empty()) return;
      const size_t other_from = random_.below(other.steps.size());
      if (random_.chance(50)) steps.resize(from);
      steps.insert(steps.end(), other.steps.begin() + static_cast<std::ptrdiff_t>(other_from),
                   other.steps.end());
      return;
    }
    case 4:
      std::swap(steps[from], steps[random_.below(steps.size())]);
      return;
    case 5:
      return change_many(story);
    case 6:
      steps.insert(at(from), next_of(story));
      return;
    case 7:
      if (random_.chance(20)) story.start = draw_start();
      if (random_.chance(50)) story.start.random = static_cast<uint32_t>(random_.next());
      if (random_.chance(50)) story.start.channels[random_.below(2)].ttl = random_.between(0, 15);
      return;
    default:
      for (size_t n = 1 + random_.below(4); n != 0; --n) {
        change(steps[random_.below(steps.size())], story.start);
      }
  }
}

Story StoryTeller::vary(const Story& story, const Story& other) {
  Story varied;
  varied.start = story.start;
  varied.steps = story.steps;
  for (size_t n = 1 + random_.low_below(6); n != 0; --n) vary_once(varied, other);
  if (varied.steps.size() > kMostSteps) {
    varied.steps.erase(varied.steps.begin(),
                       varied.steps.end() - static_cast<std::ptrdiff_t>(kMostSteps));
  }
  return varied;
}

}  // namespace swarmtalk::avr
