// How a flood's record is found or begun on the usual packet's way. Definitions of DuplicateCache's
// members, included by duplicate_cache.hpp only.
#pragma once

#include "swarmtalk/duplicate_cache.hpp"

namespace swarmtalk {
namespace core {

template <class P>
template <class Node>
SWARMTALK_HOT typename DuplicateCache<P>::Entry* DuplicateCache<P>::begin_flood(
    const Key& key, uint8_t kind, Mask bit, bool& is_copy, Node& node) {
  if (kNumbersReturn) {
    auto* const chain = Lookup::summary_of(records_, key);
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
  chain.count_begun(record);
  return &record;
}

}  // namespace core
}  // namespace swarmtalk
