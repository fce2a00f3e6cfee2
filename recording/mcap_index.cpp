#include "recording/mcap_index.hpp"

#include <algorithm>
#include <string>

#include "recording/bytes.hpp"
#include "recording/crc32.hpp"

namespace swarmtalk::recording {
namespace {

constexpr std::uint64_t kMaxIndexBytes = 32 * 1024 * 1024;

bool read(std::istream& in, std::uint64_t at, std::uint64_t size_bytes, std::string& bytes) {
  in.clear();
  in.seekg(static_cast<std::streamoff>(at));
  bytes.resize(static_cast<std::size_t>(size_bytes));
  in.read(bytes.data(), static_cast<std::streamsize>(size_bytes));
  return static_cast<std::uint64_t>(in.gcount()) == size_bytes;
}

}  // namespace

std::optional<McapFooter> read_mcap_footer(std::istream& in, std::uint64_t size_bytes) {
  if (size_bytes < kFooterBytes + 2 * kMcapMagic.size()) return {};
  std::string bytes;
  if (!read(in, size_bytes - kMcapMagic.size() - kFooterBytes, kFooterBytes, bytes)) return {};
  if (bytes[0] != static_cast<char>(McapOp::kFooter)) return {};
  ByteReader fields(std::string_view(bytes).substr(kRecordHeadBytes));
  McapFooter footer;
  footer.index_at = fields.u64();
  fields.u64();  // offsets of groups
  footer.crc = fields.u32();
  return footer;
}

McapIndex read_mcap_index(std::istream& in, std::uint64_t size_bytes) {
  McapIndex index;
  const auto footer = read_mcap_footer(in, size_bytes);
  if (!footer || footer->crc == 0) return index;
  const std::uint64_t end = size_bytes - kMcapMagic.size();
  const std::uint64_t at = footer->index_at;
  if (at < kMcapMagic.size() || at > end - kFooterBytes || end - at > kMaxIndexBytes) return index;
  std::string bytes;
  const bool is_whole = read(in, at, end - sizeof footer->crc - at, bytes);
  if (!is_whole || crc32(bytes) != footer->crc) return index;
  index.at = at;
  ByteReader records(bytes);
  while (!records.is_at_end()) {
    const auto op = static_cast<McapOp>(records.u8());
    ByteReader content(records.take(records.u64()));
    if (op != McapOp::kChunkIndex) continue;
    content.u64();  // first and last time
    content.u64();
    const std::uint64_t place = content.u64();
    const std::uint64_t chunk_bytes = content.u64();
    const bool is_good = content.is_good() && place < at && chunk_bytes <= at - place;
    if (is_good) index.chunks[place] = chunk_bytes;
  }
  return index;
}

std::optional<std::uint64_t> McapIndex::behind_damage(std::uint64_t record_at, bool is_head_good,
                                                      McapOp op, std::uint64_t length) const {
  if (record_at >= at) return {};
  const auto here = chunks.find(record_at);
  const auto next = chunks.upper_bound(record_at);
  const std::uint64_t limit = next == chunks.end() ? at : next->first;
  const bool is_chunk = here != chunks.end();
  // Writers put messages into chunks or beside each other, and not both.
  const bool is_stray = op == McapOp::kMessage && !chunks.empty();
  bool is_good =
      is_head_good && !is_stray && length <= limit - std::min(limit, record_at + kRecordHeadBytes);
  if (is_chunk) {
    is_good = is_good && op == McapOp::kChunk && kRecordHeadBytes + length == here->second;
  }
  if (is_good) return {};
  return is_chunk ? std::clamp(record_at + here->second, record_at + 1, limit) : limit;
}

}  // namespace swarmtalk::recording
