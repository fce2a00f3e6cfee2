#include "emulation/ohc_double/kilobot_double.hpp"

#include <algorithm>

#include "kilobot_wire/ohc_frame.hpp"

namespace swarmtalk::ohc_double {

using emulator::IrMessage;

namespace {

constexpr unsigned kBytesPerMessage = 6;

enum CalibrationMode : std::uint8_t {
  kSave = 0,
  kSetUid = 1,
  kTurnLeft = 2,
  kTurnRight = 3,
  kStraight = 4
};

}  // namespace

KilobotDouble::KilobotDouble(std::uint16_t uid, double loss, std::uint64_t seed)
    : loss_(loss), chance_(seed, uid) {
  eeprom_.uid = uid;
  values_ = eeprom_;
}

void KilobotDouble::hear(const IrMessage& message, std::uint64_t time_ns) {
  if (chance_.happens(loss_) || !emulator::has_good_crc(message)) return;
  if (state_ == State::kBootloader) return hear_in_bootloader(message);
  if (state_ == State::kSleeping && !is_listening(time_ns)) return;
  hear_in_program(message, time_ns);
}

/// Asleep it listens for 10 ms every 8 s; any light in that time makes it listen 100 ms more.
bool KilobotDouble::is_listening(std::uint64_t time_ns) {
  if (time_ns < awake_until_ns_) return true;
  const std::uint64_t in_period_ns = (time_ns - asleep_since_ns_) % kSleepPeriodNs;
  const bool had_a_period = time_ns - asleep_since_ns_ >= kSleepPeriodNs;
  if (had_a_period && in_period_ns < kListenNs) awake_until_ns_ = time_ns + kListenMoreNs;
  return false;  // this message has only woken it
}

void KilobotDouble::restart() {
  state_ = State::kIdle;
  values_ = eeprom_;
  motors_ = {};
  has_motors_enabled_ = false;
  led_ = "green blinking";
  setups_ = 0;
  ++starts_;
}

void KilobotDouble::hear_in_program(const IrMessage& message, std::uint64_t time_ns) {
  const std::uint8_t type = message[9];
  if (type < kIrBoot) {
    if (on_user_message) on_user_message(message);
    return;
  }
  if (type != kIrRun && type != kIrReadUid && type != kIrCalibrate) {
    has_motors_enabled_ = false;
    motors_ = {};
  }
  switch (type) {
    case kIrBoot:
      enter_bootloader();
      break;
    case kIrReset:
      restart();
      break;
    case kIrSleep:
      state_ = State::kSleeping;
      led_ = "off";
      asleep_since_ns_ = time_ns;
      awake_until_ns_ = 0;
      break;
    case kIrWakeUp:
      state_ = State::kIdle;
      led_ = "green blinking";
      break;
    case kIrCharge:
      state_ = State::kCharging;
      led_ = "off";
      break;
    case kIrVoltage:
      state_ = State::kBattery;
      led_ = "green";
      break;
    case kIrRun:
      if (state_ == State::kRunning) break;
      has_motors_enabled_ = true;
      motors_ = {};
      setups_ = 1;  // only the first time since the reset
      state_ = State::kRunning;
      led_ = "program";
      break;
    case kIrReadUid: {
      const bool is_set = message[0] < 16 && ((values_.uid >> message[0]) & 1) != 0;
      state_ = State::kMoving;
      motors_ = is_set ? Motors{values_.turn_left, 0} : Motors{};
      break;
    }
    case kIrCalibrate:
      calibrate(message);
      break;
    default:
      break;  // only the motors are off
  }
}

void KilobotDouble::calibrate(const IrMessage& message) {
  const std::uint8_t mode = message[0];
  if (mode == kSave) {
    if (state_ != State::kMoving) return;
    eeprom_ = values_;
    motors_ = {};
    has_motors_enabled_ = false;
    state_ = State::kIdle;
    led_ = "green blinking";
    return;
  }
  if (mode > kStraight) return;
  state_ = State::kMoving;
  switch (mode) {
    case kSetUid:
      values_.uid = static_cast<std::uint16_t>(message[1] + message[2] * 256);
      motors_ = {};
      break;
    case kTurnLeft:
      values_.turn_left = message[3];
      motors_ = {message[3], 0};
      break;
    case kTurnRight:
      values_.turn_right = message[4];
      motors_ = {0, message[4]};
      break;
    default:
      values_.straight_left = message[5];
      values_.straight_right = message[6];
      motors_ = {message[5], message[6]};
      break;
  }
}

void KilobotDouble::enter_bootloader() {
  state_ = State::kBootloader;
  motors_ = {};
  has_motors_enabled_ = false;
  led_ = "blue flashing";
  is_done_.reset();
  total_ = kProgramPages;
  done_ = 0;
  page_ = 0;
  byte_count_ = 0;
  page_buffer_.fill(0xFF);
}

void KilobotDouble::hear_in_bootloader(const IrMessage& message) {
  switch (message[9]) {
    case kIrBootPage:
      take_page_message(message);
      break;
    case kIrBootSize:
      total_ = message[0];
      if (done_ == total_) restart();
      break;
    case kIrBoot:
      enter_bootloader();
      break;
    default:
      if (done_ == 0) restart();
      break;
  }
}

void KilobotDouble::take_page_message(const IrMessage& message) {
  if (message[0] != page_) {
    page_ = message[0];
    byte_count_ = 0;
    page_buffer_.fill(0xFF);
  }
  const std::size_t offset = message[1] * std::size_t{2};
  if (offset + kBytesPerMessage <= page_buffer_.size())
    std::copy_n(message.begin() + 2, kBytesPerMessage,
                page_buffer_.begin() + static_cast<std::ptrdiff_t>(offset));
  // It counts messages, not offsets: one that is heard twice hides one that is missing.
  byte_count_ += kBytesPerMessage;
  led_ = "blue dim";
  if (byte_count_ < kPageBytes || is_done_[page_]) return;
  if (page_ >= kBootloaderPage) has_damaged_bootloader_ = true;  // the standard one does not look
  std::copy_n(page_buffer_.begin(), kPageBytes,
              flash_.begin() + static_cast<std::ptrdiff_t>(page_ * kPageBytes));
  is_done_.set(page_);
  ++done_;
  led_ = "green";
  if (done_ == total_) restart();
}

std::string_view to_text(KilobotDouble::State state) {
  using State = KilobotDouble::State;
  switch (state) {
    case State::kSleeping:
      return "sleeping";
    case State::kIdle:
      return "idle";
    case State::kBattery:
      return "battery";
    case State::kRunning:
      return "running";
    case State::kCharging:
      return "charging";
    case State::kMoving:
      return "moving";
    case State::kBootloader:
      return "bootloader";
  }
  return "?";
}

}  // namespace swarmtalk::ohc_double
