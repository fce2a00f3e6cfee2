#include "recording/recording_reader.hpp"
#include "text/counted.hpp"

#include <sys/stat.h>

#include <cerrno>
#include <cstring>

namespace swarmtalk::recording {
namespace {

bool parse(std::string_view bytes, google::protobuf::MessageLite& out) {
  return out.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

}  // namespace

std::string RecordingReader::open(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
    return "cannot read " + path + ": it is not a regular file";
  }
  file_.open(path, std::ios::binary);
  if (!file_) return "cannot read " + path + ": " + std::strerror(errno);
  const std::string problem = mcap_.open();
  return problem.empty() ? problem : path + ": " + problem;
}

bool RecordingReader::next(Record& record) {
  McapMessage message;
  if (!mcap_.next(message)) return false;
  record.time_ns = message.log_time_ns;
  record.kind = Record::Kind::kOther;
  const McapChannel& channel = *mcap_.channel(message.channel);  // the reader has looked
  record.topic = channel.topic;
  const McapSchema* schema = mcap_.schema(channel.schema);
  if (schema == nullptr || channel.encoding != "protobuf") return true;
  bool is_good = true;
  const auto take = [&](Record::Kind kind, google::protobuf::MessageLite& into) {
    if (schema->name != into.GetTypeName()) return;
    is_good = parse(message.bytes, into);
    if (is_good) record.kind = kind;
  };
  take(Record::Kind::kHeard, record.heard);
  take(Record::Kind::kLogLine, record.log_line);
  take(Record::Kind::kPose, record.pose);
  take(Record::Kind::kLosses, record.losses);
  take(Record::Kind::kValue, record.value);
  take(Record::Kind::kReception, record.reception);
  if (!is_good) ++unreadable_;
  return true;
}

std::string RecordingReader::problem() const {
  std::string text = mcap_.problem();
  if (unreadable_ > 0) {
    text += (text.empty() ? "" : "; ") + text::counted(unreadable_, "record does", "records do") +
            " not fit their schema";
  }
  return text;
}

}  // namespace swarmtalk::recording
