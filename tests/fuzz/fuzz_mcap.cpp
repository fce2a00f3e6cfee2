// Fuzz target: any bytes as a recording. The reader ends, stays within its limits, and says so when
// the bytes are not a whole file.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <sstream>
#include <string>

#include "recording/mcap_reader.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace swarmtalk::recording;
  std::istringstream file(std::string(reinterpret_cast<const char*>(bytes), size));
  McapReader reader(file);
  if (!reader.open().empty()) return 0;
  std::uint64_t count = 0;
  McapMessage message;
  while (reader.next(message)) {
    ++count;
    if (reader.channel(message.channel) == nullptr) std::abort();
  }
  if (count != reader.messages()) std::abort();
  const std::string problem = reader.problem();
  reader.rewind();
  while (reader.next(message)) --count;
  if (count != 0 || problem != reader.problem()) std::abort();
  return 0;
}
