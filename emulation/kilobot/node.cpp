#include "emulation/kilobot/node.hpp"

#include <algorithm>
#include <cmath>

#include "emulation/kilobot/atmega328p.hpp"
#include "hex/digits.hpp"

namespace swarmtalk::emulator {
namespace {

constexpr std::size_t kSerialLineBytes = 256;  // longest piece of serial output in one log line
constexpr std::size_t kTerminalReadAhead = 4;
constexpr double kReportedStepMm = 1, kReportedTurnRad = 0.05;

bool is_text(std::span<const std::uint8_t> bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t c) {
    return (c >= 0x20 && c < 0x7F) || c == '\r' || c == '\n' || c == '\t';
  });
}

Eeprom starting_eeprom(const NodeSpec& spec, const Image& image) {
  if (!spec.eeprom.empty()) return load_eeprom(spec.eeprom);
  if (image.eeprom) return *image.eeprom;
  Calibration calibration;
  calibration.uid = spec.uid.value_or(0);
  return make_eeprom(calibration);
}

McuSettings settings_of(const Scenario& scenario, const NodeSpec& spec, unsigned number) {
  McuSettings settings;
  settings.clock_hz = spec.clock_hz;
  settings.resets_to_bootloader = spec.resets_to_bootloader;
  settings.infrared_led = spec.infrared_led;
  settings.analog.noise_counts = scenario.noise_counts;
  settings.analog.seed = Random(scenario.seed, 1000 + number).next();
  return settings;
}

std::uint64_t ms_to_ns(double milliseconds) {
  return static_cast<std::uint64_t>(std::llround(milliseconds * 1e6));
}

}  // namespace

Node::Node(const Context& context, const NodeSpec& spec, const OhcSpec* ohc,
           std::shared_ptr<const Image> image, unsigned number)
    : context_(context),
      spec_(spec),
      image_(std::move(image)),
      clock_(ms_to_ns(spec.power_on_ms.value_or(0)), spec.clock_hz, spec.drift_ppm.value_or(0)),
      mcu_(*image_, starting_eeprom(spec, *image_), settings_of(context.scenario, spec, number)),
      byte_ns_(static_cast<std::uint64_t>(10e9 / context.scenario.baud)),
      pose_{spec.x_mm, spec.y_mm, spec.theta_rad},
      reported_pose_(pose_),
      motor_chance_(context.scenario.seed, 2000 + number),
      motor_bias_{1 + context.scenario.motor_bias * motor_chance_.normal(),
                  1 + context.scenario.motor_bias * motor_chance_.normal()} {
  if (ohc != nullptr) ohc_ = *ohc;
  // An overhead controller has no receiver.
  station_ = context_.medium.add_station({spec.x_mm, spec.y_mm, ohc != nullptr ? ohc->reach_mm : 0},
                                         ohc != nullptr ? nullptr : this);
  if (spec.has_pty) terminal_ = std::make_unique<Pty>(spec.serial_pty);
  find_watched(context_.scenario.watch);
  mcu_.on_infrared = [this](std::uint64_t cycle, bool is_on) {
    context_.medium.switch_light(station_, clock_.time_of_ns(cycle), is_on);
  };
  mcu_.on_serial_byte = [this](std::uint8_t byte) { take_serial_output(byte); };
  if (context_.scenario.logs_heard && ohc == nullptr)
    mcu_.on_comparator_rise = [this](std::uint64_t cycle) {
      const std::uint64_t time_ns = clock_.time_of_ns(cycle);
      if (heard_.on_pulse(time_ns) != FrameDecoder::Event::kMessage) return;
      const IrMessage& message = heard_.message();
      context_.log.write(time_ns, spec_.name, "heard",
                         {{"type", message[9]},
                          {"data", hex::to_hex(std::span(message).first(kIrPayloadBytes))},
                          {"crc_ok", has_good_crc(message)}});
    };
}

void Node::run_until(std::uint64_t time_ns) {
  while (!serial_in_.empty() && next_byte_ns_ < time_ns) {
    mcu_.run_until(clock_.cycle_at(next_byte_ns_));
    mcu_.push_serial_byte(serial_in_.front());
    serial_in_.pop_front();
    next_byte_ns_ += byte_ns_;
  }
  mcu_.run_until(clock_.cycle_at(time_ns));
}

