#include "recording/mcap_writer.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "recording/compression.hpp"
#include "recording/crc32.hpp"

static_assert(sizeof(off_t) == 8, "a recording may be longer than 2 GiB");

namespace swarmtalk::recording {
namespace {

constexpr std::uint16_t number_of(std::size_t place) {
  return static_cast<std::uint16_t>(place + 1);
}

}  // namespace

void McapWriter::Count::add(std::uint16_t channel, std::uint64_t time_ns) {
  first_ns = messages == 0 ? time_ns : std::min(first_ns, time_ns);
  last_ns = std::max(last_ns, time_ns);
  ++messages;
  ++by_channel[channel];
}

void McapWriter::Count::add(const Count& other) {
  if (other.messages == 0) return;
  first_ns = messages == 0 ? other.first_ns : std::min(first_ns, other.first_ns);
  last_ns = std::max(last_ns, other.last_ns);
  messages += other.messages;
  for (const auto& [channel, count] : other.by_channel) by_channel[channel] += count;
}

McapWriter::~McapWriter() {
  close();
}

void McapWriter::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

// The old file goes, and who reads it keeps it as it was: one that is written over under its
// readers is neither recording.
std::string McapWriter::make_room() {
  const int old = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
  if (old < 0) return {};
  struct stat status {};
  if (::fstat(old, &status) == 0 && !S_ISREG(status.st_mode)) {
    fd_ = old;  // a device or a pipe stays
    return {};
  }
  const bool is_in_use = ::flock(old, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  const bool is_gone = !is_in_use && ::unlink(path_.c_str()) == 0;
  const int error = errno;
  ::close(old);
  if (is_in_use)
    return path_ + " is being recorded by another program: end it, or name another file";
  if (!is_gone) return "cannot replace " + path_ + ": " + std::strerror(error);
  return {};
}

std::string McapWriter::open(const std::string& path, std::string_view library, bool replaces) {
  path_ = path;
  if (replaces) {
    if (std::string problem = make_room(); !problem.empty()) return problem;
  }
  if (fd_ < 0) fd_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_EXCL, 0666);
  if (fd_ < 0) {
    const int error = errno;
    struct stat status {};
    const bool is_folder = ::stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
    return "cannot make " + path + ": " + std::strerror(is_folder ? EISDIR : error) +
           (error == EEXIST && !is_folder && !replaces ? "; --replace overwrites it" : "");
  }
  ::flock(fd_, LOCK_EX | LOCK_NB);  // who would replace the file sees that it is being written
  ByteWriter header;
  header.counted("");  // no profile of somebody's
  header.counted(library);
  ByteWriter out;
  out.raw(kMcapMagic);
  record(out, McapOp::kHeader, header.bytes());
  append(out.bytes());
  return problem_;
}

std::uint16_t McapWriter::add_schema(McapSchema schema) {
  schemas_.push_back(std::move(schema));
  is_schema_written_.push_back(false);
  return static_cast<std::uint16_t>(schemas_.size());
}

std::uint16_t McapWriter::add_channel(McapChannel channel) {
  channels_.push_back(std::move(channel));
  is_channel_written_.push_back(false);
  return static_cast<std::uint16_t>(channels_.size());
}

void McapWriter::record(ByteWriter& out, McapOp op, std::string_view content) {
  out.u8(static_cast<std::uint8_t>(op));
  out.u64(content.size());
  out.raw(content);
}

void McapWriter::values(ByteWriter& out, const std::map<std::string, std::string>& values) {
  ByteWriter list;
  for (const auto& [key, value] : values) {
    list.counted(key);
    list.counted(value);
  }
  out.counted(list.bytes());
}

void McapWriter::schema_record(ByteWriter& out, std::uint16_t id) const {
  const McapSchema& schema = schemas_[id - 1U];
  ByteWriter content;
  content.u16(id);
  content.counted(schema.name);
  content.counted(schema.encoding);
  content.counted(schema.bytes);
  record(out, McapOp::kSchema, content.bytes());
}

void McapWriter::channel_record(ByteWriter& out, std::uint16_t id) const {
  const McapChannel& channel = channels_[id - 1U];
  ByteWriter content;
  content.u16(id);
  content.u16(channel.schema);
  content.counted(channel.topic);
  content.counted(channel.encoding);
  values(content, channel.metadata);
  record(out, McapOp::kChannel, content.bytes());
}

bool McapWriter::write(const McapMessage& message) {
  if (fd_ < 0 || !problem_.empty()) {
    ++lost_messages_;
    return false;
  }
  const std::size_t place = message.channel - 1U;
  const std::uint16_t schema = channels_[place].schema;
  if (schema != 0 && !is_schema_written_[schema - 1U]) schema_record(chunk_, schema);
  if (schema != 0) is_schema_written_[schema - 1U] = true;
  if (!is_channel_written_[place]) channel_record(chunk_, message.channel);
  is_channel_written_[place] = true;
  chunk_index_[message.channel].emplace_back(message.log_time_ns, chunk_.size_bytes());
  chunk_count_.add(message.channel, message.log_time_ns);
  chunk_.u8(static_cast<std::uint8_t>(McapOp::kMessage));
  chunk_.u64(2 + 4 + 8 + 8 + message.bytes.size());
  chunk_.u16(message.channel);
  chunk_.u32(message.sequence);
  chunk_.u64(message.log_time_ns);
  chunk_.u64(message.publish_time_ns);
  chunk_.raw(message.bytes);
  return chunk_.size_bytes() < kChunkBytes || close_chunk();
}

bool McapWriter::close_chunk() {
  if (!problem_.empty()) return false;
  if (chunk_count_.messages == 0) return true;
  const std::string packed = compress_zstd(chunk_.bytes());
  ByteWriter content;
  content.u64(chunk_count_.first_ns);
  content.u64(chunk_count_.last_ns);
  content.u64(chunk_.size_bytes());
  content.u32(crc32(chunk_.bytes()));
  content.counted(kZstd);
  content.u64(packed.size());
  content.raw(packed);
  ByteWriter out;
  record(out, McapOp::kChunk, content.bytes());
  ChunkPlace place{
      chunk_count_.first_ns, chunk_count_.last_ns, size_bytes_, out.size_bytes(), {}, 0,
      packed.size(),         chunk_.size_bytes()};
  for (const auto& [channel, entries] : chunk_index_) {
    place.index_at[channel] = size_bytes_ + out.size_bytes();
    ByteWriter list;
    for (const auto& [time_ns, at] : entries) {
      list.u64(time_ns);
      list.u64(at);
    }
    content.clear();
    content.u16(channel);
    content.counted(list.bytes());
    record(out, McapOp::kMessageIndex, content.bytes());
  }
  place.index_length = out.size_bytes() - place.length;
  if (!append(out.bytes())) {
    lost_messages_ += chunk_count_.messages;
    drop_chunk();
    return false;
  }
  chunks_.push_back(std::move(place));
  total_.add(chunk_count_);
  drop_chunk();
  return true;
}

bool McapWriter::write_metadata(std::string_view name,
                                const std::map<std::string, std::string>& values) {
  if (fd_ < 0 || !problem_.empty()) return false;
  ByteWriter content;
  content.counted(name);
  this->values(content, values);
  ByteWriter out;
  record(out, McapOp::kMetadata, content.bytes());
  const std::uint64_t at = size_bytes_;
  if (!append(out.bytes())) return false;
  metadata_.push_back({at, out.size_bytes(), std::string(name)});
  return true;
}

void McapWriter::drop_chunk() {
  chunk_.clear();
  chunk_index_.clear();
  chunk_count_ = {};
}

bool McapWriter::append(std::string_view bytes) {
  const Clock::time_point begin = now_();
  const bool is_written = write_out(bytes);
  longest_write_ = std::max(longest_write_, now_() - begin);
  return is_written;
}

/// Writes and syncs all of it or nothing: what came half is cut off again.
bool McapWriter::write_out(std::string_view bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t count = ::write(fd_, bytes.data() + at, bytes.size() - at);
    if (count > 0) {
      at += static_cast<std::size_t>(count);
    } else if (count == 0 || errno != EINTR) {
      const int error = count == 0 ? ENOSPC : errno;
      if (problem_.empty()) problem_ = "cannot write " + path_ + ": " + std::strerror(error);
      const auto end = static_cast<off_t>(size_bytes_);
      if (::ftruncate(fd_, end) == 0) ::lseek(fd_, end, SEEK_SET);
      return false;
    }
  }
  // A pipe or a device has nothing to sync; that is no failure of the recording.
  if (::fdatasync(fd_) != 0 && errno != EINVAL && errno != EROFS && problem_.empty()) {
    problem_ = "cannot write " + path_ + ": " + std::strerror(errno);
    return false;
  }
  size_bytes_ += bytes.size();
  crc_ = crc32(bytes, crc_);
  return true;
}

