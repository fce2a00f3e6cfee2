// Sealed frames of a capture, written as a robot without a key would have sent them, for Wireshark
// and the like. Only frame/ knows how frames are sealed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "frame/sealing.hpp"

namespace swarmtalk::cli {

struct CaptureArguments;

class Unsealer {
 public:
  /// @param key_file  empty: frames stay as they are
  /// @return empty, or what is wrong with the file
  std::string load(const std::string& key_file);

  /// The frame unsealed; as it is when it is not sealed, or cannot be opened.
  std::string operator()(std::string_view frame);

  /// Prints what was written, and with a key "; 7 frames unsealed, 1 left sealed". A key that opens
  /// none of the sealed frames is the wrong one.
  /// @param path  "-": standard output holds the frames, so the line goes to standard error
  /// @return the exit code
  int tell(const std::string& path, const std::string& written) const;

 private:
  std::optional<frame::Opener> opener_;
  std::uint64_t opened_ = 0;
  std::uint64_t left_sealed_ = 0;
};

/// Copies the capture `from`, frames unsealed. @return the exit code
int copy_capture(const CaptureArguments& arguments, Unsealer& unseal);

}  // namespace swarmtalk::cli