void Node::on_light(std::uint64_t time_ns, SignalStrength strength, bool is_rising) {
  if (time_ns <= clock_.power_on_ns()) return;
  mcu_.push_light({clock_.cycle_at(time_ns), strength, is_rising});
}

void Node::poll_terminal(std::uint64_t time_ns) {
  // As slowly as the line takes them, so that a host that writes too fast has to wait.
  if (terminal_ == nullptr || serial_in_.size() >= kTerminalReadAhead) return;
  std::vector<std::uint8_t> bytes;
  if (terminal_->read_into(bytes, kTerminalReadAhead - serial_in_.size()) > 0)
    queue_serial(bytes, time_ns);
}

void Node::poll_terminal(std::uint64_t time_ns, std::uint64_t wall_ns) {
  if (terminal_ == nullptr) return;
  if (terminal_reader_ == nullptr) {
    const double wall_byte_ns = static_cast<double>(byte_ns_) / context_.scenario.real_time_factor;
    terminal_reader_ =
        std::make_unique<TerminalReader>(*terminal_, static_cast<std::uint64_t>(wall_byte_ns));
  }
  while (const auto byte = terminal_reader_->take(wall_ns)) queue_serial({byte->byte}, time_ns);
}

void Node::queue_serial(const std::vector<std::uint8_t>& bytes, std::uint64_t time_ns) {
  if (serial_in_.empty()) next_byte_ns_ = std::max(next_byte_ns_, time_ns);
  serial_in_.insert(serial_in_.end(), bytes.begin(), bytes.end());
}

void Node::take_serial_output(std::uint8_t byte) {
  const std::uint64_t time_ns = clock_.time_of_ns(mcu_.cycle());
  if (terminal_ != nullptr) terminal_->write(std::span(&byte, 1));
  serial_out_.push_back(byte);
  serial_out_ns_ = time_ns;
  // A line of text, a frame that ends with zero, or enough of whatever it is.
  const bool is_line = byte == '\n' && serial_out_.size() > 1 && is_text(serial_out_);
  if (is_line || byte == 0 || serial_out_.size() >= kSerialLineBytes) log_serial_output(time_ns);
}

void Node::log_serial_output(std::uint64_t time_ns) {
  if (serial_out_.empty()) return;
  EventLog::Fields fields{{"hex", hex::to_hex(serial_out_)}};
  if (is_text(serial_out_)) {
    std::string text(serial_out_.begin(), serial_out_.end());
    while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
    fields["text"] = text;
  }
  context_.log.write(time_ns, spec_.name, "serial", fields);
  serial_out_.clear();
}

void Node::find_watched(const std::vector<std::string>& watch) {
  for (const std::string& text : watch) {
    const WatchSpec spec = parse_watch(text);
    const auto symbol = image_->symbols.find(spec.symbol);
    if (symbol == image_->symbols.end()) continue;  // other images may have it
    const int start = spec.is_from_end ? symbol->second.size_bytes - spec.offset : spec.offset;
    Watched watched;
    watched.name = text;
    watched.address = static_cast<std::uint16_t>(symbol->second.address + start);
    watched.size_bytes = spec.size_bytes;
    if (watched.size_bytes == 0)
      watched.size_bytes = std::clamp<unsigned>(symbol->second.size_bytes, 1, 8);
    watched_.push_back(watched);
  }
}

void Node::sample(std::uint64_t time_ns) {
  if (mcu_.cycle() == 0) return;  // not switched on yet
  if (!is_ohc()) sample_body(time_ns);
  sample_watched(time_ns);
  if (ohc_) {
    const std::uint16_t port = ohc_->status_led.port == 'B'   ? atmega328p::kPortB
                               : ohc_->status_led.port == 'C' ? atmega328p::kPortC
                                                              : atmega328p::kPortD;
    const bool is_on = ((mcu_.data(port) >> ohc_->status_led.bit) & 1) != 0;
    if (status_led_ != is_on) context_.log.write(time_ns, spec_.name, "status", {{"on", is_on}});
    status_led_ = is_on;
  }
  // Output that ends without a line end is logged once the line has been silent for a while.
  if (!serial_out_.empty() && time_ns > serial_out_ns_ + 20 * byte_ns_) log_serial_output(time_ns);
  if (mcu_.resets() != resets_) {
    resets_ = mcu_.resets();
    context_.log.write(time_ns, spec_.name, "reset", {{"count", resets_}});
  }
  if (mcu_.pages_written() != pages_) {
    pages_ = mcu_.pages_written();
    context_.log.write(time_ns, spec_.name, "flash", {{"pages_written", pages_}});
  }
  if (mcu_.is_dead() && !was_dead_) {
    was_dead_ = true;
    context_.log.write(time_ns, spec_.name, "crash", {{"reason", mcu_.crash()}});
  }
}

