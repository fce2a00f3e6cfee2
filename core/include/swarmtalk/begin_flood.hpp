// How a flood's record is found or begun on the usual packet's way. Definitions of DuplicateCache's
// members, included by duplicate_cache.hpp only.
#pragma once

#include "swarmtalk/duplicate_cache.hpp"

namespace swarmtalk {
namespace core {

/// Whether the TTL alone tells that a flood comes from its sender itself, and nothing in a lone
/// packet contradicts itself: what begin_next_flood() is for.
template <class P>
constexpr bool knows_next_flood() {
  return DuplicateCache<P>::kSummarizes && P::kHopsBits == 0 && P::kHopsFromTtl &&
         !P::kLimitsForwarding && P::kSizeBits == 0 && P::kTimestampedBits == 0 &&
         !Wire<P>::kLimitsPlaces;
}

template <class P>
template <class Node>
SWARMTALK_HOT typename DuplicateCache<P>::Entry* DuplicateCache<P>::begin_flood(
    const Key& key, uint8_t kind, Mask bit, bool& is_copy, Node& node) {
  if (kNumbersReturn) {
    auto* const chain = Lookup::summary_of(key);
    return chain == nullptr ? nullptr : begin_flood_in(*chain, key, kind, bit, is_copy, node);
  }
  Entry* record = find(key);
  if (record != nullptr && record->is_open()) return nullptr;
  is_copy = record != nullptr && !is_over(*record);
  if (is_copy) return record;
  const Index hand = Lookup::hand();
  record = begin(record, key, kind, true, node);
  if (record == nullptr) Lookup::hand() = hand;
  return record;
}

template <class P>
template <class Node>
SWARMTALK_HOT typename DuplicateCache<P>::Entry* DuplicateCache<P>::begin_next_flood(const Key& key,
                                                                                     Node& node) {
  auto* const chain = Lookup::summary_of(key);
  if (SWARMTALK_SELDOM(chain == nullptr)) return nullptr;
  Index place = chain->place_of(key);
  const bool is_known = place != 0;
  if (!is_known) place = chain->oldest();
  if (SWARMTALK_SELDOM(place == 0)) return nullptr;
  Entry& record = *computed_once(computed_once(records_) + place - 1);
  const uint8_t flags = record.flags;
  if (flags != 0) {
    if ((flags & Entry::kOpen) != 0) return nullptr;
    const Ticks passed = since(record);
    constexpr uint8_t kWay = Entry::kFlood | Entry::kDirect;
    if (passed <= kFloodLife &&
        (!is_known || passed <= kOneHopLife || (flags & kWay) != kWay || !record.is_overtaken())) {
      return nullptr;
    }
  }
  if (is_known) {
    note_chain(*chain, key, node);
  } else {  // the eighth message before this one was the one that makes place, if any
    Lookup::note_last(records_, *chain,
                      [this, &key, &node](Entry& last) { note(last, key, node); });
    chain->move(record.key, key, place);
    record.key = key;
  }
  chain->count_begun(record, key);
  return &record;
}

template <class P>
SWARMTALK_HOT void DuplicateCache<P>::close_flood(Entry& record, Mask forwarded) {
  record.flags = Entry::kFlood | Entry::kDirect | Entry::kDone;
  record.forwarded = forwarded;
  record.held = static_cast<Mask>(~Mask{0});
  renew_stamp(record);
}

template <class P>
template <class Summary, class Node>
SWARMTALK_HOT typename DuplicateCache<P>::Entry* DuplicateCache<P>::begin_flood_in(
    Summary& chain, const Key& key, uint8_t kind, Mask bit, bool& is_copy, Node& node) {
  Index place = chain.place_of(key);
  const bool is_known = place != 0;
  if (!is_known) place = chain.oldest();
  if (place == 0) return nullptr;
  Entry& record = records_[place - 1];
  if (record.is_open()) return nullptr;
  if (is_known) {
    if (!is_of_later(record, (kind & Entry::kDirect) != 0, bit)) {
      is_copy = true;
      return &record;
    }
  } else if (!is_over(record)) {
    return nullptr;
  }
  note_chain(chain, key, node);
  if (!is_known) chain.move(record.key, key, place);
  renew(record, key, kind);
  chain.count_begun(record, key);
  return &record;
}

}  // namespace core
}  // namespace swarmtalk
