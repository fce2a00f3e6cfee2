#include "emulation/ohc_double/ohc_double.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::ohc_double {

void OhcDouble::put(std::uint8_t byte, std::uint64_t time_ns) {
  advance(time_ns);
  if (phase_ != Phase::kDeaf) return hear(byte, time_ns);
  if (kept_bytes_.size() < kDeafBytes)
    kept_bytes_.push_back(byte);
  else
    ++counters_.lost_bytes;
}

void OhcDouble::hear(std::uint8_t byte, std::uint64_t time_ns) {
  if (is_on_air_ && time_ns >= current_.start_ns) current_.is_damaged = true;
  const auto found = finder_.put(byte);
  if (!found) return;
  ++counters_.frames;
  if (found->is_false) {
    ++counters_.false_frames;
    const std::uint8_t type = found->frame[1];
    counters_.dangerous_frames += type >= 1 && type <= 6 ? 1 : 0;
  }
  if (on_frame) on_frame(time_ns, *found);
  if (waiting_) ++counters_.replaced_frames;
  waiting_ = found->frame;
  if (phase_ == Phase::kIdle) act(time_ns);
}

void OhcDouble::advance(std::uint64_t time_ns) {
  while (step(time_ns)) {
  }
}

/// The next thing that happens by itself, if it is due.
bool OhcDouble::step(std::uint64_t time_ns) {
  if (phase_ == Phase::kIdle) return false;
  if (phase_ == Phase::kSending) {
    if (is_on_air_) {
      if (current_.start_ns + kMessageNs > time_ns) return false;
      end_message();
      return true;
    }
    const std::uint64_t pass_end_ns = pass_start_ns_ + kPassNs;
    if (pass_end_ns > time_ns) return false;
    is_led_on_ = false;
    if (waiting_)
      act(pass_end_ns);
    else if (repeats_)
      start_pass(pass_end_ns);
    else
      phase_ = Phase::kIdle;
    return true;
  }
  if (busy_until_ns_ > time_ns) return false;
  const std::uint64_t now_ns = busy_until_ns_;
  if (phase_ == Phase::kDeaf) {
    phase_ = Phase::kBusy;
    busy_until_ns_ = now_ns + kAfterglowNs;
    for (const std::uint8_t byte : std::exchange(kept_bytes_, {})) hear(byte, now_ns);
    return true;
  }
  phase_ = Phase::kIdle;
  is_led_on_ = false;
  if (waiting_) act(now_ns);
  return true;
}

void OhcDouble::act(std::uint64_t time_ns) {
  const Frame frame = *waiting_;
  waiting_.reset();
  phase_ = Phase::kIdle;
  const auto type = static_cast<FrameType>(frame[1]);
  switch (type) {
    case FrameType::kLedToggle:
      // A flag of its own: what was sent since has put the LED out, not the flag.
      is_led_wanted_ = !is_led_wanted_;
      is_led_on_ = is_led_wanted_;
      break;
    case FrameType::kForward:
    case FrameType::kSingle:
      current_.message = emulator::make_ir_message(std::span(frame).subspan(2, 9), frame[11]);
      break;
    case FrameType::kForwardRaw:
      std::copy_n(frame.begin() + 2, current_.message.size(), current_.message.begin());
      break;
    case FrameType::kBootPage:
      return send_page(time_ns, frame);
    case FrameType::kGps:
      return send_positions(time_ns, frame);
    case FrameType::kStop:
    default:
      break;  // a type that it does not know ends repeating, too
  }
  if (type == FrameType::kForward || type == FrameType::kForwardRaw || type == FrameType::kSingle) {
    repeats_ = type != FrameType::kSingle;
    phase_ = Phase::kSending;
    start_pass(time_ns + kStartNs);
  }
}

void OhcDouble::start_pass(std::uint64_t time_ns) {
  pass_start_ns_ = time_ns;
  current_.start_ns = time_ns;
  current_.is_damaged = false;
  is_on_air_ = true;
}

void OhcDouble::end_message() {
  is_on_air_ = false;
  is_led_on_ = true;
  report(current_);
}

void OhcDouble::send_page(std::uint64_t time_ns, const Frame& frame) {
  // Six bytes of the page at a time; the last message runs over its end into the frame's checksum
  // and on into other memory, zero here.
  constexpr unsigned kBytesEach = 6;
  std::array<std::uint8_t, kPageMessages * kBytesEach> page{};
  std::copy(frame.begin() + 3, frame.end(), page.begin());
  for (unsigned i = 0; i < kPageMessages; ++i) {
    std::array<std::uint8_t, emulator::kIrPayloadBytes> data{};
    data[0] = frame[2];
    data[1] = static_cast<std::uint8_t>(i * kBytesEach / 2);  // in words
    std::copy_n(page.begin() + i * kBytesEach, kBytesEach, data.begin() + 2);
    report({time_ns + kStartNs + i * kPageMessageNs, emulator::make_ir_message(data, kIrBootPage),
            false});
  }
  phase_ = Phase::kDeaf;
  busy_until_ns_ = time_ns + kStartNs + kPageDeafNs;
}

void OhcDouble::send_positions(std::uint64_t time_ns, const Frame& frame) {
  constexpr std::uint8_t kIrGps = 1;
  unsigned count = 0;
  for (; count < kGpsRecords; ++count) {
    const auto record = std::span(frame).subspan(2 + count * kGpsRecordBytes, kGpsRecordBytes);
    if (std::all_of(record.begin(), record.end(), [](std::uint8_t b) { return b == 0; })) break;
    report({time_ns + kStartNs + count * kGpsMessageNs, emulator::make_ir_message(record, kIrGps),
            false});
  }
  phase_ = Phase::kDeaf;
  busy_until_ns_ = time_ns + kStartNs + count * kGpsMessageNs;
}

void OhcDouble::report(const Transmission& transmission) {
  ++(transmission.is_damaged ? counters_.damaged : counters_.good);
  if (on_transmission) on_transmission(transmission);
}

}  // namespace swarmtalk::ohc_double
