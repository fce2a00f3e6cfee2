// KilobotLink: a table of Kilobots as a link. Downlink: one packet is one infrared message that the
// overhead controller sends to all robots in its light. Uplink: a gateway Kilobot reports what it
// hears on its own serial line; both lines may be one device. Nothing is acknowledged, the uplink
// hears the gateway's neighbourhood only. Beside packets it sends commands (Sequence), one at a
// time. Created by the daemon, runs on its io_context's thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "drivers/link/link.hpp"
#include "drivers/link/link_counters.hpp"
#include "kilobot_bridge/gateway_reader.hpp"
#include "kilobot_bridge/line_reader.hpp"
#include "kilobot_bridge/overhead_sender.hpp"
#include "kilobot_bridge/reconnecting_port.hpp"
#include "kilobot_bridge/sent_packets.hpp"
#include "loop/loop.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::kilobot_bridge {

enum class UplinkForm : std::uint8_t {
  kFrames,  // the gateway's reports
  kText     // lines of any program that prints
};

struct KilobotLinkConfig {
  std::string downlink;  // the overhead controller's device; empty: nothing is sent
  std::string uplink;    // the gateway's, may be the same; empty: nothing is heard
  UplinkForm uplink_form = UplinkForm::kFrames;
  frame::ProfileId profile = frame::ProfileId::kKilobot;  // or kClassic2020
  Pacing pacing;
  bool has_single = false;  // the controller knows kForwardSingle: one copy instead of some
  Duration settle = std::chrono::milliseconds(3500);  // after opening; an Arduino starts anew then
  std::vector<std::chrono::milliseconds> pauses = PortConfig{}.pauses;  // before opening again
};

enum class SequenceEnd : std::uint8_t {
  kSent,     // all of it; what the robots made of it nobody knows
  kStopped,  // by request, STOP was sent
  kFailed    // the device was lost
};

/// Who began a sequence. Called by the link; may begin the next one in on_sequence_end().
class SequenceUser {
 public:
  virtual ~SequenceUser() = default;
  /// A frame of it is about to leave.
  virtual void on_sequence_frame(const Player& player) = 0;
  /// @param text  why, if it was not sent whole
  virtual void on_sequence_end(const Player& player, SequenceEnd end, const std::string& text) = 0;
};

/// What an overhead controller of ours says of itself on the downlink. All else there is noise.
class ControllerListener final : public GatewayUser {
 public:
  void on_reception(const GatewayReception&) override {}
  void on_hello(const GatewayHello&) override {}
  void on_version(const ControllerVersion& said) override { version = said; }
  void on_text(std::string_view) override {}

  std::optional<ControllerVersion> version;
};

class KilobotLink final : public drivers::Link,
                          private OverheadLine,
                          private FrameSource,
                          private PortUser,
                          private GatewayUser {
 public:
  /// @throws std::runtime_error  one line: no device named, no permission, in use, no serial device
  KilobotLink(boost::asio::io_context& io, const KilobotLinkConfig& config);
  ~KilobotLink() override;

  void start(drivers::LinkUser& user) override;
  void wake() override;
  /// Whether packets are sent. Not while robots are being programmed.
  bool is_up() const override;
  std::string state() const override;
  std::string type() const override { return "kilobot"; }
  std::string device() const override;
  drivers::Counters counters() const override;

  const Pacing& pacing() const { return config_.pacing; }
  bool has_single() const { return config_.has_single; }

  /// Begins a command. @param user  kept until its on_sequence_end()
  /// @return why not, one sentence; empty: begun
  std::string begin(Sequence sequence, SequenceUser& user);
  /// Ends the sequence in hand, if any: its last frames, a STOP, leave as soon as the line allows.
  void stop();
  /// The sequence in hand; nullptr: none.
  const Player* player() const { return player_ ? &*player_ : nullptr; }
  /// Its user is about to go: the sequence is stopped and nobody is told.
  void abandon(const SequenceUser& user);

  /// Called with each line that a text uplink brings, and with texts of the gateway.
  void set_text_hook(std::function<void(const std::string&)> hook) { on_line_ = std::move(hook); }

 private:
  // OverheadLine, FrameSource
  std::size_t write_line(std::span<const std::uint8_t> bytes) override;
  bool is_drained() override;
  std::optional<TimedFrame> next_frame() override;
  std::optional<TimedFrame> next_packet();

  // PortUser, GatewayUser
  void on_port_open(ReconnectingPort& port) override;
  void on_port_bytes(ReconnectingPort& port, std::span<const std::uint8_t> bytes) override;
  void on_port_lost(ReconnectingPort& port) override;
  void on_reception(const GatewayReception& reception) override;
  void on_hello(const GatewayHello& hello) override;
  void on_version(const ControllerVersion& version) override { controller_.version = version; }
  void on_text(std::string_view text) override;

  bool is_one_device() const { return config_.downlink == config_.uplink; }
  ReconnectingPort* uplink() const { return is_one_device() ? downlink_.get() : uplink_.get(); }
  void end_sequence(SequenceEnd end, const std::string& text);
  Duration left() const;  // of the sequence in hand, ours
  void run_sender();
  std::string downlink_state() const;
  std::string uplink_state() const;

  KilobotLinkConfig config_;
  drivers::LinkUser* user_ = nullptr;
  std::unique_ptr<ReconnectingPort> downlink_;
  std::unique_ptr<ReconnectingPort> uplink_;
  OverheadSender sender_;
  loop::Timer timer_;
  loop::Deferred sending_;  // run_sender(), once a turn

  std::optional<Player> player_;
  SequenceUser* sequence_user_ = nullptr;  // none: abandoned

  ControllerListener controller_;
  GatewayReader controller_reader_{controller_};  // of a downlink that is not the uplink
  GatewayReader reader_;
  LineReader lines_;
  std::function<void(const std::string&)> on_line_;
  std::optional<GatewayHello> gateway_;
  drivers::MonotonicTime heard_at_{};  // the last readable report
  std::uint64_t unreadable_told_ = 0;
  drivers::MonotonicTime unreadable_told_at_{};

  SentPackets sent_;  // the gateway hears the overhead controller too
  drivers::LinkCounters counters_;
  std::uint64_t texts_ = 0;                 // lines, and texts of the gateway
  std::uint64_t messages_of_programs_ = 0;  // reports with infrared types of no profile of ours
};

}  // namespace swarmtalk::kilobot_bridge
