#include "cli/hex_file.hpp"

#include <cstdio>
#include <optional>

namespace swarmtalk::cli {
namespace {

constexpr std::size_t kRecordOverhead = 5;  // length, address (2), type, checksum
constexpr std::uint8_t kErased = 0xFF;

enum RecordType : std::uint8_t {
  kData = 0,
  kEnd = 1,
  kSegmentBase = 2,
  kSegmentStart = 3,
  kLinearBase = 4,
  kLinearStart = 5
};

int digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string hex(std::uint32_t address) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%04x", address);
  return text;
}

class Parser {
 public:
  HexImage parse(const std::string& text) {
    std::size_t at = 0;
    while (at < text.size() && problem_.empty()) {
      std::size_t end = text.find('\n', at);
      if (end == std::string::npos) end = text.size();
      std::string line = text.substr(at, end - at);
      if (!line.empty() && line.back() == '\r') line.pop_back();
      at = end + 1;
      ++line_;
      if (!line.empty()) take_line(line);
    }
    if (problem_.empty() && !has_ended_) {
      problem_ = "it has no end record (:00000001FF): the file is cut short";
    }
    if (problem_.empty() && bytes_.empty()) problem_ = "it holds no program";
    if (!problem_.empty()) return {{}, problem_};
    return {std::move(bytes_), ""};
  }

 private:
  void fail(const std::string& what) { problem_ = "line " + std::to_string(line_) + ": " + what; }

  std::optional<std::vector<std::uint8_t>> bytes_of(const std::string& line) {
    if (line.front() != ':') {
      fail("a record begins with ':'; this is no Intel HEX file");
      return std::nullopt;
    }
    std::vector<std::uint8_t> record;
    std::uint8_t sum = 0;
    for (std::size_t i = 1; i < line.size(); i += 2) {
      const int high = digit(line[i]);
      const int low = i + 1 < line.size() ? digit(line[i + 1]) : -1;
      if (high < 0 || low < 0) {
        fail("a record is pairs of hexadecimal digits");
        return std::nullopt;
      }
      record.push_back(static_cast<std::uint8_t>(high * 16 + low));
      sum = static_cast<std::uint8_t>(sum + record.back());
    }
    if (record.size() < kRecordOverhead || record.size() != kRecordOverhead + record[0]) {
      fail("the record is not as long as it says");
      return std::nullopt;
    }
    if (sum != 0) {
      fail("the checksum is wrong");
      return std::nullopt;
    }
    return record;
  }

  void take_line(const std::string& line) {
    if (has_ended_) return fail("there is more behind the end record");
    const auto record = bytes_of(line);
    if (!record) return;
    const std::size_t size = (*record)[0];
    const auto address = static_cast<std::uint32_t>(((*record)[1] << 8) | (*record)[2]);
    const std::uint8_t* body = record->data() + 4;
    switch ((*record)[3]) {
      case kData:
        return take_data(base_ + address, body, size);
      case kEnd:
        has_ended_ = true;
        return;
      case kSegmentBase:
      case kLinearBase:
        if (size != 2) return fail("a base address has two bytes");
        base_ = static_cast<std::uint32_t>((body[0] << 8) | body[1]);
        base_ = (*record)[3] == kSegmentBase ? base_ << 4 : base_ << 16;
        if (base_ >= kProgramBytesMax) refuse_address(base_);
        return;
      case kSegmentStart:
      case kLinearStart:
        return;
      default:
        return fail("record type " + std::to_string((*record)[3]) + " is not known");
    }
  }

  void refuse_address(std::uint32_t address) {
    fail("address " + hex(address) + " lies behind the last byte of programs, " +
         hex(kProgramBytesMax - 1) + ": there begins the robots' bootloader");
  }

  void take_data(std::uint32_t address, const std::uint8_t* body, std::size_t size) {
    if (address + size > kProgramBytesMax) {
      return refuse_address(static_cast<std::uint32_t>(address + size - 1));
    }
    if (bytes_.size() < address + size) {
      bytes_.resize(address + size, kErased);
      is_set_.resize(address + size, false);
    }
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t at = address + i;
      if (is_set_[at] && bytes_[at] != body[i]) {
        return fail("address " + hex(static_cast<std::uint32_t>(at)) +
                    " has another value in a line before");
      }
      bytes_[at] = body[i];
      is_set_[at] = true;
    }
  }

  std::vector<std::uint8_t> bytes_;
  std::vector<bool> is_set_;
  std::string problem_;
  std::uint32_t base_ = 0;
  std::size_t line_ = 0;
  bool has_ended_ = false;
};

}  // namespace

HexImage parse_hex_file(const std::string& text) {
  return Parser().parse(text);
}

}  // namespace swarmtalk::cli
