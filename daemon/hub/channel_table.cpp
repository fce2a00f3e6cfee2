#include "daemon/hub/channel_table.hpp"

#include "daemon/common/names.hpp"

namespace swarmtalk::daemon {

ChannelTable::ChannelTable(std::map<std::string, std::uint16_t> configured) {
  configure(configured);
}

void ChannelTable::configure(const std::map<std::string, std::uint16_t>& configured) {
  names_.clear();
  numbers_.clear();
  for (const auto& [name, number] : configured) {
    names_.emplace(number, name);
    numbers_.emplace(name, number);
  }
}

ChannelTable::Result ChannelTable::find(std::string_view name) const {
  if (!is_legal_name(name)) {
    return {0, "a channel's name has 1 to 64 bytes of UTF-8, no control or invisible characters"};
  }
  if (const auto found = numbers_.find(name); found != numbers_.end()) return {found->second, ""};
  const std::uint16_t number = hash(name);
  const std::string& other = name_of(number);
  if (other.empty() || other == name) return {number, ""};
  return {0, "the channels '" + std::string(name) + "' and '" + other + "' both get the number " +
                 std::to_string(number) +
                 "; give one of them a number of its own under [channels]"};
}

void ChannelTable::hold(std::uint16_t number, std::string_view name) {
  if (name.empty() || numbers_.find(name) != numbers_.end()) return;
  Held& held = held_[number];
  if (held.uses++ == 0) held.name = name;
}

void ChannelTable::release(std::uint16_t number, std::string_view name) {
  const auto found = held_.find(number);
  if (found == held_.end() || found->second.name != name) return;
  if (--found->second.uses == 0) held_.erase(found);
}

const std::string& ChannelTable::name_of(std::uint16_t number) const {
  static const std::string none;
  if (const auto found = names_.find(number); found != names_.end()) return found->second;
  if (const auto found = held_.find(number); found != held_.end()) return found->second.name;
  return none;
}

std::uint16_t ChannelTable::hash(std::string_view name) {
  return hashed_channel(name);
}

}  // namespace swarmtalk::daemon
