#include "view/recording_index.hpp"

#include <algorithm>

namespace swarmtalk::view {
namespace {

using recording::Record;

constexpr std::uint64_t kMostTimeNs = std::uint64_t{1} << 62;  // in the year 2116
constexpr std::uint64_t kMarkNs = 500'000'000;                 // where there are no chunks
constexpr std::uint64_t kSecondNs = 1'000'000'000;

}  // namespace

bool RecordingIndex::has_time(const Record& record) {
  return record.time_ns < kMostTimeNs;
}

void RecordingIndex::scan(recording::RecordingReader& reader) {
  std::map<std::uint64_t, std::uint32_t> messages_by_second;
  Record record;
  while (reader.next(record)) {
    if (record.kind == Record::Kind::kOther) continue;
    if (!has_time(record)) {
      ++bad_times_;
      continue;
    }
    note_place(reader.place());
    misplaced_.note(record.time_ns);
    first_ns_ = records_ == 0 ? record.time_ns : std::min(first_ns_, record.time_ns);
    last_ns_ = std::max(last_ns_, record.time_ns);
    ++records_;
    if (record.kind != Record::Kind::kHeard) continue;
    ++messages_by_second[record.time_ns / kSecondNs];
    note_channel(record.heard);
  }
  count_bars(messages_by_second);
}

void RecordingIndex::note_place(std::uint64_t place) {
  const bool is_new = marks_.empty() || marks_.back().place != place;
  if (is_new && (marks_.empty() || last_ns_ - marks_.back().latest_before_ns >= kMarkNs)) {
    marks_.push_back({place, last_ns_, records_});
  }
}

void RecordingIndex::note_channel(const recording::HeardMessage& heard) {
  if (numbers_.size() >= kMostNames || heard.channel() == "debug") return;
  const auto number = static_cast<std::uint16_t>(heard.channel_number());
  numbers_.try_emplace(heard.channel(), number);
  numbers_.try_emplace(std::to_string(number), number);
}

void RecordingIndex::count_bars(const std::map<std::uint64_t, std::uint32_t>& messages_by_second) {
  bars_.assign(kBars, 0);
  const double length_s = static_cast<double>(last_ns_ - first_ns_) / 1e9;
  for (const auto& [second, count] : messages_by_second) {
    const double at_s = static_cast<double>(second) - static_cast<double>(first_ns_) / 1e9 + 0.5;
    const double part = length_s > 0 ? std::clamp(at_s / length_s, 0.0, 1.0) : 0.0;
    bars_[std::min(static_cast<std::size_t>(part * kBars), kBars - 1)] += count;
  }
}

std::optional<std::uint16_t> RecordingIndex::number_of(const std::string& name) const {
  const auto found = numbers_.find(name);
  return found == numbers_.end() ? std::nullopt : std::optional(found->second);
}

RecordingIndex::Start RecordingIndex::start_before(std::uint64_t time_ns, std::uint64_t memory_ns,
                                                   std::uint64_t most_records) const {
  const auto is_later = [](std::uint64_t ns, const Mark& mark) {
    return ns < mark.latest_before_ns;
  };
  const std::uint64_t from_ns = time_ns > memory_ns ? time_ns - memory_ns : 0;
  auto mark = std::upper_bound(marks_.begin(), marks_.end(), from_ns, is_later);
  if (mark != marks_.begin()) --mark;
  const auto target = std::upper_bound(marks_.begin(), marks_.end(), time_ns, is_later);
  const std::uint64_t last = target == marks_.end() ? records_ : target->records_before;
  while (mark + 1 != marks_.end() && (mark + 1)->latest_before_ns <= time_ns &&
         last - mark->records_before > most_records) {
    ++mark;
  }
  return {mark->place, mark->latest_before_ns};
}

}  // namespace swarmtalk::view
