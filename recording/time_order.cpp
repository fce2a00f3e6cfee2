#include "recording/time_order.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::recording {
namespace {

std::size_t message_bytes(const Record& record) {
  return record.heard.payload().size() + record.heard.text().size();
}

}  // namespace

bool TimeOrder::is_first_known() const {
  constexpr std::uint64_t kWindowNs = std::chrono::nanoseconds(kWindow).count();
  if (waiting_.size() >= kMostWaiting || waiting_bytes_ >= kMostWaitingBytes) return true;
  return !waiting_.empty() && waiting_.back().time_ns - waiting_.front().time_ns >= kWindowNs;
}

bool TimeOrder::read_one() {
  Record record;
  if (!reader_.next(record)) return false;
  if (!wants_(record)) return true;
  waiting_bytes_ += message_bytes(record);
  const auto is_before = [](std::uint64_t time_ns, const Record& other) {
    return time_ns < other.time_ns;
  };
  const auto at = std::upper_bound(waiting_.begin(), waiting_.end(), record.time_ns, is_before);
  waiting_.insert(at, std::move(record));
  return true;
}

bool TimeOrder::next(Record& record) {
  while (has_more_ && !is_first_known()) has_more_ = read_one();
  if (waiting_.empty()) return false;
  record = std::move(waiting_.front());
  waiting_.pop_front();
  waiting_bytes_ -= message_bytes(record);
  return true;
}

}  // namespace swarmtalk::recording
