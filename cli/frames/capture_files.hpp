// What the verbs that read or write captured frames share.
#pragma once

#include <pcap/pcap.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string_view>

namespace swarmtalk::cli {

inline constexpr std::size_t kEthernetHeaderBytes = 14;

struct FileCloser {
  void operator()(pcap_t* handle) const { pcap_close(handle); }
  void operator()(pcap_dumper_t* dumper) const { pcap_dump_close(dumper); }
  void operator()(std::FILE* file) const { std::fclose(file); }
};

inline std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace swarmtalk::cli
