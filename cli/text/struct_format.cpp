#include "cli/text/struct_format.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>

#include "cli/text/hex.hpp"

namespace swarmtalk::cli {
namespace {

/// @return 0: there is no such letter, or it has no size of its own in this mode
std::size_t size_of(char letter, bool is_native) {
  switch (letter) {
    case 'x':
    case 'c':
    case 'b':
    case 'B':
    case '?':
    case 's':
      return 1;
    case 'h':
    case 'H':
    case 'e':
      return 2;
    case 'i':
    case 'I':
    case 'f':
      return 4;
    case 'l':
    case 'L':
      return is_native ? sizeof(long) : 4;
    case 'q':
    case 'Q':
    case 'd':
      return 8;
    case 'n':
    case 'N':
      return is_native ? sizeof(std::size_t) : 0;
    default:
      return 0;
  }
}

bool is_signed(char letter) {
  return std::string_view("bhilqn").find(letter) != std::string_view::npos;
}

double from_half(std::uint64_t bits) {
  const int exponent = static_cast<int>(bits >> 10 & 31);
  const auto fraction = static_cast<double>(bits & 1023);
  double value =
      exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(fraction + 1024, exponent - 25);
  if (exponent == 31) {
    value = fraction == 0 ? std::numeric_limits<double>::infinity()
                          : std::numeric_limits<double>::quiet_NaN();
  }
  return (bits & 0x8000) != 0 ? -value : value;
}

/// Rounds to the nearest, ties to even. @return none: it is too large
std::optional<std::uint64_t> to_half(double value) {
  const std::uint64_t sign = std::signbit(value) ? 0x8000 : 0;
  if (std::isnan(value)) return sign | 0x7E00;
  if (std::isinf(value)) return sign | 0x7C00;
  int exponent = 0;
  std::frexp(value, &exponent);  // value = m * 2^exponent, 0.5 <= m < 1
  const int step = std::max(exponent - 11, -24);
  const auto steps =
      static_cast<std::uint64_t>(std::nearbyint(std::ldexp(std::fabs(value), -step)));
  // With the hidden bit left in, a fraction that is rounded up to 2048 raises the exponent itself.
  const std::uint64_t bits = (static_cast<std::uint64_t>(step + 24) << 10) + steps;
  if (bits >= 0x7C00) return std::nullopt;
  return sign | bits;
}

template <typename Number>
bool read(std::string_view word, Number& number) {
  const bool is_minus = word.starts_with('-');
  std::string digits(word.substr(is_minus || word.starts_with('+') ? 1 : 0));
  int base = 10;
  if constexpr (std::is_integral_v<Number>) {
    if (digits.starts_with("0x") || digits.starts_with("0X")) {
      base = 16;
      digits.erase(0, 2);
    }
  }
  if (digits.empty() || digits.front() == '-') return false;
  if (is_minus) digits.insert(0, "-");
  std::from_chars_result result{};
  if constexpr (std::is_integral_v<Number>) {
    result = std::from_chars(digits.data(), digits.data() + digits.size(), number, base);
  } else {
    result = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  }
  return result.ec == std::errc() && result.ptr == digits.data() + digits.size();
}

}  // namespace

std::optional<StructFormat> StructFormat::parse(std::string_view text, std::string& problem) {
  StructFormat format;
  format.text_ = text;
  bool is_native = true;
  bool is_aligned = true;
  format.is_big_endian_ = std::endian::native == std::endian::big;
  if (!text.empty() && std::string_view("<>!=@").find(text.front()) != std::string_view::npos) {
    const char order = text.front();
    text.remove_prefix(1);
    is_native = is_aligned = order == '@';
    if (order == '<') format.is_big_endian_ = false;
    if (order == '>' || order == '!') format.is_big_endian_ = true;
  }
  while (!text.empty()) {
    std::size_t count = 1;
    const auto digits = std::min(text.find_first_not_of("0123456789"), text.size());
    if (digits > 0) {
      const auto result = std::from_chars(text.data(), text.data() + digits, count);
      if (result.ec != std::errc() || count > kMaxBytes) {
        problem = "it has more than " + std::to_string(kMaxBytes) + " bytes";
        return std::nullopt;
      }
      text.remove_prefix(digits);
    }
    if (text.empty()) {
      problem = "a count needs a letter after it";
      return std::nullopt;
    }
    const char letter = text.front();
    text.remove_prefix(1);
    if (letter == ' ' && digits == 0) continue;
    const std::size_t size = size_of(letter, is_native);
    if (size == 0) {
      problem = std::string("it has '") + letter + "'; the letters are xcbB?hHiIlLqQefds" +
                (is_native ? "nN" : ", and nN without < > ! =");
      return std::nullopt;
    }
    if (is_aligned) format.size_bytes_ = (format.size_bytes_ + size - 1) / size * size;
    if (format.size_bytes_ + count * size > kMaxBytes) {
      problem = "it has more than " + std::to_string(kMaxBytes) + " bytes";
      return std::nullopt;
    }
    if (letter == 's') {
      format.items_.push_back({letter, format.size_bytes_, count});
    } else {
      for (std::size_t i = 0; i < count && letter != 'x'; ++i) {
        format.items_.push_back({letter, format.size_bytes_ + i * size, size});
      }
    }
    format.size_bytes_ += count * size;
  }
  if (format.size_bytes_ == 0 && format.items_.empty()) {
    problem = "it has no values";
    return std::nullopt;
  }
  format.values_ = format.items_.size();
  return format;
}

std::uint64_t StructFormat::load(std::string_view payload, const Item& item) const {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < item.size_bytes; ++i) {
    const std::size_t place = is_big_endian_ ? i : item.size_bytes - 1 - i;
    bits = bits << 8 | static_cast<std::uint8_t>(payload[item.at + place]);
  }
  return bits;
}

