#include "recording/mcap_reader.hpp"

#include "recording/compression.hpp"
#include "recording/crc32.hpp"
#include "text/counted.hpp"
#include "text/plain.hpp"

namespace swarmtalk::recording {
namespace {

constexpr std::size_t kBytesOfAValue = 128;  // beside its bytes, of each schema, channel, key

}  // namespace

std::string McapReader::open() {
  in_.seekg(0, std::ios::end);
  const auto end = in_.tellg();
  size_bytes_ = end > 0 ? static_cast<std::uint64_t>(end) : 0;
  index_ = read_mcap_index(in_, size_bytes_);
  rewind();
  if (at_ != 0) return {};
  return size_bytes_ < kMcapMagic.size()
             ? "it is too short to be a recording: " + text::counted(size_bytes_, "byte")
             : "it is not an MCAP file: its first bytes are others";
}

void McapReader::rewind() {
  in_.clear();
  in_.seekg(0);
  at_ = 0;
  in_chunk_ = ByteReader({});
  schemas_.clear();  // what comes late in the file is not known yet
  channels_.clear();
  kept_bytes_ = chunks_ = messages_ = damaged_chunks_ = unread_bytes_ = 0;
  is_at_data_end_ = is_cut_ = is_index_read_ = false;
  damage_.clear();
  if (!read(kMcapMagic.size(), record_) || record_ != kMcapMagic) at_ = 0;
}

void McapReader::go_to(std::uint64_t place) {
  if (place < kMcapMagic.size() || place > size_bytes_) return;
  in_.clear();
  in_.seekg(static_cast<std::streamoff>(place));
  at_ = place_ = place;
  in_chunk_ = ByteReader({});
  is_at_data_end_ = is_cut_ = false;
}

const McapSchema* McapReader::schema(std::uint16_t id) const {
  const auto found = schemas_.find(id);
  return found == schemas_.end() ? nullptr : &found->second;
}

const McapChannel* McapReader::channel(std::uint16_t id) const {
  const auto found = channels_.find(id);
  return found == channels_.end() ? nullptr : &found->second;
}

/// All of it or nothing. What the file does not hold is never allocated.
bool McapReader::read(std::uint64_t size_bytes, std::string& bytes) {
  if (size_bytes > size_bytes_ - at_) return false;
  bytes.resize(static_cast<std::size_t>(size_bytes));
  in_.read(bytes.data(), static_cast<std::streamsize>(size_bytes));
  if (static_cast<std::uint64_t>(in_.gcount()) != size_bytes) return false;
  at_ += size_bytes;
  return true;
}

bool McapReader::next(McapMessage& message) {
  if (at_ == 0) return false;
  for (;;) {
    if (next_in_chunk(message)) return true;
    const Step now = is_at_data_end_ || is_cut_ ? Step::kEnd : step(message);
    if (now == Step::kMessage) return true;
    if (now == Step::kEnd) return false;
  }
}

McapReader::Step McapReader::step(McapMessage& message) {
  const std::uint64_t record_at = at_;
  place_ = record_at;
  const auto cut = [&] {
    is_cut_ = true;
    unread_bytes_ = size_bytes_ - record_at;
    return Step::kEnd;
  };
  McapOp op{};
  std::uint64_t length = 0;
  const bool is_head_good = read_head(op, length);
  if (const auto place = index_.behind_damage(record_at, is_head_good, op, length)) {
    damage("the head of a record is damaged");
    at_ = 0;
    skip(*place);
    return Step::kGoOn;
  }
  if (!is_head_good) return cut();
  switch (op) {
    case McapOp::kDataEnd:
    case McapOp::kFooter:
      is_at_data_end_ = true;
      is_cut_ = !skip_index(op, length);  // the index, and no message
      return Step::kEnd;
    case McapOp::kSchema:
    case McapOp::kChannel:
    case McapOp::kMessage:
    case McapOp::kChunk:
      break;
    default:  // the header, indexes, attachments, and what later versions may add
      skip(length);
      return Step::kGoOn;
  }
  if (length > kMaxChunkBytes) {
    skip(length);
    damage("a chunk is longer than 64 MiB");
    return Step::kGoOn;
  }
  if (!read(length, record_)) return cut();
  if (op == McapOp::kChunk) {
    open_chunk(record_);
  } else if (op == McapOp::kMessage) {
    if (take_message(record_, message)) {
      ++messages_;
      return Step::kMessage;
    }
    damage("a message is not whole, or of a channel that is not in the file");
  } else if (op == McapOp::kSchema ? !take_schema(record_) : !take_channel(record_)) {
    damage("a schema or a channel is not whole");
  }
  return Step::kGoOn;
}

void McapReader::skip(std::uint64_t size_bytes) {
  at_ += size_bytes;
  in_.clear();
  in_.seekg(static_cast<std::streamoff>(at_));
}

/// From the content of the record `op` to the end of the recording, which need not be that of the
/// file. @return false: the file ends before
bool McapReader::skip_index(McapOp op, std::uint64_t length) {
  skip(length);
  while (op != McapOp::kFooter) {
    if (!read_head(op, length)) return false;
    skip(length);
  }
  if (!read(kMcapMagic.size(), record_) || record_ != kMcapMagic) return false;
  unread_bytes_ = size_bytes_ - at_;
  return true;
}

/// @return false: the file does not hold a record here
bool McapReader::read_head(McapOp& op, std::uint64_t& length) {
  if (!read(kRecordHeadBytes, record_)) return false;
  ByteReader head(record_);
  op = static_cast<McapOp>(head.u8());
  length = head.u64();
  return length <= size_bytes_ - at_;
}

/// Schemas and channels stand in the index once more: where a chunk cannot be read, those that only
/// it held are taken from there.
void McapReader::read_index() {
  if (is_index_read_) return;
  is_index_read_ = true;
  const std::uint64_t back_at = at_;
  std::string record;
  const auto footer = read_mcap_footer(in_, size_bytes_);
  at_ = 0;
  if (footer) skip(std::min(footer->index_at, size_bytes_));
  McapOp op{};
  std::uint64_t length = 0;
  while (at_ > 0 && read_head(op, length) && op != McapOp::kFooter) {
    const bool is_wanted = op == McapOp::kSchema || op == McapOp::kChannel;
    if (!is_wanted || length > kMaxChunkBytes) {
      skip(length);
    } else if (!read(length, record) ||
               !(op == McapOp::kSchema ? take_schema(record) : take_channel(record))) {
      break;
    }
  }
  at_ = 0;
  skip(back_at);
}

void McapReader::open_chunk(std::string_view content) {
  ByteReader reader(content);
  reader.u64();  // first and last time
  reader.u64();
  const std::uint64_t size_bytes = reader.u64();
  const std::uint32_t crc = reader.u32();
  const std::string_view compression = reader.counted();
  const std::string_view packed = reader.take(reader.u64());
  if (!reader.is_good()) return damage("a chunk's fields do not fit into it");
  if (!compression.empty() && compression != kZstd) {
    return damage("a chunk is compressed with '" + text::plain(compression.substr(0, 16)) +
                  "'; this program knows zstd");
  }
  if (size_bytes > kMaxChunkBytes) return damage("a chunk is longer than 64 MiB");
  if (!decompress(compression, packed, static_cast<std::size_t>(size_bytes), chunk_)) {
    return damage("a chunk cannot be unpacked");
  }
  if (crc != 0 && crc32(chunk_) != crc) return damage("a chunk has a wrong CRC");
  ++chunks_;
  in_chunk_ = ByteReader(chunk_);
}

bool McapReader::next_in_chunk(McapMessage& message) {
  while (!in_chunk_.is_at_end()) {
    const auto op = static_cast<McapOp>(in_chunk_.u8());
    const std::string_view content = in_chunk_.take(in_chunk_.u64());
    bool is_good = in_chunk_.is_good();
    if (is_good && op == McapOp::kMessage) {
      is_good = take_message(content, message);
      if (is_good) {
        ++messages_;
        return true;
      }
    }
    if (is_good && op == McapOp::kSchema) is_good = take_schema(content);
    if (is_good && op == McapOp::kChannel) is_good = take_channel(content);
    if (!is_good) {
      in_chunk_ = ByteReader({});
      damage("a chunk's records do not fit together");
    }
  }
  return false;
}

void McapReader::damage(const std::string& cause) {
  if (damaged_chunks_++ == 0) damage_ = cause;
  read_index();
}

bool McapReader::take_schema(std::string_view content) {
  ByteReader reader(content);
  const std::uint16_t id = reader.u16();
  McapSchema schema;
  schema.name = reader.counted();
  schema.encoding = reader.counted();
  schema.bytes = reader.counted();
  if (!reader.is_good() || id == 0 || schemas_.contains(id)) return reader.is_good();
  if (!keep(content.size())) return false;
  schemas_[id] = std::move(schema);
  return true;
}

/// @return whether there is room for a record of this size and as many values in it
bool McapReader::keep(std::size_t size_bytes, std::size_t values) {
  const std::uint64_t bytes = size_bytes + kBytesOfAValue * (1 + values);
  if (bytes > kMaxKeptBytes - kept_bytes_) return false;
  kept_bytes_ += bytes;
  return true;
}

bool McapReader::take_channel(std::string_view content) {
  ByteReader reader(content);
  const std::uint16_t id = reader.u16();
  McapChannel channel;
  channel.schema = reader.u16();
  channel.topic = reader.counted();
  channel.encoding = reader.counted();
  ByteReader metadata(reader.counted());
  while (!metadata.is_at_end() && channel.metadata.size() < kMaxKeptBytes / kBytesOfAValue) {
    const std::string key(metadata.counted());
    channel.metadata[key] = metadata.counted();
  }
  if (!reader.is_good() || !metadata.is_good()) return false;
  if (channels_.contains(id)) return true;
  if (!keep(content.size(), channel.metadata.size())) return false;
  channels_[id] = std::move(channel);
  return true;
}

bool McapReader::take_message(std::string_view content, McapMessage& message) {
  ByteReader reader(content);
  message.channel = reader.u16();
  message.sequence = reader.u32();
  message.log_time_ns = reader.u64();
  message.publish_time_ns = reader.u64();
  message.bytes = reader.rest();
  if (!channels_.contains(message.channel)) read_index();
  return reader.is_good() && channels_.contains(message.channel);
}

std::string McapReader::problem() const {
  std::string text;
  if (is_cut_ && is_at_data_end_) {
    text = "its index is cut off; " +
           (damaged_chunks_ == 0 ? "all is there: " : std::string("the rest is there: ")) +
           text::counted(messages_, "record");
  } else if (is_cut_) {
    text = "it is cut off, as when a recorder is killed, or damaged there: " +
           text::counted(messages_, "record") + " in " + text::counted(chunks_, "whole chunk") +
           " could be read";
    if (unread_bytes_ > 0) {
      text += ", and " + text::counted(unread_bytes_, "byte") + " after them could not";
    }
  }
  if (!is_cut_ && unread_bytes_ > 0) {
    text = text::counted(unread_bytes_, "byte") +
           " after its end could not be read, as when two recordings are put into one file";
  }
  if (damaged_chunks_ > 0) {
    text += (text.empty() ? "" : "; ") + text::counted(damaged_chunks_, "damaged place") +
            " left out: " + damage_;
  }
  return text;
}

}  // namespace swarmtalk::recording
