// ReplayLink: a capture file as a link, for tests. Frames of our EtherType in the file are received
// as if from an interface; what is transmitted goes to another capture file, or nowhere.
#pragma once

#include <pcap/pcap.h>

#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/link/framer.hpp"
#include "drivers/link/link.hpp"
#include "drivers/link/link_counters.hpp"
#include "loop/loop.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::drivers {

enum class ReplayPace : std::uint8_t { kRecorded, kFastest };

struct ReplayConfig {
  std::string capture_path;
  std::string output_path;  // empty: what is transmitted is counted and thrown away
  ReplayPace pace = ReplayPace::kRecorded;
  std::uint16_t ethertype = frame::kDefaultEthertype;
  frame::ProfileId profile = frame::ProfileId::kWifi;
  std::size_t max_packet_bytes = 1400;  // the profile's MTU
};

class ReplayLink final : public Link {
 public:
  /// @throws std::runtime_error  one line: no such file, not a capture, not of Ethernet, output not
  ///   writable
  ReplayLink(boost::asio::io_context& io, const ReplayConfig& config);

  void start(LinkUser& user) override;
  void wake() override;
  void set_key(std::shared_ptr<const frame::SwarmKey> key) override {
    use_key(key, builder_, receiver_, also_key_);
    has_key_ = key != nullptr;
  }
  void set_also_key(std::shared_ptr<const frame::SwarmKey> key) override {
    also_key_ = std::move(key);
  }
  bool is_up() const override { return !is_finished_; }
  std::string state() const override;
  std::string type() const override { return "replay"; }
  std::string device() const override { return config_.capture_path; }
  Counters counters() const override { return counters_.list(); }

  /// The last frame of the capture has been handed up. Transmitting goes on working.
  bool is_finished() const { return is_finished_; }

 private:
  struct PcapCloser {
    void operator()(pcap_t* handle) const { pcap_close(handle); }
    void operator()(pcap_dumper_t* dumper) const { pcap_dump_close(dumper); }
  };

  bool read_next();
  void play();
  void deliver(MonotonicTime now);
  void flush();
  void write_frame(std::size_t frame_bytes);

  ReplayConfig config_;
  std::unique_ptr<pcap_t, PcapCloser> capture_;
  std::unique_ptr<pcap_t, PcapCloser> output_format_;
  std::unique_ptr<pcap_dumper_t, PcapCloser> output_;
  std::string output_problem_;
  loop::Timer timer_;
  LinkUser* user_ = nullptr;
  LinkCounters counters_;
  FrameBuilder builder_;
  FrameReceiver receiver_;
  std::shared_ptr<const frame::SwarmKey> also_key_;
  bool has_key_ = false;
  std::vector<std::uint8_t> send_buffer_;
  const pcap_pkthdr* next_header_ = nullptr;  // frame read ahead, to know when it is due
  const std::uint8_t* next_bytes_ = nullptr;
  MonotonicTime started_at_{};
  std::int64_t first_stamp_us_ = -1;
  std::string end_;  // why the replay ended
  bool is_finished_ = false;
  loop::Deferred flushing_;  // flush(), once a turn
};

}  // namespace swarmtalk::drivers
