#include "client_lib/harvest_text.hpp"

namespace swarmtalk::client {
namespace {

constexpr char kQuestion = 'Q';
constexpr char kAnswer = 'A';
constexpr std::size_t kQuestionHeaderBytes = 6;

void put(std::string& to, std::uint32_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) {
    to.push_back(static_cast<char>(value >> shift & 0xFF));
  }
}

std::uint32_t get(std::string_view from, std::size_t at, std::size_t bytes) {
  std::uint32_t value = 0;
  for (const char byte : from.substr(at, bytes))
    value = value << 8 | static_cast<std::uint8_t>(byte);
  return value;
}

}  // namespace

std::string encode(const HarvestQuestion& question) {
  std::string bytes(1, kQuestion);
  put(bytes, question.number, 4);
  put(bytes, question.ttl, 1);
  return bytes.append(question.prefix);
}

std::string begin_answer(std::uint32_t question) {
  std::string bytes(1, kAnswer);
  put(bytes, question, 4);
  return bytes;
}

void append_value(std::string& answer, std::string_view key, std::string_view value) {
  put(answer, static_cast<std::uint32_t>(key.size()), 1);
  answer.append(key);
  put(answer, static_cast<std::uint32_t>(value.size()), 2);
  answer.append(value);
}

std::optional<HarvestQuestion> decode_question(std::string_view bytes) {
  if (bytes.size() < kQuestionHeaderBytes || bytes[0] != kQuestion) return std::nullopt;
  return HarvestQuestion{get(bytes, 1, 4), static_cast<std::uint8_t>(get(bytes, 5, 1)),
                         bytes.substr(kQuestionHeaderBytes)};
}

bool decode_answer(std::string_view bytes, std::uint32_t question,
                   const std::function<void(std::string_view, std::string_view)>& found) {
  const bool is_ours = bytes.size() >= kHarvestAnswerHeaderBytes && bytes[0] == kAnswer &&
                       get(bytes, 1, 4) == question;
  if (!is_ours) return false;
  bytes.remove_prefix(kHarvestAnswerHeaderBytes);
  while (!bytes.empty()) {
    const std::size_t key_bytes = get(bytes, 0, 1);
    if (key_bytes == 0 || bytes.size() < 1 + key_bytes + 2) return false;
    const std::size_t value_bytes = get(bytes, 1 + key_bytes, 2);
    const std::size_t whole_bytes = 1 + key_bytes + 2 + value_bytes;
    if (bytes.size() < whole_bytes) return false;
    found(bytes.substr(1, key_bytes), bytes.substr(1 + key_bytes + 2, value_bytes));
    bytes.remove_prefix(whole_bytes);
  }
  return true;
}

}  // namespace swarmtalk::client
