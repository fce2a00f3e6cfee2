#include "kilobot_bridge/kilobot_link.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "drivers/link/link_error.hpp"
#include "drivers/link/link_log.hpp"
#include "kilobot_wire/battery.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::kilobot_bridge {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kGatewaySilence = std::chrono::seconds(3);  // it says hello each second
constexpr auto kUnreadablePeriod = std::chrono::seconds(1);
constexpr std::size_t kClassicPacketBytes = 8;

/// How packets of a profile lie in infrared messages (docs/decisions/0020).
struct IrForm {
  std::uint8_t sent_type;
  std::uint8_t heard_type;
  std::size_t packet_bytes;
};

IrForm form_of(frame::ProfileId profile) {
  if (profile == frame::ProfileId::kClassic2020) {
    return {kilobot::kIrClassic2020, kilobot::kIrClassic2020, kClassicPacketBytes};
  }
  return {kilobot::kIrSwarmtalkFromOverhead, kilobot::kIrSwarmtalk, kilobot::kIrDataBytes};
}

/// One device under two names is opened once.
bool is_same_device(const std::string& a, const std::string& b) {
  struct stat first {};
  struct stat second {};
  if (a == b) return true;
  if (::stat(a.c_str(), &first) != 0 || ::stat(b.c_str(), &second) != 0) return false;
  return S_ISCHR(first.st_mode) && S_ISCHR(second.st_mode) && first.st_rdev == second.st_rdev;
}

std::string seconds_text(Duration time) {
  const auto seconds = std::chrono::ceil<std::chrono::seconds>(time).count();
  std::string rest = std::to_string(seconds % 60);
  return std::to_string(seconds / 60) + ":" + (rest.size() < 2 ? "0" : "") + rest;
}

/// As the LED of a robot shows it that is told VOLTAGE.
std::string battery_colour(std::uint16_t reading) {
  if (reading == 0) return "not measured yet";
  return reading > kilobot::kBatteryFull   ? "green"
         : reading > kilobot::kBatteryGood ? "blue"
         : reading > kilobot::kBatteryLow  ? "yellow"
                                           : "red";
}

}  // namespace

KilobotLink::KilobotLink(boost::asio::io_context& io, const KilobotLinkConfig& config)
    : config_(config),
      sender_(config_.pacing, *this, *this),
      timer_(io, [this] { run_sender(); }),
      sending_(loop::Loop::of(io), [this] { run_sender(); }),
      reader_(*this),
      lines_([this](const std::string& line) { on_text(line); }) {
  if (config_.downlink.empty() && config_.uplink.empty()) {
    throw drivers::LinkError(drivers::LinkSetting::kDownlink,
                             "kilobot: neither a downlink nor an uplink is given");
  }
  if (is_same_device(config_.downlink, config_.uplink)) config_.uplink = config_.downlink;
  const auto open = [this, &io](const std::string& path, drivers::LinkSetting setting) {
    PortUser& port_user = *this;
    try {
      return std::make_unique<ReconnectingPort>(
          io, PortConfig{path, config_.pacing.baud, config_.pauses}, port_user);
    } catch (const std::runtime_error& error) {
      throw drivers::LinkError(setting, error.what());
    }
  };
  if (!config_.downlink.empty()) {
    downlink_ = open(config_.downlink, drivers::LinkSetting::kDownlink);
  }
  if (!config_.uplink.empty() && !is_one_device()) {
    uplink_ = open(config_.uplink, drivers::LinkSetting::kUplink);
  }
}

// A controller that repeats goes on for ever, so the last thing on the line is a STOP. Closing the
// device waits for these bytes.
KilobotLink::~KilobotLink() {
  if (downlink_ && downlink_->is_open()) downlink_->write(sender_.last_words());
}

void KilobotLink::start(drivers::LinkUser& user) {
  user_ = &user;
  if (downlink_) downlink_->start();
  if (uplink_) uplink_->start();
}

void KilobotLink::wake() {
  if (user_ != nullptr) sending_.at_end();
}

bool KilobotLink::is_up() const {
  return sender_.is_ready() && !(player_ && player_->sequence().is_program);
}

std::string KilobotLink::device() const {
  if (config_.downlink.empty()) return config_.uplink;
  if (config_.uplink.empty() || is_one_device()) return config_.downlink;
  return config_.downlink + ", " + config_.uplink;
}

