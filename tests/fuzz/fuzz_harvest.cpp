// Fuzz target: any bytes as a message on the channel "harvest". Keys and values lie inside it, and
// what was whole is written the same again.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "report/harvest_text.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace swarmtalk::report;
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  if (const auto question = decode_question(text)) {
    if (encode(*question) != text) std::abort();
    return 0;
  }
  constexpr std::uint32_t kQuestion = 0x61626364;  // "abcd", as in the corpus
  std::string again = begin_answer(kQuestion);
  const bool is_whole =
      decode_answer(text, kQuestion, [&](std::string_view key, std::string_view value) {
        if (key.empty() || key.data() < text.data() ||
            value.data() + value.size() > text.data() + text.size()) {
          std::abort();
        }
        append_value(again, key, value);
      });
  if (is_whole && again != text) std::abort();
  return 0;
}
