#include "drivers/replay.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>

#include "drivers/link/link_error.hpp"
#include "drivers/link/link_log.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::drivers {
namespace {

constexpr std::size_t kEthernetHeaderBytes = 14;
constexpr std::size_t kFrameBytes = 1500;  // as on an Ethernet interface
constexpr int kFramesPerTurn = 64;
constexpr int kSnapshotBytes = 65535;
// Transmitter's address in the output file: locally administered, so it is nobody's.
constexpr std::array<std::uint8_t, 6> kOutputMac = {0x02, 'S', 'T', 0, 0, 1};

std::int64_t stamp_us(const pcap_pkthdr& header) {
  return std::int64_t{header.ts.tv_sec} * 1'000'000 + header.ts.tv_usec;
}

LinkError failure(LinkSetting blamed, const std::string& path, const std::string& what) {
  return LinkError(blamed, "replay '" + path + "': " + what);
}

}  // namespace

ReplayLink::ReplayLink(boost::asio::io_context& io, const ReplayConfig& config)
    : config_(config),
      timer_(io, [this] { play(); }),
      builder_(config.profile, config.max_packet_bytes),
      receiver_(config.profile),
      flushing_(loop::Loop::of(io), [this] { flush(); }) {
  std::array<char, PCAP_ERRBUF_SIZE> reason{};
  capture_.reset(pcap_open_offline(config_.capture_path.c_str(), reason.data()));
  if (!capture_) throw failure(LinkSetting::kCapture, config_.capture_path, reason.data());
  const int linktype = pcap_datalink(capture_.get());
  if (linktype != DLT_EN10MB) {
    const char* const name = pcap_datalink_val_to_name(linktype);
    throw failure(LinkSetting::kCapture, config_.capture_path,
                  "the capture is of linktype " +
                      (name != nullptr ? std::string(name) : std::to_string(linktype)) +
                      ", it must be of Ethernet (EN10MB); capture on one interface, not on 'any'");
  }
  send_buffer_.resize(kEthernetHeaderBytes + builder_.buffer_bytes(kFrameBytes));
  if (config_.output_path.empty()) return;
  output_format_.reset(pcap_open_dead(DLT_EN10MB, kSnapshotBytes));
  output_.reset(pcap_dump_open(output_format_.get(), config_.output_path.c_str()));
  if (!output_)
    throw failure(LinkSetting::kOutput, config_.output_path, pcap_geterr(output_format_.get()));
}

void ReplayLink::start(LinkUser& user) {
  user_ = &user;
  started_at_ = loop::now();
  wake();
  if (!read_next()) return;
  first_stamp_us_ = stamp_us(*next_header_);
  timer_.at(started_at_);
}

void ReplayLink::wake() {
  if (user_ != nullptr) flushing_.at_end();
}

std::string ReplayLink::state() const {
  // What was recorded is not of now.
  const std::string remark = has_key_ ? ", sealed, freshness not checked" : "";
  return (is_finished_ ? end_ : "up, replaying " + config_.capture_path) + remark +
         (output_problem_.empty() ? "" : ", " + output_problem_);
}

bool ReplayLink::read_next() {
  pcap_pkthdr* header = nullptr;
  const int result = pcap_next_ex(capture_.get(), &header, &next_bytes_);
  next_header_ = header;
  if (result == 1) return true;
  is_finished_ = true;
  end_ = result == PCAP_ERROR_BREAK ? "finished"
                                    : std::string("stopped: ") + pcap_geterr(capture_.get());
  link_log()->info("replay {}: {}, {} frames received", config_.capture_path, end_,
                   counters_.frames_received);
  return false;
}

void ReplayLink::play() {
  for (int i = 0; i < kFramesPerTurn; ++i) {
    const MonotonicTime now = loop::now();
    if (config_.pace == ReplayPace::kRecorded) {
      const std::int64_t offset_us =
          std::max<std::int64_t>(0, stamp_us(*next_header_) - first_stamp_us_);
      const MonotonicTime due = started_at_ + std::chrono::microseconds(offset_us);
      if (due > now) return timer_.at(due);
    }
    deliver(now);
    if (!read_next()) return;
  }
  timer_.at(started_at_);  // goes on in the next turn
}

void ReplayLink::deliver(MonotonicTime now) {
  const std::span<const std::uint8_t> bytes(next_bytes_, next_header_->caplen);
  if (bytes.size() < kEthernetHeaderBytes) return;
  if (((bytes[12] << 8) | bytes[13]) != config_.ethertype) return;
  receiver_.receive(bytes.subspan(kEthernetHeaderBytes), {now}, *user_, counters_);
}

void ReplayLink::flush() {
  for (int i = 0; i < kFramesPerTurn; ++i) {
    const BuiltFrame built = builder_.build(
        *user_, std::span(send_buffer_).subspan(kEthernetHeaderBytes), kFrameBytes, counters_);
    if (built.size_bytes > 0) {
      write_frame(built.size_bytes);
      ++counters_.frames_sent;
      counters_.packets_sent += built.packets;
      counters_.bytes_sent += built.size_bytes;
    }
    if (!built.more_waits) return;
  }
  wake();
}

void ReplayLink::write_frame(std::size_t frame_bytes) {
  if (!output_) return;
  std::fill_n(send_buffer_.begin(), 6, std::uint8_t{0xFF});
  std::copy(kOutputMac.begin(), kOutputMac.end(), send_buffer_.begin() + 6);
  send_buffer_[12] = static_cast<std::uint8_t>(config_.ethertype >> 8);
  send_buffer_[13] = static_cast<std::uint8_t>(config_.ethertype);
  pcap_pkthdr header{};
  const auto now =
      std::chrono::floor<std::chrono::microseconds>(loop::wall_now().time_since_epoch());
  header.ts = {
      static_cast<time_t>(now / std::chrono::seconds(1)),
      static_cast<suseconds_t>(now % std::chrono::seconds(1) / std::chrono::microseconds(1))};
  header.caplen = header.len = static_cast<bpf_u_int32>(kEthernetHeaderBytes + frame_bytes);
  pcap_dump(reinterpret_cast<u_char*>(output_.get()), &header, send_buffer_.data());
  pcap_dump_flush(output_.get());
  if (std::ferror(pcap_dump_file(output_.get())) == 0) return;
  output_problem_ = "cannot write " + config_.output_path + ": " + std::strerror(errno);
  link_log()->error("replay {}: {}; what is sent from now on is thrown away", config_.capture_path,
                    output_problem_);
  output_.reset();
}

}  // namespace swarmtalk::drivers