std::string KilobotLink::begin(Sequence sequence, SequenceUser& user) {
  if (!downlink_) {
    return "this link has no downlink; name the overhead controller's device in the configuration";
  }
  if (player_) {
    return "the overhead controller is busy with '" + player_->sequence().name + "', " +
           (player_->frames() == 0 ? std::string("until it is stopped")
                                   : "for another " + seconds_text(left())) +
           "; wait, or end it with: swarmtalk-cli kilobot stop";
  }
  if (!downlink_->is_open()) return downlink_state();
  if (!sender_.is_ready()) return downlink_state() + "; try again then";
  player_.emplace(std::move(sequence), config_.pacing);
  sequence_user_ = &user;
  wake();
  return "";
}

Duration KilobotLink::left() const {
  return config_.pacing.to_ours(player_->left()) + sender_.left(loop::now());
}

void KilobotLink::stop() {
  if (!player_) return;
  player_->stop();
  sender_.cut_hold();
  wake();
}

void KilobotLink::abandon(const SequenceUser& user) {
  if (sequence_user_ != &user) return;
  sequence_user_ = nullptr;
  stop();
}

void KilobotLink::end_sequence(SequenceEnd end, const std::string& text) {
  if (!player_) return;
  const Player player = std::move(*player_);
  player_.reset();
  SequenceUser* user = std::exchange(sequence_user_, nullptr);
  if (user != nullptr) user->on_sequence_end(player, end, text);
}

void KilobotLink::run_sender() {
  const auto next = sender_.poll(loop::now());
  if (sender_.has_stalled()) return downlink_->fail("it takes no bytes");
  if (next == Clock::time_point::max()) return;
  timer_.at(next);
}

std::size_t KilobotLink::write_line(std::span<const std::uint8_t> bytes) {
  return downlink_->write(bytes);
}

bool KilobotLink::is_drained() {
  return downlink_->is_drained();
}

std::optional<TimedFrame> KilobotLink::next_frame() {
  while (player_) {
    if (auto frame = player_->next()) {
      if (sequence_user_ != nullptr) sequence_user_->on_sequence_frame(*player_);
      return frame;
    }
    const bool was_stopped = player_->is_stopped();
    end_sequence(was_stopped ? SequenceEnd::kStopped : SequenceEnd::kSent,
                 was_stopped ? "it was stopped" : "");
  }
  return next_packet();
}

std::optional<TimedFrame> KilobotLink::next_packet() {
  const IrForm form = form_of(config_.profile);
  IrData data{};
  std::size_t size = user_->pull_packet(data);
  while (size > form.packet_bytes) {
    ++counters_.packets_over_mtu;
    data = {};
    size = user_->pull_packet(data);
  }
  if (size == 0) return std::nullopt;
  ++counters_.packets_sent;
  sent_.remember(data);
  return TimedFrame{config_.has_single ? forward_single_frame(form.sent_type, data)
                                       : forward_frame(form.sent_type, data),
                    Duration(0)};
}

void KilobotLink::on_port_open(ReconnectingPort& port) {
  if (&port == downlink_.get()) {
    // Lines of text would be spoilt by the answer.
    const bool is_text = is_one_device() && config_.uplink_form == UplinkForm::kText;
    controller_.version.reset();
    controller_reader_.on_interrupted();
    controller_reader_.put(std::array<std::uint8_t, 1>{0});  // it answers once: no frame before
    sender_.open(loop::now(), config_.settle, !is_text);
    wake();
  }
  if (&port == uplink()) {
    reader_.on_interrupted();
    lines_.on_interrupted();
  }
}

void KilobotLink::on_port_bytes(ReconnectingPort& port, std::span<const std::uint8_t> bytes) {
  if (&port == downlink_.get()) controller_reader_.put(bytes);  // the stock one never says anything
  if (&port != uplink()) return;
  if (config_.uplink_form == UplinkForm::kText) return lines_.put(bytes);
  reader_.put(bytes);
  const std::uint64_t unreadable = reader_.counters().unreadable_frames - unreadable_told_;
  const auto now = loop::now();
  if (unreadable == 0 || now - unreadable_told_at_ < kUnreadablePeriod) return;
  unreadable_told_ += unreadable;
  unreadable_told_at_ = now;
  drivers::link_log()->warn(
      "kilobot '{}': {} unreadable frames; is this a gateway of ours at {} baud, or a text uplink?",
      port.path(), unreadable, config_.pacing.baud);
}

void KilobotLink::on_port_lost(ReconnectingPort& port) {
  ++counters_.link_down_events;
  if (&port == uplink()) gateway_.reset();
  if (&port != downlink_.get()) return;
  timer_.cancel();
  sender_.close();
  end_sequence(SequenceEnd::kFailed,
               "the serial device '" + port.path() + "' is lost: " + port.problem());
}

