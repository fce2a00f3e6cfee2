// RecordingIndex: what one reading of a whole recording finds: from when to when it is, when its
// messages were, which channels it has, and from which places it can be read on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "recording/recording_reader.hpp"
#include "recording/time_order.hpp"

namespace swarmtalk::view {

class RecordingIndex {
 public:
  static constexpr std::size_t kBars = 200;        // of the picture of messages over time
  static constexpr std::size_t kMostNames = 4096;  // of channels, and their numbers in digits

  /// Where to begin to read.
  struct Start {
    std::uint64_t place = 0;
    std::uint64_t known_since_ns = 0;  // nothing later is missed; 0: all is read
  };

  /// Whether a record can be shown. Its time may be an impossible one.
  static bool is_shown(const recording::Record& record) {
    return record.kind != recording::Record::Kind::kOther && has_time(record);
  }

  /// Reads all of it. @param reader  at its beginning
  void scan(recording::RecordingReader& reader);

  std::uint64_t records() const { return records_; }      // that can be shown
  std::uint64_t bad_times() const { return bad_times_; }  // others, for their times
  // Of the records that can be shown; they need not stand in their order.
  std::uint64_t first_ns() const { return first_ns_; }
  std::uint64_t last_ns() const { return last_ns_; }

  const recording::TimeOrder::Misplaced& misplaced() const { return misplaced_; }

  /// Messages in each of kBars equal parts of the time.
  const std::vector<std::uint32_t>& bars() const { return bars_; }

  /// Of a channel by its name or its digits; none: it has no messages.
  std::optional<std::uint16_t> number_of(const std::string& name) const;

  /// Where to begin to read so that nothing is missed of what is at most `memory_ns` older than
  /// `time_ns`; later if more than `most_records` would have to be read. @pre records() > 0
  Start start_before(std::uint64_t time_ns, std::uint64_t memory_ns,
                     std::uint64_t most_records) const;

 private:
  /// A place in the file from which it can be read on.
  struct Mark {
    std::uint64_t place = 0;
    std::uint64_t latest_before_ns = 0;  // of all records before it
    std::uint64_t records_before = 0;
  };

  static bool has_time(const recording::Record& record);
  void note_place(std::uint64_t place);
  void note_channel(const recording::HeardMessage& heard);
  void count_bars(const std::map<std::uint64_t, std::uint32_t>& messages_by_second);

  std::vector<Mark> marks_;
  std::map<std::string, std::uint16_t> numbers_;  // of channels, by name and digits
  std::vector<std::uint32_t> bars_;
  std::uint64_t records_ = 0;
  std::uint64_t bad_times_ = 0;
  recording::TimeOrder::Misplaced misplaced_{recording::TimeOrder::kWindow};
  std::uint64_t first_ns_ = 0, last_ns_ = 0;
};

}  // namespace swarmtalk::view
