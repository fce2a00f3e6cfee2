#include "hex/intel_hex.hpp"

#include <sodium/utils.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "text/encoding.hpp"

namespace swarmtalk::hex {
namespace {

constexpr std::size_t kHeadBytes = 4;       // length, address (2), type
constexpr std::size_t kRecordOverhead = 5;  // and the checksum

constexpr std::string_view kBlanks = " \t";
constexpr std::string_view kAfterTheEnd{" \t\0\x1A", 4};  // what fills blocks, and ends text on DOS
constexpr const char* kHowToMake =
    "avr-objcopy -O ihex -R .eeprom -R .fuse -R .lock -R .signature FILE.elf FILE.hex";

/// Takes the first line off, however it ends.
std::string_view take_line_of(std::string_view& text) {
  const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end);
  text.remove_prefix(text.starts_with("\r\r\n") ? 3
                     : text.starts_with("\r\n") ? 2
                     : text.empty()             ? 0
                                                : 1);
  return line;
}

std::string_view trimmed(std::string_view line, std::string_view blanks) {
  line.remove_prefix(std::min(line.find_first_not_of(blanks), line.size()));
  return line.substr(0, line.find_last_not_of(blanks) + 1);
}

/// A line that would be a record, were its colon not damaged, is none.
bool is_comment(std::string_view line) {
  if (!line.starts_with(';') && !line.starts_with('#')) return false;
  return line.size() <= 2 * kRecordOverhead ||
         line.find_first_not_of("0123456789abcdefABCDEF", 1) != std::string_view::npos;
}

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
    if (const std::string problem = text::encoding_problem(text); !problem.empty()) {
      return {{}, "it " + problem};
    }
    text = text::without_mark(text);
    while (!text.empty() && problem_.empty()) {
      const std::string_view line =
          trimmed(take_line_of(text), has_ended_ ? kAfterTheEnd : kBlanks);
      ++line_;
      if (!line.empty() && !is_comment(line)) take_line(line);
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
      fail(has_record_
               ? "a record begins with ':'"
               : std::string("this is not an Intel HEX file; make one with `") + kHowToMake + "`");
      return {};
    }
    line.remove_prefix(1);
    Bytes record(line.size() / 2 + 1);
    std::size_t size = 0;
    if (sodium_hex2bin(record.data(), record.size(), line.data(), line.size(), nullptr, &size,
                       nullptr) != 0) {
      fail("a record is pairs of hexadecimal digits; a comment needs a line of its own");
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
    has_record_ = true;
    return record;
  }

  void take_line(std::string_view line) {
    if (has_ended_) return fail("there is more after the end record");
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
  bool has_record_ = false;
  bool has_ended_ = false;
};

}  // namespace

IntelHex parse_intel_hex(std::string_view text) {
  return Parser().parse(text);
}

std::string beside_program_problem(const Block& block) {
  constexpr const char* kThere[] = {"EEPROM data", "fuses", "lock bits", "a signature"};
  const std::uint32_t at = (block.address >> 16) - 0x81;  // avr-gcc gives 64 KiB to each
  if (at >= std::size(kThere)) return "";
  return "line " + std::to_string(block.line) + ": this is " + kThere[at] +
         ", not part of the program; leave all such out with `" + kHowToMake + "`";
}

}  // namespace swarmtalk::hex