void KilobotLink::on_reception(const GatewayReception& reception) {
  const IrForm form = form_of(config_.profile);
  heard_at_ = loop::now();
  ++counters_.frames_received;
  const bool is_from_robot = form.heard_type == kilobot::kIrSwarmtalk
                                 ? kilobot::is_swarmtalk(reception.ir_type)
                                 : reception.ir_type == form.heard_type;
  if (!is_from_robot && reception.ir_type != form.sent_type) {
    ++messages_of_programs_;
    return;
  }
  const auto packet = std::span<const std::uint8_t>(reception.data).first(form.packet_bytes);
  if (reception.ir_type == form.sent_type && sent_.contains(packet)) {
    ++counters_.own_echoes;
    return;
  }
  ++counters_.packets_received;
  drivers::FrameReception frame;
  frame.received_at = heard_at_;
  // The light of an overhead controller tells no distance.
  if (is_from_robot && reception.distance_mm) frame.distance_m = *reception.distance_mm / 1000.0f;
  user_->on_packet(packet, frame);
}

void KilobotLink::on_hello(const GatewayHello& hello) {
  heard_at_ = loop::now();
  gateway_ = hello;
}

void KilobotLink::on_text(std::string_view text) {
  heard_at_ = loop::now();
  ++texts_;
  if (on_line_) on_line_(to_utf8(std::string(text)));
}

std::string KilobotLink::downlink_state() const {
  if (!downlink_) return "nothing is sent: no downlink is configured";
  std::string device = "overhead controller at " + downlink_->path();
  if (!downlink_->is_open()) return "no " + device + ": " + downlink_->problem();
  if (!sender_.is_ready()) return device + " is given time to start";
  if (controller_.version && controller_.version->product == kProductOverhead) {
    device += " (version " + std::to_string(controller_.version->version) + ")";
  }
  if (!player_) return device;
  std::string text = device + " sends '" + player_->sequence().name + "'";
  const Sequence& sequence = player_->sequence();
  if (!sequence.is_program && player_->frames() == 0) return text + " until it is stopped";
  if (sequence.is_program && player_->pass() > 0) {
    text += ", pass " + std::to_string(player_->pass());
    if (sequence.passes > 0) text += " of " + std::to_string(sequence.passes);
  }
  return text + ", " + seconds_text(left()) + " left";
}

std::string KilobotLink::uplink_state() const {
  if (config_.uplink.empty()) return "nothing is heard: no uplink is configured";
  const std::string device = "gateway at " + config_.uplink;
  if (!uplink()->is_open()) return "no " + device + ": " + uplink()->problem();
  const bool is_recent =
      heard_at_ != drivers::MonotonicTime{} && loop::now() - heard_at_ < kGatewaySilence;
  if (config_.uplink_form == UplinkForm::kText) return "text at " + config_.uplink;
  if (!is_recent) return device + " is silent";
  if (!gateway_) return device;
  return device + " has uid " + std::to_string(gateway_->uid) + ", version " +
         std::to_string(gateway_->version) + ", battery " + std::to_string(gateway_->battery) +
         " (" + battery_colour(gateway_->battery) + ")";
}

std::string KilobotLink::state() const {
  std::string text = (is_up() ? "up: " : "") + downlink_state() + "; " + uplink_state();
  for (const ReconnectingPort* const port : {downlink_.get(), uplink_.get()}) {
    if (port == nullptr || !port->is_open()) continue;
    const std::string others = port->others();
    if (others.empty()) continue;
    text += "; " + port->path() + " is also open in " + others + ", which takes bytes away: end it";
  }
  return text;
}

drivers::Counters KilobotLink::counters() const {
  drivers::LinkCounters common = counters_;
  const OverheadSender::Counters& sent = sender_.counters();
  common.frames_sent = sent.frames;
  common.bytes_sent = sent.bytes;
  const GatewayReader::Counters& heard = reader_.counters();
  common.bytes_received = heard.bytes + lines_.counters().bytes;
  drivers::Counters list = common.list();
  const drivers::Counters own = {
      {"overhead_padding_bytes", sent.padding_bytes},
      {"overhead_frames_withheld", sent.withheld_frames},
      {"gateway_frames", heard.frames},
      {"gateway_frames_unreadable", heard.unreadable_frames},
      {"gateway_frames_missing", heard.missing_frames},
      {"gateway_reports_dropped", heard.gateway_drops},
      {"gateway_restarts", heard.gateway_restarts},
      {"gateway_other_messages", messages_of_programs_},
      {"uplink_texts", texts_},
      {"uplink_lines_cut", lines_.counters().cut_lines},
  };
  list.insert(list.end(), own.begin(), own.end());
  return list;
}

}  // namespace swarmtalk::kilobot_bridge
