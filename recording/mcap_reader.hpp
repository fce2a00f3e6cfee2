// McapReader: reads an MCAP file from its beginning, message by message, whoever wrote it and
// however it ended. Any bytes are safe; a chunk counts when it is whole and its CRC is right. The
// index is not needed; where it is whole, it tells where to go on behind a damaged record. Reads
// one chunk at a time; not thread-safe.
#pragma once

#include <cstdint>
#include <istream>
#include <string>
#include <string_view>
#include <unordered_map>

#include "recording/bytes.hpp"
#include "recording/mcap_format.hpp"
#include "recording/mcap_index.hpp"

namespace swarmtalk::recording {

class McapReader {
 public:
  static constexpr std::uint64_t kMaxChunkBytes = 64 * 1024 * 1024;  // packed or not
  /// Of all schemas and channels together, which are kept; a small file may unpack to many.
  static constexpr std::uint64_t kMaxKeptBytes = 32 * 1024 * 1024;

  /// @param in  can be sought; outlives the reader
  explicit McapReader(std::istream& in) : in_(in) {}

  /// @return empty, or one sentence: it is not an MCAP file
  std::string open();

  /// The next message, in the file's order. @param message  its bytes are valid until the next call
  /// @return false: there are no more; see is_cut() and problem()
  bool next(McapMessage& message);

  /// From the first message again. Counts begin again.
  void rewind();

  /// Where in the file the chunk of the last message begins, or that message, if it is in none.
  std::uint64_t place() const { return place_; }

  /// On with the chunk at `place`, which place() has told. Schemas and channels stay known, counts
  /// go on.
  void go_to(std::uint64_t place);

  /// @return null: there is none of this number, up to here
  const McapSchema* schema(std::uint16_t id) const;
  const McapChannel* channel(std::uint16_t id) const;

  /// Once next() has said false: the file ends before its index, so its recorder was stopped.
  bool is_cut() const { return is_cut_; }
  std::uint64_t chunks() const { return chunks_; }
  std::uint64_t messages() const { return messages_; }
  std::uint64_t damaged_chunks() const { return damaged_chunks_; }
  /// What is not as it should be, one sentence; empty: the file is whole.
  std::string problem() const;

 private:
  /// What follows in the file, as far as it is there.
  enum class Step { kMessage, kGoOn, kEnd };

  bool read(std::uint64_t size_bytes, std::string& bytes);
  Step step(McapMessage& message);
  bool read_head(McapOp& op, std::uint64_t& length);
  void skip(std::uint64_t size_bytes);
  bool skip_index(McapOp op, std::uint64_t length);
  void read_index();
  void open_chunk(std::string_view content);
  bool next_in_chunk(McapMessage& message);
  void damage(const std::string& cause);
  bool take_schema(std::string_view content);
  bool take_channel(std::string_view content);
  bool keep(std::size_t size_bytes, std::size_t values = 0);
  bool take_message(std::string_view content, McapMessage& message);

  std::istream& in_;
  std::uint64_t size_bytes_ = 0;
  std::uint64_t at_ = 0;
  std::uint64_t place_ = 0;
  McapIndex index_;
  std::string record_;
  std::string chunk_;
  ByteReader in_chunk_{{}};
  std::unordered_map<std::uint16_t, McapSchema> schemas_;
  std::unordered_map<std::uint16_t, McapChannel> channels_;
  std::uint64_t kept_bytes_ = 0;  // of both, also of those that others have replaced
  std::uint64_t chunks_ = 0;
  std::uint64_t messages_ = 0;
  std::uint64_t damaged_chunks_ = 0;
  std::uint64_t unread_bytes_ = 0;  // behind what was read
  std::string damage_;              // of the first damaged chunk
  bool is_at_data_end_ = false;
  bool is_cut_ = false;
  bool is_index_read_ = false;
};

}  // namespace swarmtalk::recording
