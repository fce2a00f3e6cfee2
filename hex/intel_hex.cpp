#include "hex/intel_hex.hpp"

#include <sodium/utils.h>

#include <numeric>
#include <utility>

namespace swarmtalk::hex {
namespace {

constexpr std::size_t kHeadBytes = 4;       // length, address (2), type
constexpr std::size_t kRecordOverhead = 5;  // and the checksum

enum RecordType : std::uint8_t {
  kData = 0,
  kEnd = 1,
  kSegmentBase = 2,
  kSegmentStart = 3,
  kLinearBase = 4,
  kLinearStart = 5
};

class Parser {
 public:
  IntelHex parse(std::string_view text) {
    while (!text.empty() && problem_.empty()) {
      const std::size_t end = text.find('\n');
      std::string_view line = text.substr(0, end);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      if (line.ends_with('\r')) line.remove_suffix(1);
      ++line_;
      if (!line.empty()) take_line(line);
    }
    if (problem_.empty() && !has_ended_) {
      problem_ = "it has no end record (:00000001FF): the file is cut short";
    }
    if (!problem_.empty()) return {{}, problem_};
    return {std::move(blocks_), ""};
  }

 private:
  using Bytes = std::vector<std::uint8_t>;

  void fail(const std::string& what) { problem_ = "line " + std::to_string(line_) + ": " + what; }

  /// @return empty: it is none, and problem_ says why
  Bytes record_of(std::string_view line) {
    if (line.front() != ':') {
      fail("a record begins with ':'; this is not an Intel HEX file");
      return {};
    }
    line.remove_prefix(1);
    Bytes record(line.size() / 2 + 1);
    std::size_t size = 0;
    if (sodium_hex2bin(record.data(), record.size(), line.data(), line.size(), nullptr, &size,
                       nullptr) != 0) {
      fail("a record is pairs of hexadecimal digits");
      return {};
    }
    record.resize(size);
    if (size < kRecordOverhead || size != kRecordOverhead + record[0]) {
      fail("the record is not as long as it says");
      return {};
    }
    if ((std::accumulate(record.begin(), record.end(), 0u) & 0xFF) != 0) {
      fail("the checksum is wrong");
      return {};
    }
    return record;
  }

  void take_line(std::string_view line) {
    if (has_ended_) return fail("there is more behind the end record");
    const Bytes record = record_of(line);
    if (record.empty()) return;
    const auto body = record.begin() + kHeadBytes;
    switch (record[3]) {
      case kData:
        blocks_.push_back({base_ + record[1] * 256u + record[2], {body, body + record[0]}, line_});
        return;
      case kEnd:
        has_ended_ = true;
        return;
      case kSegmentBase:
      case kLinearBase:
        if (record[0] != 2) return fail("a base address has two bytes");
        base_ = (body[0] * 256u + body[1]) << (record[3] == kSegmentBase ? 4 : 16);
        return;
      case kSegmentStart:
      case kLinearStart:
        return;  // of processors that a Kilobot has not
      default:
        return fail("record type " + std::to_string(record[3]) + " is not known");
    }
  }

  std::vector<Block> blocks_;
  std::string problem_;
  std::uint32_t base_ = 0;
  std::size_t line_ = 0;
  bool has_ended_ = false;
};

}  // namespace

IntelHex parse_intel_hex(std::string_view text) {
  return Parser().parse(text);
}

}  // namespace swarmtalk::hex
