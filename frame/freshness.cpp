#include "frame/freshness.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::frame {
namespace {

constexpr std::size_t kStampBytes = 3;
constexpr std::size_t kMarkAt = kStampBytes + 6;
constexpr std::size_t kCountBytes = 2;  // asks, answers
constexpr std::uint8_t kItemsFollow = 1;
constexpr std::size_t kMostAsks = 128;
constexpr std::size_t kMostAnswers = 200;
constexpr std::size_t kMostUnasked = 64;   // answers to strangers who did not ask
constexpr Freshness::Ms kLatelyMs = 2000;  // who is asked and answered was heard since
constexpr Freshness::Ms kAskAgainMs = 150;
constexpr Freshness::Ms kYoungMs = 2000;
constexpr Freshness::Ms kRenewAgainMs = 5000;
constexpr std::uint8_t kAskAloud = 5;  // frames for an ask alone, for each new voice

Freshness::Ms since(Freshness::Ms then, Freshness::Ms now) {
  return now > then ? now - then : 0;
}

std::uint32_t stamp_of(std::span<const std::uint8_t> plaintext) {
  std::uint32_t stamp = 0;
  for (std::size_t i = 0; i < kStampBytes; ++i) stamp = stamp << 8 | plaintext[i];
  return stamp;
}

}  // namespace

Freshness::Freshness(const Voice& own, Ms now, Draw draw)
    : own_(own), draw_(std::move(draw)), began_at_(now), voices_(now), speak_at_(now) {
  nonces_.roll(now, draw_);
}

void Freshness::change_own(const Voice& own, Ms now) {
  own_ = own;
  began_at_ = now;
  speak_by(now);
}

void Freshness::speak_by(Ms when) {
  const Ms soonest = has_written_ ? last_written_at_ + kGapMs : began_at_;
  speak_at_ = std::min(speak_at_, std::max(when, soonest));
}

bool Freshness::is_answer_due(const HeardVoice& other, Ms now) const {
  if (since(other.last_at, now) > kLatelyMs) return false;
  if (other.has_asked) return true;
  const bool is_eager = since(began_at_, now) < kEagerMs || since(other.first_at, now) < kEagerMs;
  return is_eager && !other.is_answered;
}

bool Freshness::is_ask_due(const HeardVoice& other, Ms now) const {
  if (since(other.last_at, now) > kLatelyMs) return false;
  return !other.asked_at || since(*other.asked_at, now) >= kAskAgainMs;
}

bool Freshness::is_renewal_due(const ProvenVoice& other, Ms now) const {
  if (since(other.last_at, now) > kLatelyMs) return false;
  if (!other.is_doubted && since(other.proven_at, now) < kRenewMs) return false;
  const Ms pause = other.is_doubted && other.asks < kAskAloud ? kAskAgainMs : kRenewAgainMs;
  return !other.asked_at || since(*other.asked_at, now) >= pause;
}

std::size_t Freshness::wanted_bytes(Ms now) const {
  std::size_t asks = 0;
  std::size_t answers = 0;
  for (const ProvenVoice& each : voices_.proven()) {
    asks += is_renewal_due(each, now) ? 1U : 0U;
    answers += is_answer_due(each, now) ? 1U : 0U;
  }
  std::size_t unasked = 0;
  for (const HeardVoice& each : voices_.strangers()) {
    asks += is_ask_due(each, now) ? 1U : 0U;
    if (!is_answer_due(each, now)) continue;
    ++(each.has_asked ? answers : unasked);
  }
  asks = std::min(asks, kMostAsks);
  answers = std::min(answers + std::min(unasked, kMostUnasked), kMostAnswers);
  if (asks + answers == 0) return kLeastBytes;
  return kLeastBytes + kCountBytes + asks * kAskBytes + answers * kAnswerBytes;
}

