// Fuzz target: any bytes as a look or a report. What is taken reads the same when it is written
// down again, and stays within its limits.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "report/report.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace swarmtalk::report;
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  if (const auto look = decode_look(text)) {
    if (encode(*look) != text || look->wanted.size() > kMostWanted) std::abort();
  }
  const auto report = decode_report(text);
  if (!report) return 0;
  if (encode(*report) != text || report->roots.size() > kMostRoots) std::abort();
  for (const Record& record : report->records) {
    if (record.body.size() > kMostBodyBytes) std::abort();
    const auto facts = decode_body(record.body);
    if (facts && encode_body(*facts).size() > kMostBodyBytes) std::abort();
  }
  return 0;
}
