// RecordingReader: what Recorder has written, record by record. Other MCAP files are read too: what
// is not ours comes as kOther. The program's own thread.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>

#include "recording/mcap_reader.hpp"
#include "recording/recorded.pb.h"

namespace swarmtalk::recording {

struct Record {
  enum class Kind { kHeard, kLogLine, kPose, kLosses, kValue, kReception, kOther };
  Kind kind = Kind::kOther;
  std::uint64_t time_ns = 0;  // since 1970
  std::string topic;
  // The one that `kind` names is filled.
  HeardMessage heard;
  LogLine log_line;
  RobotPose pose;
  ChannelLosses losses;
  RobotValue value;
  Reception reception;
};

class RecordingReader {
 public:
  /// @return empty, or one sentence with the file's name
  std::string open(const std::string& path);

  /// The next record, in the file's order. @return false: there are no more; see problem()
  bool next(Record& record);

  /// From the first record again.
  void rewind() {
    unreadable_ = 0;
    mcap_.rewind();
  }

  /// Where the last record is to be found again, and the way there.
  std::uint64_t place() const { return mcap_.place(); }
  void go_to(std::uint64_t place) { mcap_.go_to(place); }

  /// What is not as it should be, one sentence without the file's name; empty: nothing.
  std::string problem() const;
  const McapReader& mcap() const { return mcap_; }

 private:
  std::ifstream file_;
  McapReader mcap_{file_};
  std::uint64_t unreadable_ = 0;  // messages of our schemas that cannot be decoded
};

}  // namespace swarmtalk::recording
