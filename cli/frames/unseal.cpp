#include "cli/frames/unseal.hpp"

#include <fcntl.h>
#include <pcap/pcap.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>

#include "cli/common/commands.hpp"
#include "cli/frames/capture_files.hpp"
#include "cli/text/hex.hpp"
#include "text/counted.hpp"
#include "text/encoding.hpp"
#include "text/plain.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::size_t kMaxKeyFileBytes = 4096;

}  // namespace

std::string Unsealer::load(const std::string& key_file) {
  if (key_file.empty()) return {};
  std::ifstream file(key_file, std::ios::binary);
  if (!file) return "cannot read the key file " + key_file + ": " + std::strerror(errno);
  std::ostringstream read;
  read << file.rdbuf();  // nothing of a folder
  std::string digits = read.str();
  if (digits.size() > kMaxKeyFileBytes) digits.clear();
  if (const std::string problem = text::encoding_problem(digits); !problem.empty()) {
    return key_file + " " + problem;
  }
  digits = text::without_mark(digits);
  std::erase_if(digits, [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; });
  const auto key = from_hex(digits);
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

int Unsealer::tell(const std::string& path, const std::string& written) const {
  std::string text = path == "-" ? written : path + ": " + written;
  if (opener_) {
    text += "; " + text::counted(opened_, "frame") + " unsealed, " + std::to_string(left_sealed_) +
            " left sealed (of another key, or damaged)";
  }
  if (opener_ && opened_ == 0 && left_sealed_ > 0) return fail(text);
  return path == "-" ? fail(text, kExitOk) : print(text::plain(text) + "\n");
}

namespace {

/// A capture to read, or what is wrong with it in `problem`.
std::unique_ptr<pcap_t, FileCloser> open_source(const std::string& path, std::string& problem) {
  const int fd = path == "-" ? ::dup(STDIN_FILENO) : ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  std::FILE* const file = fd < 0 ? nullptr : ::fdopen(fd, "r");
  if (file == nullptr) {
    problem = "cannot read " + path + ": " + std::strerror(errno);
    if (fd >= 0) ::close(fd);
    return nullptr;
  }
  char why[PCAP_ERRBUF_SIZE] = "";
  std::unique_ptr<pcap_t, FileCloser> source(
      pcap_fopen_offline_with_tstamp_precision(file, PCAP_TSTAMP_PRECISION_NANO, why));
  if (!source) {
    std::fclose(file);
    problem = "cannot read " + path + ": " + why;
  }
  return source;
}

}  // namespace

int copy_capture(const CaptureArguments& arguments, Unsealer& unseal) {
  const std::string& from = arguments.from;
  const std::string& to = arguments.file;
  std::string problem;
  const auto source = open_source(from, problem);
  if (!source) return fail(problem);
  if (pcap_datalink(source.get()) != DLT_EN10MB) {
    return fail(from +
                " is not a capture of Ethernet frames, as swarmtalk-cli capture writes them");
  }
  CaptureWriter target;
  if (problem = target.open(to, arguments.replaces, source.get()); !problem.empty()) {
    return fail(problem);
  }
  std::uint64_t frames = 0;
  pcap_pkthdr* header = nullptr;
  const std::uint8_t* data = nullptr;
  int result = PCAP_ERROR_BREAK;
  while ((arguments.count == 0 || frames < arguments.count) &&
         (result = pcap_next_ex(source.get(), &header, &data)) == 1) {
    std::string bytes(reinterpret_cast<const char*>(data), header->caplen);
    if (bytes.size() > kEthernetHeaderBytes) {
      bytes.replace(kEthernetHeaderBytes, std::string::npos,
                    unseal(std::string_view(bytes).substr(kEthernetHeaderBytes)));
    }
    pcap_pkthdr written = *header;
    written.caplen = written.len = static_cast<bpf_u_int32>(bytes.size());
    target.write(written, bytes);
    ++frames;
  }
  if (result != PCAP_ERROR_BREAK && result != 1) {
    return fail(from + " is cut off or damaged: " + pcap_geterr(source.get()));
  }
  if (problem = target.take_place(); !problem.empty()) return fail(problem);
  return unseal.tell(to, text::counted(frames, "frame"));
}

}  // namespace swarmtalk::cli
