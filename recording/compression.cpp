#include "recording/compression.hpp"

#include <zstd.h>

#include "recording/mcap_format.hpp"

namespace swarmtalk::recording {
namespace {

constexpr int kLevel = 1;  // a robot records beside its work; higher levels gain a tenth

}  // namespace

std::string compress_zstd(std::string_view bytes) {
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size =
      ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kLevel);
  out.resize(ZSTD_isError(size) != 0 ? 0 : size);
  return out;
}

bool decompress(std::string_view compression, std::string_view bytes, std::size_t size_bytes,
                std::string& out) {
  if (compression.empty()) {
    out.assign(bytes);
    return bytes.size() == size_bytes;
  }
  if (compression != kZstd) return false;
  out.resize(size_bytes);
  const std::size_t size = ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size());
  return ZSTD_isError(size) == 0 && size == size_bytes;
}

}  // namespace swarmtalk::recording
