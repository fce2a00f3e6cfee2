// LinkError: why a link cannot be opened, and which of its settings is to blame, so that who made
// the settings can say where they stand. Thrown by the links' constructors.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace swarmtalk::drivers {

enum class LinkSetting : std::uint8_t {
  kNone,  // the machine's or the process's fault
  kInterface,
  kEthertype,
  kAddress,
  kPort,
  kCapture,
  kOutput,
  kDownlink,
  kUplink,
};

class LinkError : public std::runtime_error {
 public:
  /// @param what  one line with the remedy
  LinkError(LinkSetting blamed, const std::string& what)
      : std::runtime_error(what), blamed_(blamed) {}
  LinkSetting blamed() const { return blamed_; }

 private:
  LinkSetting blamed_;
};

}  // namespace swarmtalk::drivers
