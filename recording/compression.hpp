// Compression of a chunk's records: zstd, or none. Pure functions.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace swarmtalk::recording {

/// The bytes as one zstd frame.
std::string compress_zstd(std::string_view bytes);

/// @param compression  as a chunk names it: "zstd", or empty for none
/// @param size_bytes  what must come out. The caller limits it: so much is allocated
/// @return false: another compression, damage, or another size
bool decompress(std::string_view compression, std::string_view bytes, std::size_t size_bytes,
                std::string& out);

}  // namespace swarmtalk::recording
