// What the verbs that read or write captured frames share. One thread.
#pragma once

#include <pcap/pcap.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace swarmtalk::cli {

inline constexpr std::size_t kEthernetHeaderBytes = 14;

struct FileCloser {
  void operator()(pcap_t* handle) const { pcap_close(handle); }
  void operator()(pcap_dumper_t* dumper) const { pcap_dump_close(dumper); }
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// A capture that is being written.
class CaptureWriter {
 public:
  CaptureWriter() = default;
  CaptureWriter(const CaptureWriter&) = delete;
  CaptureWriter& operator=(const CaptureWriter&) = delete;
  /// What has not taken its place is removed.
  ~CaptureWriter();

  /// Makes the file. An existing one is kept until take_place(); pipes and devices are written to.
  /// @param path      "-": standard output
  /// @param replaces  the file may exist
  /// @param format    of the frames; used during the call
  /// @return empty, or what went wrong
  std::string open(const std::string& path, bool replaces, pcap_t* format);

  /// The new file is where the old one was. @return empty, or what went wrong
  std::string take_place();

  /// A pipe or device, standard output too: it has no folder to put something else beside it.
  bool is_stream() const { return is_stream_; }

  void write(const pcap_pkthdr& header, std::string_view bytes);

  /// What was written is in the file. @return empty, or what went wrong, now or before
  std::string flush();

 private:
  void look_for_failure();

  std::string path_;
  std::string new_path_;  // empty: the file is in its place
  std::unique_ptr<pcap_dumper_t, FileCloser> dumper_;
  bool is_stream_ = false;
  int error_ = 0;  // the first
};

inline std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace swarmtalk::cli
