// ByteWriter and ByteReader: little-endian numbers and counted strings, as MCAP writes them. The
// reader never leaves its span; what is missing reads as zero or empty, and is_good() says so.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace swarmtalk::recording {

class ByteWriter {
 public:
  void u8(std::uint8_t value) { bytes_.push_back(static_cast<char>(value)); }
  void u16(std::uint16_t value) { number(value, 2); }
  void u32(std::uint32_t value) { number(value, 4); }
  void u64(std::uint64_t value) { number(value, 8); }
  void raw(std::string_view bytes) { bytes_.append(bytes); }
  /// With its length in four bytes before it.
  void counted(std::string_view bytes) {
    u32(static_cast<std::uint32_t>(bytes.size()));
    raw(bytes);
  }

  const std::string& bytes() const { return bytes_; }
  std::size_t size_bytes() const { return bytes_.size(); }
  void clear() { bytes_.clear(); }

 private:
  void number(std::uint64_t value, int size_bytes) {
    for (int i = 0; i < size_bytes; ++i) u8(static_cast<std::uint8_t>(value >> (8 * i)));
  }

  std::string bytes_;
};

class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  std::uint8_t u8() { return static_cast<std::uint8_t>(number(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::uint64_t u64() { return number(8); }
  std::string_view counted() { return take(u32()); }
  std::string_view take(std::uint64_t size_bytes) {
    if (size_bytes > rest_.size()) {
      is_good_ = false;
      rest_ = {};
      return {};
    }
    const std::string_view taken = rest_.substr(0, static_cast<std::size_t>(size_bytes));
    rest_.remove_prefix(taken.size());
    return taken;
  }

  std::string_view rest() const { return rest_; }
  bool is_at_end() const { return rest_.empty(); }
  /// False once something was read that was not there.
  bool is_good() const { return is_good_; }

 private:
  std::uint64_t number(std::size_t size_bytes) {
    const std::string_view bytes = take(size_bytes);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      value |= static_cast<std::uint64_t>(static_cast<std::uint8_t>(bytes[i])) << (8 * i);
    }
    return value;
  }

  std::string_view rest_;
  bool is_good_ = true;
};

}  // namespace swarmtalk::recording
