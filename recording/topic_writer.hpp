// TopicWriter: messages of protobuf on named topics of an MCAP file, each schema and topic
// described when it is first used. Knows no clock: the caller tells the times. Not thread-safe.
#pragma once

#include <google/protobuf/message.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "recording/mcap_writer.hpp"

namespace swarmtalk::recording {

class TopicWriter {
 public:
  /// @param time_ns  since 1970 @param sequence  absent: counted by topic
  /// @return false after a failure, see writer().problem(): the message is lost
  bool write(const std::string& topic, const google::protobuf::Message& message,
             std::uint64_t time_ns, std::optional<std::uint32_t> sequence = {});

  /// The same of a message that is encoded already.
  bool write_encoded(const std::string& topic, const McapSchema& schema, std::string_view bytes,
                     std::uint64_t time_ns);

  McapWriter& writer() { return writer_; }
  const McapWriter& writer() const { return writer_; }

 private:
  struct Topic {
    std::uint16_t channel;
    std::uint32_t sequence;
  };

  Topic& topic(const std::string& name, std::uint16_t schema);
  std::uint16_t schema(const google::protobuf::Descriptor& descriptor);

  McapWriter writer_;
  std::map<std::string, std::uint16_t> schemas_;
  std::map<std::string, Topic> topics_;
  std::string bytes_;
};

}  // namespace swarmtalk::recording
