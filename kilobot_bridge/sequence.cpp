#include "kilobot_bridge/sequence.hpp"

#include <algorithm>

namespace swarmtalk::kilobot_bridge {
namespace {

using std::chrono::milliseconds;

constexpr Duration kCommandHold = milliseconds(1000);
constexpr Duration kVoltageHold = milliseconds(500);
constexpr Duration kCalibrationHold = milliseconds(500);
constexpr Duration kReadUidHold = milliseconds(2000);    // an operator looks
constexpr Duration kSleeperHold = milliseconds(12'000);  // robots listen every 8 s, +-10 %
constexpr Duration kBootHold = milliseconds(2000);
constexpr Duration kBootRest = milliseconds(50);
constexpr Duration kHoldSlice = milliseconds(1000);

constexpr std::uint8_t kCalibrationSave = 0;
constexpr std::uint8_t kCalibrationUid = 1;

TimedFrame stop() {
  return {stop_frame(), Duration(0)};
}

TimedFrame message(std::uint8_t ir_type, Duration hold, const IrData& data = {}) {
  return {forward_frame(ir_type, data), hold};
}

// Calibration data: mode, uid (little-endian), left turn, right turn, straight left, straight
// right.
TimedFrame calibration(std::uint8_t mode, const IrData& values = {}) {
  IrData data = values;
  data[0] = mode;
  return message(kilobot::kIrCalibrate, kCalibrationHold, data);
}

Sequence then_stop(std::string name, std::vector<TimedFrame> frames) {
  Sequence sequence;
  sequence.name = std::move(name);
  sequence.before = std::move(frames);
  sequence.after = {stop()};
  return sequence;
}

}  // namespace

Sequence command_sequence(Command command) {
  switch (command) {
    case Command::kRun:
      return then_stop("run", {message(kilobot::kIrRun, kCommandHold)});
    case Command::kPause:
      return then_stop("pause", {message(kilobot::kIrWakeup, kCommandHold)});
    case Command::kReset:
      return then_stop("reset", {message(kilobot::kIrReset, kCommandHold)});
    case Command::kSleep:
      return then_stop("sleep", {message(kilobot::kIrSleep, kCommandHold)});
    case Command::kWakeup:
      return then_stop("wakeup", {message(kilobot::kIrWakeup, kSleeperHold)});
    case Command::kCharge:
      return then_stop("charge", {message(kilobot::kIrCharge, kCommandHold)});
    case Command::kVoltage:
      break;
  }
  return then_stop("voltage", {message(kilobot::kIrVoltage, kVoltageHold)});
}

Sequence bootload_sequence(bool may_sleep) {
  return then_stop("bootload",
                   {message(kilobot::kIrWakeup, may_sleep ? kSleeperHold : kCommandHold),
                    message(kilobot::kIrBoot, kBootHold)});
}

Sequence held(Sequence sequence, Duration hold) {
  const auto slices = static_cast<std::uint32_t>((hold + kHoldSlice - Duration(1)) / kHoldSlice);
  auto& frames = sequence.before;
  // What comes before a message, as WAKEUP before BOOT, is said once; positions are said anew.
  const auto first = is_repeated(frames.back().frame) ? frames.end() - 1 : frames.begin();
  sequence.repeated.assign(first, frames.end());
  frames.erase(first, frames.end());
  sequence.repeated.back().hold = slices == 0 ? kHoldSlice : hold / slices;
  sequence.passes = slices;
  return sequence;
}

Sequence stop_sequence() {
  return then_stop("stop", {});
}

Sequence led_sequence() {
  Sequence sequence;
  sequence.name = "led";
  sequence.before = {{led_toggle_frame(), Duration(0)}};
  return sequence;
}

Sequence set_uid_sequence(std::uint16_t uid) {
  const IrData data{0, static_cast<std::uint8_t>(uid), static_cast<std::uint8_t>(uid >> 8)};
  return then_stop("set-uid", {calibration(kCalibrationUid, data), calibration(kCalibrationSave)});
}

Sequence read_uid_sequence(std::span<const std::uint8_t> bits, bool ends_with_wakeup) {
  Sequence sequence = then_stop("read-uid", {});
  for (const std::uint8_t bit : bits) {
    sequence.before.push_back(message(kilobot::kIrReadUid, kReadUidHold, {bit}));
  }
  if (!ends_with_wakeup) return sequence;
  // Also when it is stopped: the robots would go on turning.
  sequence.after = {message(kilobot::kIrWakeup, kCommandHold), stop()};
  return sequence;
}

Sequence calibrate_sequence(Calibration mode, std::uint8_t left, std::uint8_t right, bool saves,
                            bool stops) {
  IrData data{};
  if (mode == Calibration::kTurnLeft) data[3] = left;
  if (mode == Calibration::kTurnRight) data[4] = right;
  if (mode == Calibration::kStraight) data[5] = left, data[6] = right;
  Sequence sequence = then_stop("calibrate", {calibration(static_cast<std::uint8_t>(mode), data)});
  if (saves) sequence.before.push_back(calibration(kCalibrationSave));
  if (stops) sequence.before.push_back(message(kilobot::kIrWakeup, kCommandHold));
  return sequence;
}

Sequence message_sequence(std::uint8_t ir_type, const IrData& data, bool is_single) {
  Sequence sequence;
  sequence.name = "send";
  if (is_single) {
    sequence.before = {{forward_single_frame(ir_type, data), Duration(0)}};
    return sequence;
  }
  return then_stop("send", {message(ir_type, Duration(0), data)});
}

Sequence raw_message_sequence(std::uint8_t ir_type, const IrData& data, std::uint16_t checksum) {
  return then_stop("send", {{forward_raw_frame(ir_type, data, checksum), Duration(0)}});
}

Sequence position_sequence(std::span<const GpsRecord> records) {
  Sequence sequence = then_stop("position", {});
  for (; !records.empty();
       records = records.subspan(std::min<std::size_t>(records.size(), kGpsRecords))) {
    sequence.before.push_back({gps_frame(records), Duration(0)});
  }
  return sequence;
}

std::size_t program_pages(std::size_t image_bytes) {
  return std::max(kLeastPages, (image_bytes + kProgramPageBytes - 1) / kProgramPageBytes);
}

Sequence program_sequence(std::span<const std::uint8_t> image, std::uint32_t passes,
                          bool may_sleep) {
  Sequence sequence =
      then_stop("program", {message(kilobot::kIrWakeup, may_sleep ? kSleeperHold : kCommandHold),
                            message(kilobot::kIrBoot, kBootHold),
                            {stop_frame(), kBootRest}});
  sequence.is_program = true;
  sequence.passes = passes;
  const std::size_t pages = program_pages(image.size());
  const Pacing pacing;
  sequence.repeated.push_back(
      message(kilobot::kIrPages, pacing.silences.page, {static_cast<std::uint8_t>(pages)}));
  for (std::size_t page = 0; page < pages; ++page) {
    ProgramPage bytes;
    bytes.fill(0xFF);
    const std::size_t begin = std::min(page * kProgramPageBytes, image.size());
    const auto part =
        image.subspan(begin, std::min<std::size_t>(kProgramPageBytes, image.size() - begin));
    std::copy(part.begin(), part.end(), bytes.begin());
    sequence.repeated.push_back({page_frame(static_cast<std::uint8_t>(page), bytes), Duration(0)});
  }
  return sequence;
}

Player::Player(Sequence sequence, const Pacing& pacing)
    : sequence_(std::move(sequence)), pacing_(pacing) {
  const std::size_t around = sequence_.before.size() + sequence_.after.size();
  const bool is_endless = !sequence_.repeated.empty() && sequence_.passes == 0;
  if (!is_endless) {
    frames_ = static_cast<std::uint32_t>(around + sequence_.repeated.size() * sequence_.passes);
  }
  left_ = time_of(sequence_.before) + time_of(sequence_.after) +
          time_of(sequence_.repeated) * std::max<std::uint32_t>(sequence_.passes, 1);
}

std::optional<TimedFrame> Player::next() {
  while (part_ != Part::kEnd && next_ == frames_of(part_).size()) enter_next_part();
  if (part_ == Part::kEnd) return std::nullopt;
  if (part_ == Part::kRepeated && next_ == 0) {
    ++pass_;
    if (sequence_.passes == 0) left_ = time_of(sequence_.repeated);
  }
  const TimedFrame& frame = frames_of(part_)[next_];
  index_ = static_cast<std::uint32_t>(next_++);
  ++frames_sent_;
  left_ = std::max(Duration(0), left_ - time_of({frame}));
  return frame;
}

void Player::stop() {
  if (part_ == Part::kAfter || part_ == Part::kEnd) return;
  is_stopped_ = true;
  part_ = Part::kAfter;
  next_ = 0;
  left_ = time_of(sequence_.after);
}

void Player::enter_next_part() {
  next_ = 0;
  if (part_ == Part::kBefore) {
    part_ = sequence_.repeated.empty() ? Part::kAfter : Part::kRepeated;
  } else if (part_ == Part::kRepeated) {
    ++passes_sent_;
    if (passes_sent_ == sequence_.passes) part_ = Part::kAfter;
  } else {
    part_ = Part::kEnd;
  }
}

const std::vector<TimedFrame>& Player::frames_of(Part part) const {
  if (part == Part::kBefore) return sequence_.before;
  return part == Part::kRepeated ? sequence_.repeated : sequence_.after;
}

Duration Player::time_of(const std::vector<TimedFrame>& frames) const {
  Duration time{0};
  for (const TimedFrame& each : frames) {
    time += pacing_.line_time(kOverheadFrameBytes) +
            std::max(each.hold, pacing_.silence_after(each.frame));
  }
  return time;
}

}  // namespace swarmtalk::kilobot_bridge
