// What is said on the channel "harvest" (docs/wire-format.md, harvest): questions and answers as
// bytes, and back. Pure functions; anything may come in.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace swarmtalk::client {

struct HarvestQuestion {
  std::uint32_t number = 0;  // chosen at random by who asks
  std::uint8_t ttl = 0;      // of the answers
  std::string_view prefix;
};

inline constexpr std::size_t kHarvestAnswerHeaderBytes = 5;

std::string encode(const HarvestQuestion& question);
/// The beginning of an answer, which append_value() goes on.
std::string begin_answer(std::uint32_t question);
/// @param key  1 to 255 bytes @param value  at most 65535 bytes
void append_value(std::string& answer, std::string_view key, std::string_view value);

/// @return none: it is not a question; the prefix points into `bytes`
std::optional<HarvestQuestion> decode_question(std::string_view bytes);

/// Calls `found` with each value of an answer to this question.
/// @return false: it is none, or is cut; the values before the cut were found
bool decode_answer(std::string_view bytes, std::uint32_t question,
                   const std::function<void(std::string_view key, std::string_view value)>& found);

}  // namespace swarmtalk::client
