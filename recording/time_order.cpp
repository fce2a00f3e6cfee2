#include "recording/time_order.hpp"

#include <algorithm>
#include <utility>

#include "text/counted.hpp"

namespace swarmtalk::recording {
namespace {

std::size_t message_bytes(const Record& record) {
  return record.heard.payload().size() + record.heard.text().size();
}

}  // namespace

void TimeOrder::Misplaced::note(std::uint64_t time_ns) {
  if (time_ns < latest_ns_ && latest_ns_ - time_ns > tolerance_ns_) ++count_;
  latest_ns_ = std::max(latest_ns_, time_ns);
}

std::string TimeOrder::Misplaced::text(std::string_view thing) const {
  if (count_ == 0) return {};
  const std::string verb = count_ == 1 ? " is" : " are";
  return text::counted(count_, thing) + verb +
         " not in the order of time, and come as soon as the file has them; the tools of MCAP put "
         "them in order: mcap sort FILE -o SORTED";
}

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
