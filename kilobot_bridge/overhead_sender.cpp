#include "kilobot_bridge/overhead_sender.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::kilobot_bridge {
namespace {

constexpr unsigned kStops = 2;  // one may lose a byte on the line, and nobody would know
constexpr auto kLinePoll = std::chrono::milliseconds(1);
/// A repetition ends by itself so long after it should have been ended, in case that nobody is left
/// to do it; more than the line and a busy machine ever need.
constexpr auto kGrace = std::chrono::seconds(2);
constexpr auto kStallLimit = std::chrono::milliseconds(500);  // beyond the time the bytes take

}  // namespace

OverheadSender::OverheadSender(const Pacing& pacing, OverheadLine& line, FrameSource& source)
    : pacing_(pacing), line_(line), source_(source) {}

void OverheadSender::open(Time now, Duration settle, bool asks_version) {
  close();
  asks_version_ = asks_version;
  padding_.on_reopened();
  state_ = State::kSettling;
  due_ = now + settle;
}

void OverheadSender::close() {
  state_ = State::kClosed;
  bytes_.clear();
  handed_over_ = 0;
  is_ready_ = has_stalled_ = false;
  stops_owed_ = 0;
}

OverheadSender::Time OverheadSender::poll(Time now) {
  for (;;) {
    switch (state_) {
      case State::kClosed:
        return Time::max();
      case State::kSettling:
        if (now < due_) return due_;
        put_on_line({stop_frame(), Duration(0)}, now);
        break;
      case State::kOnLine:
        if (const Time later = wait_for_line(now); later > now) return later;
        break;
      case State::kSilent:
        if (now < due_) return due_;
        if (std::exchange(asks_version_, false)) {
          put_on_line({version_question_frame(), Duration(0)}, now);
          break;
        }
        state_ = State::kFree;
        is_ready_ = true;
        break;
      case State::kFree: {
        const auto frame = take();
        if (!frame) return Time::max();
        put_on_line(*frame, now);
        break;
      }
    }
  }
}

// The source's next, else the end of a repetition.
std::optional<TimedFrame> OverheadSender::take() {
  while (auto frame = source_.next_frame()) {
    if (frame_problem(frame->frame).empty()) return frame;
    ++counters_.withheld_frames;
  }
  if (stops_owed_ > 0) return TimedFrame{stop_frame(), Duration(0)};
  return std::nullopt;
}

void OverheadSender::put_on_line(const TimedFrame& frame, Time now) {
  const Duration hold = std::max(frame.hold, pacing_.silence_after(frame.frame));
  bytes_ = padding_.pad(is_repeated(frame.frame) ? ending_after(frame.frame, hold + kGrace)
                                                 : frame.frame);
  silence_ = pacing_.to_ours(pacing_.silence_after(frame.frame));
  hold_ = std::max(silence_, pacing_.to_ours(frame.hold));
  if (is_repeated(frame.frame)) {
    stops_owed_ = kStops;
  } else if (stops_owed_ > 0) {
    --stops_owed_;  // each other frame ends a repetition too
  }
  ++counters_.frames;
  counters_.padding_bytes += bytes_.size() - frame.frame.size();
  handed_over_ = 0;
  due_ = now + pacing_.to_ours(pacing_.line_time(bytes_.size()));
  state_ = State::kOnLine;
  push_bytes();
}

void OverheadSender::push_bytes() {
  if (handed_over_ == bytes_.size()) return;
  const auto rest = std::span<const std::uint8_t>(bytes_).subspan(handed_over_);
  const std::size_t taken = std::min(line_.write_line(rest), rest.size());
  padding_.on_written(rest.first(taken));
  counters_.bytes += taken;
  handed_over_ += taken;
}

// @return `now` when the line has taken everything and the silence has begun, else when to look
OverheadSender::Time OverheadSender::wait_for_line(Time now) {
  if (handed_over_ < bytes_.size()) {
    push_bytes();
    // The rest takes its time from here.
    if (handed_over_ == bytes_.size()) {
      due_ = std::max(due_, now + pacing_.to_ours(pacing_.line_time(bytes_.size())));
    }
  }
  if (now < due_ && handed_over_ == bytes_.size()) return due_;
  if (state_ != State::kOnLine) return Time::max();  // closed by what the write found
  if (handed_over_ < bytes_.size() || !line_.is_drained()) {
    has_stalled_ = now >= due_ + kStallLimit;
    return has_stalled_ ? Time::max() : now + kLinePoll;
  }
  silent_until_ = now + silence_;
  due_ = now + hold_;
  state_ = State::kSilent;
  return now;
}

void OverheadSender::cut_hold() {
  hold_ = silence_;
  if (state_ == State::kSilent) due_ = std::min(due_, silent_until_);
}

Duration OverheadSender::left(Time now) const {
  if (state_ != State::kOnLine && state_ != State::kSilent) return Duration(0);
  const Duration wait = std::max(Duration(0), Duration(due_ - now));
  return state_ == State::kOnLine ? wait + hold_ : wait;
}

std::vector<std::uint8_t> OverheadSender::last_words() {
  if (state_ == State::kClosed || state_ == State::kSettling) return {};
  std::vector<std::uint8_t> bytes;
  for (unsigned i = 0; i < kStops; ++i) {
    const std::vector<std::uint8_t> stop = padding_.pad(stop_frame());
    padding_.on_written(stop);
    bytes.insert(bytes.end(), stop.begin(), stop.end());
  }
  return bytes;
}

}  // namespace swarmtalk::kilobot_bridge
