// Pty: a pseudo terminal that looks to a host program like the serial device of a robot or of an
// overhead controller, reachable under a name of one's choice (a symbolic link). Never blocks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace swarmtalk::emulator {

class Pty {
 public:
  /// @param link_path  name for the terminal; an old symbolic link there is replaced, anything else
  ///                   is left alone and an error. "" for no name.
  /// @throws std::runtime_error
  explicit Pty(const std::string& link_path);
  ~Pty();
  Pty(const Pty&) = delete;
  Pty& operator=(const Pty&) = delete;

  const std::string& device() const { return device_; }

  /// Appends what the host has written since, at most `limit` bytes; returns their number.
  std::size_t read_into(std::vector<std::uint8_t>& bytes, std::size_t limit = 4096);

  /// Gives bytes to the host. What does not fit, because nobody reads, is dropped and counted.
  void write(std::span<const std::uint8_t> bytes);
  std::uint64_t dropped_bytes() const { return dropped_bytes_; }

  int descriptor() const { return master_; }

 private:
  int master_ = -1;
  int slave_ = -1;  // held open, so that the host may close and open it again
  std::string device_;
  std::string link_path_;
  std::uint64_t dropped_bytes_ = 0;
};

}  // namespace swarmtalk::emulator
