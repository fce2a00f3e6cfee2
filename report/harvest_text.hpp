// What programs say on the channel "harvest" (docs/wire-format.md, harvest): questions and answers
// as bytes, and back. Pure functions, in this header alone; anything may come in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace swarmtalk::report {

struct HarvestQuestion {
  std::uint32_t number = 0;  // chosen at random by who asks
  std::uint8_t ttl = 0;      // of the answers
  std::string_view prefix;
};

namespace harvest {

inline constexpr char kQuestion = 'Q';
inline constexpr char kAnswer = 'A';
inline constexpr std::size_t kQuestionHeaderBytes = 6;
inline constexpr std::size_t kAnswerHeaderBytes = 5;

inline void put(std::string& to, std::uint32_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) {
    to.push_back(static_cast<char>(value >> shift & 0xFF));
  }
}

inline std::uint32_t get(std::string_view from, std::size_t at, std::size_t bytes) {
  std::uint32_t value = 0;
  for (const char byte : from.substr(at, bytes))
    value = value << 8 | static_cast<std::uint8_t>(byte);
  return value;
}

}  // namespace harvest

inline std::string encode(const HarvestQuestion& question) {
  std::string bytes(1, harvest::kQuestion);
  harvest::put(bytes, question.number, 4);
  harvest::put(bytes, question.ttl, 1);
  return bytes.append(question.prefix);
}

/// The beginning of an answer, which append_value() goes on.
inline std::string begin_answer(std::uint32_t question) {
  std::string bytes(1, harvest::kAnswer);
  harvest::put(bytes, question, 4);
  return bytes;
}

/// @param key  1 to 255 bytes @param value  at most 65535 bytes
inline void append_value(std::string& answer, std::string_view key, std::string_view value) {
  harvest::put(answer, static_cast<std::uint32_t>(key.size()), 1);
  answer.append(key);
  harvest::put(answer, static_cast<std::uint32_t>(value.size()), 2);
  answer.append(value);
}

/// @return none: it is not a question; the prefix points into `bytes`
inline std::optional<HarvestQuestion> decode_question(std::string_view bytes) {
  if (bytes.size() < harvest::kQuestionHeaderBytes || bytes[0] != harvest::kQuestion) return {};
  return HarvestQuestion{harvest::get(bytes, 1, 4),
                         static_cast<std::uint8_t>(harvest::get(bytes, 5, 1)),
                         bytes.substr(harvest::kQuestionHeaderBytes)};
}

/// @return the number of the question that is answered; none: it is no answer
inline std::optional<std::uint32_t> question_of_answer(std::string_view bytes) {
  if (bytes.size() < harvest::kAnswerHeaderBytes || bytes[0] != harvest::kAnswer) return {};
  return harvest::get(bytes, 1, 4);
}

/// Calls `found(key, value)` with each value of an answer, whosever question it is.
/// @return false: it is none, or is cut; the values before the cut were found
template <typename Found>
bool decode_answer(std::string_view bytes, const Found& found) {
  if (!question_of_answer(bytes)) return false;
  bytes.remove_prefix(harvest::kAnswerHeaderBytes);
  while (!bytes.empty()) {
    const std::size_t key_bytes = harvest::get(bytes, 0, 1);
    if (key_bytes == 0 || bytes.size() < 1 + key_bytes + 2) return false;
    const std::size_t value_bytes = harvest::get(bytes, 1 + key_bytes, 2);
    const std::size_t whole_bytes = 1 + key_bytes + 2 + value_bytes;
    if (bytes.size() < whole_bytes) return false;
    found(bytes.substr(1, key_bytes), bytes.substr(1 + key_bytes + 2, value_bytes));
    bytes.remove_prefix(whole_bytes);
  }
  return true;
}

/// The same of an answer to this question; another's is none.
template <typename Found>
bool decode_answer(std::string_view bytes, std::uint32_t question, const Found& found) {
  return question_of_answer(bytes) == question && decode_answer(bytes, found);
}

}  // namespace swarmtalk::report
