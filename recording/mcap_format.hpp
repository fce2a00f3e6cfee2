// What an MCAP file is made of (https://mcap.dev/spec, version 0): magic bytes, the numbers of its
// records, and the three records that readers and writers both hold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace swarmtalk::recording {

inline constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);
inline constexpr std::size_t kRecordHeadBytes =
    1 + 8;  // number of the record, length of its content
inline constexpr std::size_t kFooterBytes = kRecordHeadBytes + 8 + 8 + 4;
inline constexpr std::string_view kZstd = "zstd";  // name of a chunk's compression

enum class McapOp : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

struct McapSchema {
  std::string name;      // "swarmtalk.recording.HeardMessage"
  std::string encoding;  // "protobuf"
  std::string bytes;     // for protobuf a FileDescriptorSet
  bool operator==(const McapSchema&) const = default;
};

struct McapChannel {
  std::uint16_t schema = 0;  // 0: none
  std::string topic;
  std::string encoding;
  std::map<std::string, std::string> metadata;
  bool operator==(const McapChannel&) const = default;
};

struct McapMessage {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;  // when it was recorded
  std::uint64_t publish_time_ns = 0;
  std::string_view bytes;
};

}  // namespace swarmtalk::recording
