#include "frame/voices.hpp"

#include <algorithm>

namespace swarmtalk::frame {
namespace {

template <typename List>
auto find_in(List& list, const Voice& voice) -> decltype(list.data()) {
  const auto found =
      std::find_if(list.begin(), list.end(), [&](const auto& each) { return each.voice == voice; });
  return found == list.end() ? nullptr : &*found;
}

bool was_heard_before(const HeardVoice& a, const HeardVoice& b) {
  return a.last_at < b.last_at;
}

}  // namespace

const ProvenVoice* Voices::find_proven(const Voice& voice) const {
  return find_in(proven_, voice);
}

const HeardVoice* Voices::find_stranger(const Voice& voice) const {
  return find_in(strangers_, voice);
}

HeardVoice& Voices::heard(const Voice& voice, Ms at) {
  HeardVoice* known = find_proven(voice);
  if (known == nullptr) known = find_stranger(voice);
  if (known != nullptr) {
    known->last_at = std::max(known->last_at, at);
    return *known;
  }
  HeardVoice made;
  made.voice = voice;
  made.first_at = made.last_at = at;
  if (strangers_.size() < kMostStrangers) return strangers_.emplace_back(made);
  return *std::min_element(strangers_.begin(), strangers_.end(), was_heard_before) = made;
}

void Voices::prove(const Voice& voice, std::uint32_t counter, std::uint32_t stamp, Ms drawn_at,
                   Ms at) {
  if (ProvenVoice* const known = find_proven(voice)) {
    known->clock.prove(stamp, drawn_at, at);
    known->proven_at = at;
    known->asks = 0;
    known->is_doubted = false;
    return;
  }
  ProvenVoice made{HeardVoice{}, counter, CounterWindow::from(counter),
                   StampClock(stamp, drawn_at)};
  if (HeardVoice* const stranger = find_stranger(voice)) {
    static_cast<HeardVoice&>(made) = *stranger;
    *stranger = strangers_.back();
    strangers_.pop_back();
  } else {
    made.first_at = at;
  }
  made.voice = voice;
  made.last_at = at;
  made.asks = 0;
  made.asked_at.reset();
  made.proven_at = at;
  add(made, at);
}

void Voices::add(const ProvenVoice& made, Ms at) {
  if (proven_.size() < kMostProven) {
    proven_.push_back(made);
    return;
  }
  ++evicted_;
  remembers_since_ = at;
  *std::min_element(proven_.begin(), proven_.end(), was_heard_before) = made;
}

}  // namespace swarmtalk::frame
