// Answers to `ping` as robots send them (docs/wire-format.md): "pong RUN SEQUENCE HEARD HOPS
// VIA". Used by ping, doctor and survey.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>

namespace swarmtalk::cli {

struct Pong {
  std::uint32_t run = 0;       // who asked
  std::uint32_t sequence = 0;  // of the question
  std::uint32_t heard = 0;     // questions of this run so far, there
  std::uint32_t hops = 0;      // of the question
  std::uint32_t via = 0;       // from whom it was heard; 0: not told, by programs that do not know
};

/// @return none: it is something else
inline std::optional<Pong> read_pong(std::string_view payload) {
  constexpr std::string_view kWord = "pong";
  Pong pong;
  if (!payload.starts_with(kWord)) return std::nullopt;
  payload.remove_prefix(kWord.size());
  for (std::uint32_t* number : {&pong.run, &pong.sequence, &pong.heard, &pong.hops, &pong.via}) {
    if (number == &pong.via && payload.empty()) break;
    if (!payload.starts_with(' ')) return std::nullopt;
    payload.remove_prefix(1);
    const auto result = std::from_chars(payload.data(), payload.data() + payload.size(), *number);
    if (result.ec != std::errc()) return std::nullopt;
    payload.remove_prefix(static_cast<std::size_t>(result.ptr - payload.data()));
  }
  return payload.empty() ? std::make_optional(pong) : std::nullopt;
}

}  // namespace swarmtalk::cli