std::size_t Freshness::write(Ms now, std::span<std::uint8_t> room) {
  // A nonce from our start proves of no frame that it was sent after it.
  nonces_.roll(now, draw_,
               since(voices_.remembers_since(), now) < kYoungMs ? kGapMs : OwnNonces::kRollMs);
  last_written_at_ = now;
  has_written_ = true;
  speak_at_ = now + kSilenceMs;
  const auto stamp =
      static_cast<std::uint32_t>(since(began_at_, now) / StampClock::kStampMs) & StampClock::kMask;
  for (std::size_t i = 0; i < kStampBytes; ++i) {
    room[i] = static_cast<std::uint8_t>(stamp >> 8 * (kStampBytes - 1 - i));
  }
  std::copy(nonces_.newest().begin(), nonces_.newest().end(), room.begin() + kStampBytes);
  room[kMarkAt] = 0;
  if (room.size() < kLeastBytes + kCountBytes + kAskBytes) return kLeastBytes;
  std::size_t left = room.size() - kLeastBytes - kCountBytes;

  std::array<std::array<std::uint8_t, kAskBytes>, kMostAsks> asks;
  std::array<Nonce, kMostAnswers> answers;
  std::size_t ask_count = 0;
  std::size_t answer_count = 0;
  std::size_t unasked = 0;
  const auto answer = [&](HeardVoice& other) {
    if (answer_count == kMostAnswers || left < kAnswerBytes) return;
    left -= kAnswerBytes;
    answers[answer_count++] = other.nonce;
    other.is_answered = true;
    other.has_asked = false;
  };
  const auto ask = [&](HeardVoice& other) {
    if (ask_count == kMostAsks || left < kAskBytes) return;
    left -= kAskBytes;
    std::copy_n(other.voice.begin(), kAskBytes, asks[ask_count++].begin());
    other.asked_at = now;
    if (other.asks < UINT8_MAX) ++other.asks;
  };
  const std::span<HeardVoice> strangers = voices_.strangers();
  // Who asks is alive: it knows our session. Others may be frames of long ago.
  for (ProvenVoice& each : voices_.proven()) {
    if (is_answer_due(each, now)) answer(each);
  }
  for (HeardVoice& each : strangers) {
    if (each.has_asked && is_answer_due(each, now)) answer(each);
  }
  for (ProvenVoice& each : voices_.proven()) {
    if (is_renewal_due(each, now)) ask(each);
  }
  for (std::size_t i = 0; i < strangers.size(); ++i) {
    HeardVoice& each = strangers[(next_answer_ + i) % strangers.size()];
    if (is_ask_due(each, now)) ask(each);
    if (!is_answer_due(each, now) || unasked == kMostUnasked) continue;
    ++unasked;
    answer(each);
  }
  if (!strangers.empty()) next_answer_ = (next_answer_ + kMostUnasked) % strangers.size();
  if (ask_count + answer_count == 0) return kLeastBytes;
  room[kMarkAt] = kItemsFollow;
  room[kLeastBytes] = static_cast<std::uint8_t>(ask_count);
  room[kLeastBytes + 1] = static_cast<std::uint8_t>(answer_count);
  auto out = room.begin() + kLeastBytes + kCountBytes;
  for (std::size_t i = 0; i < ask_count; ++i) out = std::copy(asks[i].begin(), asks[i].end(), out);
  for (std::size_t i = 0; i < answer_count; ++i) {
    out = std::copy(answers[i].begin(), answers[i].end(), out);
  }
  return static_cast<std::size_t>(out - room.begin());
}

bool Freshness::skip(std::span<const std::uint8_t> plaintext, std::size_t& used) {
  if (plaintext.size() < kLeastBytes || plaintext[kMarkAt] > kItemsFollow) return false;
  used = kLeastBytes;
  if (plaintext[kMarkAt] != kItemsFollow) return true;
  if (plaintext.size() < kLeastBytes + kCountBytes) return false;
  used +=
      kCountBytes + plaintext[kLeastBytes] * kAskBytes + plaintext[kLeastBytes + 1] * kAnswerBytes;
  return used <= plaintext.size();
}