void StructFormat::store(std::uint64_t bits, const Item& item, std::string& bytes) const {
  for (std::size_t i = 0; i < item.size_bytes; ++i) {
    const std::size_t place = is_big_endian_ ? item.size_bytes - 1 - i : i;
    bytes[item.at + place] = static_cast<char>(bits >> (8 * i) & 0xFF);
  }
}

std::optional<std::vector<StructFormat::Value>> StructFormat::unpack(
    std::string_view payload) const {
  if (payload.size() != size_bytes_) return std::nullopt;
  std::vector<Value> values;
  for (const Item& item : items_) {
    if (item.letter == 's' || item.letter == 'c') {
      values.emplace_back(std::string(payload.substr(item.at, item.size_bytes)));
      continue;
    }
    const std::uint64_t bits = load(payload, item);
    if (item.letter == '?') {
      values.emplace_back(bits != 0);
    } else if (item.letter == 'e') {
      values.emplace_back(from_half(bits));
    } else if (item.letter == 'f') {
      values.emplace_back(
          static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits))));
    } else if (item.letter == 'd') {
      values.emplace_back(std::bit_cast<double>(bits));
    } else if (is_signed(item.letter)) {
      const auto unused = 64 - 8 * static_cast<int>(item.size_bytes);
      values.emplace_back(static_cast<std::int64_t>(bits << unused) >> unused);
    } else {
      values.emplace_back(bits);
    }
  }
  return values;
}

bool StructFormat::pack(const std::string& word, const Item& item, std::string& bytes) const {
  if (item.letter == 's' || item.letter == 'c') {
    if (word.size() > item.size_bytes || (item.letter == 'c' && word.size() != 1)) return false;
    word.copy(bytes.data() + item.at, word.size());
    return true;
  }
  if (item.letter == '?') {
    const bool is_true = word == "true" || word == "1";
    store(is_true ? 1 : 0, item, bytes);
    return is_true || word == "false" || word == "0";
  }
  if (item.letter == 'e' || item.letter == 'f' || item.letter == 'd') {
    double value = 0;
    if (!read(word, value)) return false;
    std::optional<std::uint64_t> bits = std::bit_cast<std::uint64_t>(value);
    if (item.letter == 'e') bits = to_half(value);
    if (item.letter == 'f') {
      const auto narrow = static_cast<float>(value);
      if (std::isinf(narrow) && !std::isinf(value)) return false;
      bits = std::bit_cast<std::uint32_t>(narrow);
    }
    if (bits) store(*bits, item, bytes);
    return bits.has_value();
  }
  const int width = 8 * static_cast<int>(item.size_bytes);
  if (is_signed(item.letter)) {
    std::int64_t value = 0;
    if (!read(word, value)) return false;
    const std::int64_t most = std::numeric_limits<std::int64_t>::max() >> (64 - width);
    if (value > most || value < -most - 1) return false;
    store(static_cast<std::uint64_t>(value), item, bytes);
    return true;
  }
  std::uint64_t value = 0;
  if (word.starts_with('-') || !read(word, value)) return false;
  if (value > std::numeric_limits<std::uint64_t>::max() >> (64 - width)) return false;
  store(value, item, bytes);
  return true;
}

std::optional<std::string> StructFormat::pack(const std::vector<std::string>& words,
                                              std::string& problem) const {
  if (words.size() != values_) {
    problem = "format " + text_ + " takes " + std::to_string(values_) +
              (values_ == 1 ? " value, not " : " values, not ") + std::to_string(words.size());
    return std::nullopt;
  }
  std::string bytes(size_bytes_, '\0');
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (pack(words[i], items_[i], bytes)) continue;
    problem = "'" + words[i] + "' is not a value for the letter " + items_[i].letter +
              " of format " + text_;
    return std::nullopt;
  }
  return bytes;
}

std::string to_text(const StructFormat::Value& value) {
  if (const auto* truth = std::get_if<bool>(&value)) return *truth ? "true" : "false";
  if (const auto* number = std::get_if<std::int64_t>(&value)) return std::to_string(*number);
  if (const auto* number = std::get_if<std::uint64_t>(&value)) return std::to_string(*number);
  if (const auto* number = std::get_if<double>(&value)) {
    char text[32];
    // As many digits as tell it apart, of those that it had: a float says 0.1, and so does a
    // double.
    const bool was_float = std::abs(*number) <= std::numeric_limits<float>::max() &&
                           static_cast<double>(static_cast<float>(*number)) == *number;
    const auto end = was_float
                         ? std::to_chars(text, text + sizeof text, static_cast<float>(*number))
                         : std::to_chars(text, text + sizeof text, *number);
    return {text, end.ptr};
  }
  const std::string& bytes = std::get<std::string>(value);
  const auto text = escaped(bytes.substr(0, bytes.find_last_not_of('\0') + 1));
  return text ? "\"" + *text + "\"" : "hex " + to_hex(bytes);
}

}  // namespace swarmtalk::cli
