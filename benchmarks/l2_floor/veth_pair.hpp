// Two network namespaces joined by a veth pair, "air0" on both sides; removed in the destructor.
// Needs root.
#pragma once

#include <string>

namespace swarmtalk::l2_floor {

inline constexpr const char* kInterface = "air0";

class VethPair {
 public:
  /// @throws std::runtime_error
  VethPair();
  ~VethPair();
  VethPair(const VethPair&) = delete;
  VethPair& operator=(const VethPair&) = delete;

  /// Moves the calling process into one of the namespaces. @param side  'a' or 'b'
  void enter(char side) const;

 private:
  std::string name(char side) const { return prefix_ + side; }

  std::string prefix_;
};

}  // namespace swarmtalk::l2_floor
