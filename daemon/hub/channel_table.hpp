// ChannelTable: names of channels to their numbers and back. A name of the configuration has the
// number given there; any other is hashed to 0x8000..0xFFFF, the same on every robot, so programs
// need no configuration to meet. Two names with one number are refused, never mixed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <unordered_map>

namespace swarmtalk::daemon {

class ChannelTable {
 public:
  struct Result {
    std::uint16_t number = 0;
    std::string problem;  // empty: found; else one sentence with the remedy
  };

  /// @param configured  names to different numbers
  explicit ChannelTable(std::map<std::string, std::uint16_t> configured);

  /// The configuration has changed. Channels in use keep their numbers until they are given up.
  void configure(const std::map<std::string, std::uint16_t>& configured);

  /// Number of a name. Fails for an impossible name, and for one whose hash is the number of a
  /// configured name or of one that is in use.
  Result find(std::string_view name) const;

  /// Remembers that a channel is in use under this name, until as many release() as hold(): no
  /// other name gets its number meanwhile. An empty name (a client that knows the number) is legal.
  void hold(std::uint16_t number, std::string_view name);
  void release(std::uint16_t number, std::string_view name);

  /// Name of a number: configured, else the one in use. Empty: none known.
  const std::string& name_of(std::uint16_t number) const;

  /// 0x8000 | 15 bits of the name's 32-bit FNV-1a hash, upper half folded onto the lower.
  static std::uint16_t hash(std::string_view name);

 private:
  struct Held {
    std::string name;
    std::size_t uses = 0;
  };

  std::map<std::string, std::uint16_t, std::less<>> numbers_;
  std::unordered_map<std::uint16_t, std::string> names_;  // of the configuration
  std::unordered_map<std::uint16_t, Held> held_;          // hashed names in use
};

}  // namespace swarmtalk::daemon
