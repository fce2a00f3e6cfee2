#include "recording/crc32.hpp"

#include <zlib.h>

namespace swarmtalk::recording {

std::uint32_t crc32(std::string_view bytes, std::uint32_t before) {
  const uLong crc = ::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  return static_cast<std::uint32_t>(crc);
}

}  // namespace swarmtalk::recording
