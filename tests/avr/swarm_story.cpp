#include "tests/avr/swarm_story.hpp"

#include <iterator>

namespace swarmtalk::avr {

uint32_t draw_wait(Random& random) {
  static constexpr uint32_t kWaits[] = {0,
                                        1,
                                        1,
                                        2,
                                        3,
                                        8,
                                        9,
                                        16,
                                        16,
                                        32,
                                        100,
                                        101,
                                        128,
                                        300,
                                        1000,
                                        65536,
                                        70'000,
                                        1'000'000,
                                        UINT32_MAX - 300};
  return random.chance(30) ? random.below(300) : kWaits[random.below(std::size(kWaits))];
}

SwarmStory::SwarmStory(Random& random, const Start& start) : random_(random), start_(start) {
  draw_habits();
  neighbours_.resize(1 + random_.below(40));
  // Swarms of one story may be the same robots, or others.
  uint8_t id = random_.chance(50) ? 10 : random_.between(0, 200);
  const uint8_t step = random_.chance(80) ? 1 : 3;
  const uint8_t number = random_.between(0, 15);
  for (Neighbour& neighbour : neighbours_) {
    neighbour.id = id;
    id = static_cast<uint8_t>((id + step) % 255);
    neighbour.message = number;
    begin_message(neighbour);
  }
}

void SwarmStory::draw_habits() {
  Habits& habits = habits_;
  habits.in_turn = random_.chance(60) ? 100 : often();
  habits.flood = random_.chance(30) ? 100 : often();
  habits.first = random_.chance(30) ? 100 : random_.below(101);
  habits.second = random_.chance(50) ? 100 - habits.first : random_.below(101 - habits.first);
  habits.any_number = random_.chance(80) ? 0 : often();
  habits.any_order = random_.chance(70) ? 0 : often();
  habits.lost = random_.chance(50) ? 0 : seldom();
  habits.unfinished = random_.chance(60) ? 0 : often();
  habits.copies = seldom();
  habits.better = often();
  habits.contradicts = random_.chance(80) ? 0 : seldom();
  habits.pulls = random_.chance(40) ? seldom() : often();
  habits.sends = seldom();
  habits.echoes = seldom();
  habits.collisions = random_.chance(80) ? 0 : seldom();
  habits.far = random_.chance(80) ? 0 : seldom();
  habits.waits = often();
  const bool is_mixed = random_.chance(50);
  most_packets_ = random_.chance(40) ? 8 : random_.between(1, 8);
  least_packets_ = is_mixed ? random_.between(1, most_packets_) : most_packets_;
  most_ttl_ = random_.between(1, 15);
  ticks_ = draw_wait(random_);
}

uint8_t SwarmStory::draw_channel() {
  const unsigned draw = random_.below(100);
  if (draw < habits_.first) return start_.channels[0].id;
  if (draw < habits_.first + habits_.second) return start_.channels[1].id;
  return random_.between(0, 15);
}

void SwarmStory::begin_message(Neighbour& neighbour) {
  neighbour.message = static_cast<uint8_t>(
      random_.chance(habits_.any_number) ? random_.below(16) : (neighbour.message + 1) % 16);
  neighbour.packets = random_.between(least_packets_, most_packets_);
  neighbour.left = static_cast<uint8_t>((1u << neighbour.packets) - 1);
  neighbour.channel = draw_channel();
  neighbour.ttl = random_.chance(habits_.flood) ? random_.between(1, most_ttl_) : uint8_t{0};
  neighbour.body = random_.between(0, 255);
}

Step SwarmStory::packet_of(Neighbour& neighbour) {
  if (neighbour.left == 0 || (random_.chance(12) && random_.chance(habits_.unfinished)))
    begin_message(neighbour);
  uint8_t sequence = 0;
  if (random_.chance(habits_.any_order)) sequence = random_.between(0, 7);
  while ((neighbour.left >> sequence & 1) == 0) sequence = (sequence + 1) & 7;
  neighbour.left = static_cast<uint8_t>(neighbour.left & ~(1u << sequence));
  Step step;
  step.kind = Step::Kind::kHear;
  step.from = neighbour.id;
  step.message = neighbour.message;
  step.sequence = sequence;
  if (sequence + 1 == neighbour.packets) step.flags |= Step::kEnd;
  step.channel = neighbour.channel;
  step.ttl = neighbour.ttl;
  step.body = neighbour.body;
  return step;
}

void SwarmStory::hear_one(std::vector<Step>& steps) {
  if (random_.chance(habits_.in_turn)) {
    turn_ = (turn_ + 1) % neighbours_.size();
  } else {
    turn_ = random_.below(neighbours_.size());
  }
  Step step = packet_of(neighbours_[turn_]);
  if (random_.chance(habits_.lost)) return;
  if (random_.chance(habits_.far)) step.flags |= Step::kFar;
  if (random_.chance(habits_.collisions)) step.flags |= Step::kOwn;
  if (random_.chance(habits_.contradicts)) {
    step.sequence = random_.between(0, 7);
    step.flags ^= Step::kEnd;
  }
  if (random_.chance(1)) step.flags |= Step::kDamaged;
  steps.push_back(step);
  if (random_.chance(habits_.copies)) {
    if (random_.chance(habits_.better)) step.ttl = random_.between(step.ttl, 15);
    steps.push_back(step);
  }
}

void SwarmStory::own_affairs(std::vector<Step>& steps) {
  Step step;
  if (random_.chance(habits_.sends)) {
    step.kind = Step::Kind::kSend;
    step.channel = random_.between(0, 1);
    step.count = random_.chance(50) ? 40 : random_.between(1, 40);
    if (start_.channels[step.channel].id >= 8 && step.count > 24) step.count = 24;
    step.ttl = random_.chance(habits_.flood) ? random_.between(1, most_ttl_) : uint8_t{0};
    steps.push_back(step);
  }
  if (random_.chance(habits_.pulls)) {
    step = Step();
    step.ticks = random_.chance(20) ? ticks_ : 0;
    steps.push_back(step);
  }
  if (random_.chance(habits_.echoes)) {
    step = Step();
    step.kind = Step::Kind::kEcho;
    step.count = static_cast<uint8_t>(random_.low_below(16));
    step.ttl = random_.between(0, most_ttl_);
    steps.push_back(step);
  }
  if (random_.chance(habits_.waits) && ticks_ != 0) {
    step = Step();
    step.kind = Step::Kind::kWait;
    step.ticks = ticks_;
    if (ticks_ > 300) ticks_ = random_.below(20);
    steps.push_back(step);
  }
}

void SwarmStory::tell(std::vector<Step>& steps) {
  hear_one(steps);
  own_affairs(steps);
}

}  // namespace swarmtalk::avr
