// TimeOrder: records of a recording by their times. A recorder writes what it is handed, and a
// daemon hands out the messages of several channels that came in one moment channel by channel: in
// the file they may be a moment out of order. The program's own thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "recording/recording_reader.hpp"

namespace swarmtalk::recording {

class TimeOrder {
 public:
  static constexpr std::chrono::seconds kWindow{1};  // later ones are no further behind in a file
  static constexpr std::size_t kMostWaiting = 1024;
  static constexpr std::size_t kMostWaitingBytes = 4 * 1024 * 1024;  // whoever made the file

  /// From where the reader stands. @param reader  must outlive it
  /// @param wants  whether a record is to come at all
  TimeOrder(RecordingReader& reader, std::function<bool(const Record&)> wants)
      : reader_(reader), wants_(std::move(wants)) {}

  /// Of records that are taken one after the other: those that come after later ones.
  class Misplaced {
   public:
    /// @param tolerance  by which a record may be earlier
    explicit Misplaced(std::chrono::nanoseconds tolerance) : tolerance_ns_(tolerance.count()) {}
    void note(std::uint64_t time_ns);
    /// One sentence without the file's name; empty: there are none. @param thing  "message"
    std::string text(std::string_view thing) const;

   private:
    std::uint64_t tolerance_ns_;
    std::uint64_t latest_ns_ = 0;
    std::uint64_t count_ = 0;
  };

  /// The next record; those of one time in the file's order. @return false: there are no more
  bool next(Record& record);

 private:
  bool read_one();
  bool is_first_known() const;

  RecordingReader& reader_;
  std::function<bool(const Record&)> wants_;
  std::deque<Record> waiting_;     // by time
  std::size_t waiting_bytes_ = 0;  // of their messages
  bool has_more_ = true;
};

}  // namespace swarmtalk::recording
