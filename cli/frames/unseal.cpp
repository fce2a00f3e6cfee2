#include "cli/frames/unseal.hpp"

#include <pcap/pcap.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>

#include "cli/common/commands.hpp"
#include "cli/frames/capture_files.hpp"
#include "cli/text/hex.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::size_t kMaxKeyFileBytes = 4096;

}  // namespace

std::string Unsealer::load(const std::string& key_file) {
  if (key_file.empty()) return {};
  std::ifstream file(key_file, std::ios::binary);
  if (!file) return "cannot read the key file " + key_file + ": " + std::strerror(errno);
  std::string text(std::istreambuf_iterator<char>(file), {});
  if (text.size() > kMaxKeyFileBytes) text.clear();
  std::erase_if(text, [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; });
  const auto key = from_hex(text);
  std::array<std::uint8_t, frame::SwarmKey::kBytes> bytes{};
  if (!key || key->size() != bytes.size()) {
    return key_file + " is not a swarm key: 64 hexadecimal digits, as swarmtalk-cli keygen makes";
  }
  std::copy(key->begin(), key->end(), bytes.begin());
  opener_.emplace(std::make_shared<frame::SwarmKey>(bytes));
  opener_->take_repeats();
  return {};
}

std::string Unsealer::operator()(std::string_view frame) {
  frame::Frame read;
  if (!opener_ || frame::parse(bytes_of(frame), read) != frame::ParseResult::kSealed) {
    return std::string(frame);
  }
  if (opener_->open(bytes_of(frame), read) != frame::ParseResult::kOk) {
    ++left_sealed_;
    return std::string(frame);
  }
  ++opened_;
  const auto plain = frame::plain_copy(read);
  return {plain.begin(), plain.end()};
}

std::string Unsealer::summary() const {
  if (!opener_) return {};
  return "; " + std::to_string(opened_) + " frames unsealed, " + std::to_string(left_sealed_) +
         " left sealed (of another key, or damaged)";
}

int copy_capture(const std::string& from, const std::string& to, Unsealer& unseal) {
  char problem[PCAP_ERRBUF_SIZE] = "";
  const std::unique_ptr<pcap_t, FileCloser> source(
      pcap_open_offline_with_tstamp_precision(from.c_str(), PCAP_TSTAMP_PRECISION_NANO, problem));
  if (!source) return fail("cannot read " + from + ": " + problem);
  if (pcap_datalink(source.get()) != DLT_EN10MB) {
    return fail(from +
                " is not a capture of Ethernet frames, as swarmtalk-cli capture writes them");
  }
  const std::unique_ptr<pcap_dumper_t, FileCloser> target(pcap_dump_open(source.get(), to.c_str()));
  if (!target) return fail("cannot write " + to + ": " + pcap_geterr(source.get()));
  std::uint64_t frames = 0;
  pcap_pkthdr* header = nullptr;
  const std::uint8_t* data = nullptr;
  int result = 0;
  while ((result = pcap_next_ex(source.get(), &header, &data)) == 1) {
    std::string bytes(reinterpret_cast<const char*>(data), header->caplen);
    if (bytes.size() > kEthernetHeaderBytes) {
      bytes.replace(kEthernetHeaderBytes, std::string::npos,
                    unseal(std::string_view(bytes).substr(kEthernetHeaderBytes)));
    }
    pcap_pkthdr written = *header;
    written.caplen = written.len = static_cast<bpf_u_int32>(bytes.size());
    pcap_dump(reinterpret_cast<u_char*>(target.get()), &written,
              reinterpret_cast<const u_char*>(bytes.data()));
    ++frames;
  }
  if (result != PCAP_ERROR_BREAK)
    return fail(from + " is cut off or damaged: " + pcap_geterr(source.get()));
  if (pcap_dump_flush(target.get()) != 0) return fail("cannot write " + to);
  return print(to + ": " + std::to_string(frames) + " frames" + unseal.summary() + "\n");
}

}  // namespace swarmtalk::cli
