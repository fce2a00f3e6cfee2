// StructFormat: numbers in a payload, written as Python's struct module writes them: "<HfB" is an
// unsigned short, a float and an unsigned byte, little-endian, without gaps. A value; pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace swarmtalk::cli {

class StructFormat {
 public:
  using Value = std::variant<bool, std::int64_t, std::uint64_t, double, std::string>;
  static constexpr std::size_t kMaxBytes = 65536;  // longer than any message

  /// @param text  as for Python's struct: < > ! = @ first, then counts and the letters
  ///   xcbB?hHiIlLqQnNefds
  /// @param problem  filled when there is none: one clause
  static std::optional<StructFormat> parse(std::string_view text, std::string& problem);

  std::size_t size_bytes() const { return size_bytes_; }
  std::size_t values() const { return values_; }
  const std::string& text() const { return text_; }

  /// @return none: the payload has another size
  std::optional<std::vector<Value>> unpack(std::string_view payload) const;

  /// @param words  values(); each is written as its letter wants it: 3, -1, 0x1f, 2.5, true, a text
  /// @param problem  filled when there is none: one clause with the word
  std::optional<std::string> pack(const std::vector<std::string>& words,
                                  std::string& problem) const;

 private:
  struct Item {
    char letter;
    std::size_t at;
    std::size_t size_bytes;
  };

  std::uint64_t load(std::string_view payload, const Item& item) const;
  void store(std::uint64_t bits, const Item& item, std::string& bytes) const;
  bool pack(const std::string& word, const Item& item, std::string& bytes) const;

  std::string text_;
  std::vector<Item> items_;
  std::size_t size_bytes_ = 0;
  std::size_t values_ = 0;
  bool is_big_endian_ = false;
};

/// For people: 3, -1, 2.5, true, "text".
std::string to_text(const StructFormat::Value& value);

}  // namespace swarmtalk::cli