Freshness::Verdict Freshness::receive(const Voice& voice, std::uint32_t counter,
                                      std::span<const std::uint8_t> plaintext, Ms at,
                                      std::size_t& used) {
  has_proven_ = false;
  if (!skip(plaintext, used)) return Verdict::kMalformed;
  const std::uint32_t stamp = stamp_of(plaintext);
  std::span<const std::uint8_t> asks;
  std::span<const std::uint8_t> answers;
  if (used > kLeastBytes) {
    const std::span<const std::uint8_t> items = plaintext.subspan(kLeastBytes + kCountBytes);
    asks = items.first(plaintext[kLeastBytes] * kAskBytes);
    answers = items.subspan(asks.size(), plaintext[kLeastBytes + 1] * kAnswerBytes);
  }
  if (const auto drawn_at = nonces_.proof_in(answers, at)) {
    has_proven_ = true;
    voices_.prove(voice, counter, stamp, *drawn_at, at);
  }
  ProvenVoice* const proven = voices_.find_proven(voice);
  Verdict verdict = Verdict::kNotProven;
  if (proven != nullptr) {
    const bool is_trusted = since(proven->proven_at, at) <= kTrustMs;
    if (is_trusted) verdict = judge(*proven, counter, stamp, at);
    if (verdict == Verdict::kReplayed) return verdict;
    proven->is_doubted = proven->is_doubted || verdict != Verdict::kFresh;
  }
  HeardVoice& other = voices_.heard(voice, at);
  if (verdict == Verdict::kTooOld) {
    if (other.asks < kAskAloud) speak_by(at);
    return verdict;
  }
  Nonce nonce;
  std::copy_n(plaintext.begin() + kStampBytes, nonce.size(), nonce.begin());
  meet(other, nonce, asks, verdict == Verdict::kFresh, at);
  return verdict;
}

// A frame tells its robot's nonce, and whether it asks for ours.
void Freshness::meet(HeardVoice& other, const Nonce& nonce, std::span<const std::uint8_t> asks,
                     bool is_believed, Ms at) {
  if (nonce != other.nonce) {
    other.nonce = nonce;
    other.is_answered = false;
  }
  for (std::size_t i = 0; i < asks.size(); i += kAskBytes) {
    const auto tag = asks.subspan(i, kAskBytes);
    if (std::equal(tag.begin(), tag.end(), own_.begin())) other.has_asked = true;
  }
  if (!other.has_asked && (is_believed || other.asks >= kAskAloud)) return;
  // Everybody waits a while of its own, so that not all speak at once.
  std::array<std::uint8_t, 1> random{};
  draw_(random);
  speak_by(at + random[0] * kGapMs / 256);
}

Freshness::Verdict Freshness::judge(ProvenVoice& voice, std::uint32_t counter, std::uint32_t stamp,
                                    Ms at) {
  if (voice.window.was_heard(counter)) return Verdict::kReplayed;
  if (since(voice.clock.sent_at(stamp), at) > kBoundMs + voice.clock.drift(at)) {
    return Verdict::kTooOld;
  }
  voice.window.remember(counter);
  return Verdict::kFresh;
}

// What the voice sent before its proof was heard by nobody here, unless that was before our start,
// or by us before we forgot the voice. Both are left out by the earliest time at which the frame
// can have been sent: a proof tells that of the frame it is in, stamps tell it of those before.
Freshness::Verdict Freshness::judge_held(const Voice& voice, std::uint32_t counter,
                                         std::span<const std::uint8_t> plaintext, Ms at,
                                         std::size_t& used) const {
  if (!skip(plaintext, used)) return Verdict::kMalformed;
  const ProvenVoice* const proven = voices_.find_proven(voice);
  if (proven == nullptr) return Verdict::kNotProven;
  if (counter >= proven->first) return Verdict::kReplayed;
  const std::uint32_t stamp = stamp_of(plaintext);
  const Ms sent_at = proven->clock.sent_at(stamp);
  if (since(sent_at, at) > kBoundMs) return Verdict::kTooOld;
  return sent_at >= voices_.remembers_since() + proven->clock.doubt(stamp) ? Verdict::kFresh
                                                                           : Verdict::kNotProven;
}

bool Freshness::may_be_proven(const Voice& voice, Ms at) const {
  const HeardVoice* const stranger = voices_.find_stranger(voice);
  return stranger != nullptr && since(stranger->first_at, at) <= kEagerMs;
}

bool Freshness::was_heard(const Voice& voice, std::uint32_t counter) const {
  const ProvenVoice* const proven = voices_.find_proven(voice);
  return proven != nullptr && proven->window.was_heard(counter);
}

}  // namespace swarmtalk::frame
