// McapIndex: where the chunks of an MCAP file are, by the index at its end, so that a reader can go
// on behind a record that is damaged.
#pragma once

#include <cstdint>
#include <istream>
#include <map>
#include <optional>

#include "recording/mcap_format.hpp"

namespace swarmtalk::recording {

struct McapIndex {
  std::map<std::uint64_t, std::uint64_t> chunks;  // where they begin: bytes
  std::uint64_t at = 0;                           // where the index begins; 0: there is none

  /// Of a record, and of its head as it was read: whether it is as the index says.
  /// @return none: it is; else where to go on
  std::optional<std::uint64_t> behind_damage(std::uint64_t record_at, bool is_head_good, McapOp op,
                                             std::uint64_t length) const;
};

/// What the end of an MCAP file says of its index.
struct McapFooter {
  std::uint64_t index_at = 0;  // 0: there is none. As the file says, which may be wrong
  std::uint32_t crc = 0;       // of the index and the footer before it; 0: there is none
};

/// None: the file does not end with a footer. Leaves `in` somewhere.
std::optional<McapFooter> read_mcap_footer(std::istream& in, std::uint64_t size_bytes);

/// The index of a file of this size, or none: an index counts when its CRC is right. Leaves `in`
/// somewhere.
McapIndex read_mcap_index(std::istream& in, std::uint64_t size_bytes);

}  // namespace swarmtalk::recording