const MotorGain& Node::motor_gain(std::uint64_t time_ns) {
  if (time_ns >= gain_until_ns_) {
    const double noise = context_.scenario.motor_noise;
    motor_gain_ = {motor_bias_.left * (1 + noise * motor_chance_.normal()),
                   motor_bias_.right * (1 + noise * motor_chance_.normal())};
    gain_until_ns_ = time_ns + ms_to_ns(kMotorNoiseMs);
  }
  return motor_gain_;
}

void Node::sample_body(std::uint64_t time_ns) {
  const LedColour led = read_led(mcu_);
  if (led_ != led)
    context_.log.write(time_ns, spec_.name, "led",
                       {{"red", led.red}, {"green", led.green}, {"blue", led.blue}});
  led_ = led;
  const MotorDuty motors = read_motors(mcu_);
  if (motors_ != motors)
    context_.log.write(time_ns, spec_.name, "motors",
                       {{"left", motors.left}, {"right", motors.right}});
  if (motors_ && *motors_ != MotorDuty{}) {
    pose_ =
        move(pose_, *motors_, static_cast<double>(time_ns - moved_ns_) * 1e-9, motor_gain(time_ns));
    const bool has_moved = std::hypot(pose_.x_mm - reported_pose_.x_mm,
                                      pose_.y_mm - reported_pose_.y_mm) >= kReportedStepMm;
    if (has_moved) context_.medium.move(station_, pose_.x_mm, pose_.y_mm);
    if (has_moved || std::abs(pose_.theta_rad - reported_pose_.theta_rad) >= kReportedTurnRad) {
      reported_pose_ = pose_;
      const auto rounded = [](double value) { return std::round(value * 1000) / 1000; };
      context_.log.write(time_ns, spec_.name, "pose",
                         {{"x_mm", rounded(pose_.x_mm)},
                          {"y_mm", rounded(pose_.y_mm)},
                          {"theta_rad", rounded(pose_.theta_rad)}});
    }
  }
  motors_ = motors;
  moved_ns_ = time_ns;
}

void Node::sample_watched(std::uint64_t time_ns) {
  for (Watched& watched : watched_) {
    std::uint64_t value = 0;
    for (unsigned i = watched.size_bytes; i-- > 0;)
      value = value << 8 | mcu_.data(static_cast<std::uint16_t>(watched.address + i));
    if (watched.value != value)
      context_.log.write(time_ns, spec_.name, "variable",
                         {{"name", watched.name}, {"value", value}});
    watched.value = value;
  }
}

void Node::finish(std::uint64_t time_ns) {
  log_serial_output(time_ns);
  const SenderCounters& sent = context_.medium.counters(station_);
  EventLog::Fields fields{{"frames_sent", sent.frames},
                          {"frames_started", sent.started},
                          {"frames_lost", sent.lost},
                          {"late_edges", mcu_.late_edges()},
                          {"serial_bytes_lost", mcu_.serial_bytes_lost()},
                          {"resets", mcu_.resets()}};
  EventLog::Fields handlers = EventLog::Fields::object();
  for (std::size_t vector = 0; vector < Mcu::kVectors; ++vector)
    if (mcu_.longest_handler_cycles(vector) > 0)
      handlers[std::to_string(vector)] = mcu_.longest_handler_cycles(vector);
  fields["longest_handler_cycles"] = handlers;
  if (const auto free_bytes = mcu_.stack_free_bytes()) fields["stack_free_bytes"] = *free_bytes;
  context_.log.write(time_ns, spec_.name, "end", fields);
  if (!spec_.save_eeprom.empty()) save_eeprom(spec_.save_eeprom, mcu_.eeprom());
}

}  // namespace swarmtalk::emulator