bool McapWriter::finish() {
  if (fd_ < 0) return false;
  close_chunk();
  ByteWriter crc;
  crc.u32(crc_);
  ByteWriter out;
  record(out, McapOp::kDataEnd, crc.bytes());
  out.raw(summary(size_bytes_ + out.size_bytes()));
  out.raw(kMcapMagic);
  const bool has_index = append(out.bytes());
  close();
  return has_index && problem_.empty();
}

/// Everything between DataEnd and the last magic. @param at  where it begins in the file
std::string McapWriter::summary(std::uint64_t at) const {
  ByteWriter out;
  std::vector<std::pair<McapOp, std::uint64_t>> groups;  // and where each begins
  const auto group = [&](McapOp op) { groups.emplace_back(op, at + out.size_bytes()); };
  group(McapOp::kSchema);
  for (std::size_t i = 0; i < schemas_.size(); ++i) schema_record(out, number_of(i));
  group(McapOp::kChannel);
  for (std::size_t i = 0; i < channels_.size(); ++i) channel_record(out, number_of(i));
  group(McapOp::kStatistics);
  ByteWriter counts;
  for (const auto& [channel, count] : total_.by_channel) {
    counts.u16(channel);
    counts.u64(count);
  }
  ByteWriter content;
  content.u64(total_.messages);
  content.u16(static_cast<std::uint16_t>(schemas_.size()));
  content.u32(static_cast<std::uint32_t>(channels_.size()));
  content.u32(0);  // attachments
  content.u32(static_cast<std::uint32_t>(metadata_.size()));
  content.u32(static_cast<std::uint32_t>(chunks_.size()));
  content.u64(total_.first_ns);
  content.u64(total_.last_ns);
  content.counted(counts.bytes());
  record(out, McapOp::kStatistics, content.bytes());
  group(McapOp::kChunkIndex);
  for (const ChunkPlace& chunk : chunks_) {
    ByteWriter offsets;
    for (const auto& [channel, offset] : chunk.index_at) {
      offsets.u16(channel);
      offsets.u64(offset);
    }
    content.clear();
    content.u64(chunk.first_ns);
    content.u64(chunk.last_ns);
    content.u64(chunk.at);
    content.u64(chunk.length);
    content.counted(offsets.bytes());
    content.u64(chunk.index_length);
    content.counted(kZstd);
    content.u64(chunk.compressed);
    content.u64(chunk.uncompressed);
    record(out, McapOp::kChunkIndex, content.bytes());
  }
  group(McapOp::kMetadataIndex);
  for (const MetadataPlace& place : metadata_) {
    content.clear();
    content.u64(place.at);
    content.u64(place.length);
    content.counted(place.name);
    record(out, McapOp::kMetadataIndex, content.bytes());
  }
  const std::uint64_t offsets_at = at + out.size_bytes();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const std::uint64_t end = i + 1 < groups.size() ? groups[i + 1].second : offsets_at;
    if (end == groups[i].second) continue;
    content.clear();
    content.u8(static_cast<std::uint8_t>(groups[i].first));
    content.u64(groups[i].second);
    content.u64(end - groups[i].second);
    record(out, McapOp::kSummaryOffset, content.bytes());
  }
  // The footer's own CRC covers it up to the CRC.
  out.u8(static_cast<std::uint8_t>(McapOp::kFooter));
  out.u64(8 + 8 + 4);
  out.u64(at);
  out.u64(offsets_at);
  out.u32(crc32(out.bytes()));
  return out.bytes();
}

}  // namespace swarmtalk::recording
