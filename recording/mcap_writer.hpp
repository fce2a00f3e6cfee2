// McapWriter: an MCAP file, chunk by chunk. A chunk is written whole and synced, so whatever ends
// the recorder, the file is readable up to its last whole chunk; finish() adds the index. Knows
// nothing of SwarmTalk's messages. Not thread-safe; its calls write to the disk and wait for it.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "recording/bytes.hpp"
#include "recording/mcap_format.hpp"

namespace swarmtalk::recording {

class McapWriter {
 public:
  static constexpr std::size_t kChunkBytes = 1024 * 1024;  // a chunk is closed when it is longer

  using Clock = std::chrono::steady_clock;

  explicit McapWriter(Clock::time_point (*now)() = Clock::now) : now_(now) {}
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;
  /// Closes the file as it is; without finish() the open chunk and the index are missing.
  ~McapWriter();

  /// Makes the file. @param replaces  a file of this name may be overwritten
  /// @param library  of the file's header: who wrote it
  /// @return empty, or one sentence: what went wrong
  std::string open(const std::string& path, std::string_view library, bool replaces = false);

  /// @return its number, from 1. At most 65535 of each
  std::uint16_t add_schema(McapSchema schema);
  std::uint16_t add_channel(McapChannel channel);

  /// Adds a message to the open chunk. @param message  its channel has been added
  /// @return false after a failure, see problem(): the message is lost
  bool write(const McapMessage& message);

  /// A record of names and values, on the disk when this returns. The open chunk stays open.
  /// @return false after a failure
  bool write_metadata(std::string_view name, const std::map<std::string, std::string>& values);

  /// Writes the open chunk and waits until the disk has it. Without messages: does nothing.
  /// @return false after a failure: the chunk's messages are lost, the file is as before it
  bool close_chunk();

  /// The last chunk and the index; closes the file. Also after a failure, if there is room.
  /// @return false: the index is missing, or a chunk was lost before
  bool finish();

  /// What went wrong first, one sentence; empty: nothing did.
  const std::string& problem() const { return problem_; }
  std::uint64_t messages() const { return total_.messages; }      // in whole chunks
  std::uint64_t lost_messages() const { return lost_messages_; }  // not written, after a failure
  std::uint64_t open_messages() const { return chunk_count_.messages; }
  std::uint64_t size_bytes() const { return size_bytes_; }
  /// The longest that the disk took for what it was given at once.
  Clock::duration longest_write() const { return longest_write_; }

 private:
  using Index = std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>>;

  struct Count {
    std::uint64_t messages = 0;
    std::uint64_t first_ns = 0;
    std::uint64_t last_ns = 0;
    std::map<std::uint16_t, std::uint64_t> by_channel;
    void add(std::uint16_t channel, std::uint64_t time_ns);
    void add(const Count& other);
  };
  struct ChunkPlace {
    std::uint64_t first_ns, last_ns, at, length;
    std::map<std::uint16_t, std::uint64_t> index_at;
    std::uint64_t index_length, compressed, uncompressed;
  };

  struct MetadataPlace {
    std::uint64_t at, length;
    std::string name;
  };

  /// Takes an older file of this name away. @return why not; empty: done, or there is none
  std::string make_room();
  static void values(ByteWriter& out, const std::map<std::string, std::string>& values);
  static void record(ByteWriter& out, McapOp op, std::string_view content);
  void schema_record(ByteWriter& out, std::uint16_t id) const;
  void channel_record(ByteWriter& out, std::uint16_t id) const;
  bool append(std::string_view bytes);
  bool write_out(std::string_view bytes);
  void drop_chunk();
  std::string summary(std::uint64_t at) const;
  void close();

  Clock::time_point (*now_)();
  Clock::duration longest_write_{};
  int fd_ = -1;
  std::string path_;
  std::string problem_;
  std::uint64_t size_bytes_ = 0;       // of what is whole in the file
  std::uint32_t crc_ = 0;              // of these bytes
  std::vector<McapSchema> schemas_;    // number 1 first
  std::vector<McapChannel> channels_;  // the same
  std::vector<bool> is_schema_written_;
  std::vector<bool> is_channel_written_;
  ByteWriter chunk_;
  Index chunk_index_;
  Count chunk_count_;
  Count total_;
  std::vector<ChunkPlace> chunks_;
  std::vector<MetadataPlace> metadata_;
  std::uint64_t lost_messages_ = 0;
};

}  // namespace swarmtalk::recording
